"""The misprint of the final size."""

from math import exp

from papers.epidemic.printed import DATA
from replication.audit.declare import Erratum, Proof, Results

PRINTED, MEANT = DATA["final"], "0.8926"


def digits(results: Results) -> Proof:
    """The printed number is no root of the equation of the final size, the corrected one is, to its digits."""
    printed, meant = (abs(z - 1 + exp(-float(DATA["reproduction"]) * z)) for z in (float(PRINTED), float(MEANT)))
    return Proof(
        holds=meant < 5e-5 < printed,
        text="The text's own equation of the final size is met by the corrected number, to its digits, and no other.",
        quantities={"residual as printed": printed, "residual as corrected": meant},
    )


ERRATA = (Erratum(id="digits", place="Sec. 3", printed=PRINTED, meant=MEANT, prove=digits),)

"""Three numbers, and the misprint of one of them."""

from math import exp, log

from papers.epidemic.printed import DATA
from replication.audit.declare import Part
from replication.audit.model import Erratum, Evidence, Proof, Results

SETTING = Part("Sec. 2", reason="Parameters.")
RESULTS = Part("Sec. 3", reading="none", figures="course")

REPRODUCTION, DAYS = float(DATA["reproduction"]), float(DATA["days"])


def final_size() -> float:
    """The root of z = 1 - exp(-R z) by bisection."""
    low, high = 0.5, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if middle < 1 - exp(-REPRODUCTION * middle) else (low, middle)
    return low


@RESULTS.value("growth", DATA["growth"], uses="epidemic")
def growth(results: Results) -> Evidence:
    """The infected grow at first by this rate."""
    time, infected = (results["epidemic"][name] for name in ("time", "infected"))
    rate = log(infected[1] / infected[0]) / (time[1] - time[0])
    other = f"(R - 1) / T = {(REPRODUCTION - 1) / DAYS:.6f}."
    return Evidence(method="Slope of the logarithm of the course.", cross_check=other, value=rate)


@RESULTS.value("doubling", DATA["doubling"], uses="epidemic")
def doubling(results: Results) -> Evidence:
    """They double in this time."""
    return Evidence(
        method="Logarithm of two over the rate.",
        cross_check=f"T log 2 / (R - 1) = {DAYS * log(2) / (REPRODUCTION - 1):.6f}.",
        value=log(2) / (growth(results).value or 1.0),
    )


@RESULTS.value(
    "final", DATA["final"], uses="epidemic", erratum="digits", meant="0.8926", pinned="reproduced after erratum"
)
def final(results: Results) -> Evidence:
    """So many are infected in the end."""
    other = f"Root of z = 1 - exp(-R z): {final_size():.6f}."
    return Evidence(method="End of the course.", cross_check=other, value=results["epidemic"]["final"][0])


def digits(results: Results) -> Proof:
    """The printed number is no root of the equation of the final size, the corrected one is, to its digits."""
    printed, meant = (abs(z - 1 + exp(-REPRODUCTION * z)) for z in (float(DATA["final"]), 0.8926))
    return Proof(
        holds=meant < 5e-5 < printed,
        text="The text's own equation of the final size is met by the corrected number, to its digits, and no other.",
        quantities={"residual as printed": printed, "residual as corrected": meant},
    )


ERRATA = (Erratum(id="digits", place="Sec. 3", printed="0.8296", meant="0.8926", prove=digits),)

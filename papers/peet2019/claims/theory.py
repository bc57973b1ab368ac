"""Secs. III-VIII: the theorems, each as printed and as corrected, on random data."""

from __future__ import annotations

from functools import partial

from replication.audit.declare import Part, below
from replication.audit.model import Evidence, Results, SolverRecord, Verdict

ROUNDING = 1e-10
"""Residuals of an identity below this are rounding: the data are of size one."""
WHY_ROUNDING = "An identity holds up to the rounding of quadrature and linear algebra on data of size one."

CORRECTED = Verdict.REPRODUCED_AFTER_ERRATUM

THEOREM_3 = Part("Theorems 1 and 3, eq. (10)")
COROLLARY_2 = Part("Corollary 2", reason="Its cone is defined in Part 1, not at hand; one of our own is used.")
THEOREM_4 = Part("Theorem 4 and Lemma 5")


def _residuals(method: str, corrected: float, as_printed: float) -> Evidence:
    """An identity holds as corrected, and as printed it does not."""
    return below(
        corrected,
        ROUNDING,
        WHY_ROUNDING,
        method=method,
        quantities={"largest residual, corrected": corrected, "median residual, as printed": as_printed},
        as_printed=below(as_printed, ROUNDING, WHY_ROUNDING, method=method),
    )


def identity(misprint: str, results: Results) -> Evidence:
    """The identity of Sec. VI with one group of terms as printed, and with none."""
    found = results["identities"]["theorem_3"]
    method = "Both sides of the identity of Sec. VI for random polynomials, two delays, by quadrature."
    return _residuals(method, found["none"]["largest"], found[misprint]["median"])


def inverse(part: str, results: Results) -> Evidence:
    """Theorem 4 or Lemma 5 as printed and corrected."""
    found = results["inversion"][part]
    method = "The formulas on random coercive operators with two delays, τ_K ≠ 1, against a numerical inverse."
    return _residuals(method, found["corrected"]["largest"], found["printed"]["median"])


for _misprint, _erratum, _place, _what in (
    ("eq10-factor", "eq-10-factor", "Eq. (10)", "The second row of 𝒵 against the blocks of Theorem 3."),
    ("d-sign", "theorem-3-signs", "Theorem 3, D", "The blocks of D that hold S_i(-τ_i)."),
    ("e-transposes", "theorem-3-transposes", "Theorem 3, E_i", "The transposes in E_i, Φ_0i and Φ_ji."),
    ("f-sign", "theorem-3-signs", "Theorem 3, F_i", "The term of F_i that holds the derivative of S_i."),
    ("theorem-1-sign", "proof-square", "Sec. VI, proof", "The square of C_1e in the identity that the proof states."),
):
    THEOREM_3.feasible(
        f"theory.{_misprint}",
        place=_place,
        statement=f"{_what} The dissipation is the quadratic form of Theorem 3.",
        pinned=CORRECTED,
        uses="identities",
        erratum=_erratum,
    )(partial(identity, _misprint))


@THEOREM_3.feasible(
    "theory.theorem-3-feasible",
    place="Theorem 3",
    pinned=CORRECTED,
    uses=("printed-signs", "loop.ex2"),
    erratum="theorem-3-signs",
)
def feasible(results: Results) -> Evidence:
    """The condition of Theorem 3 can be met with ε > 0."""
    printed, loop = results["printed-signs"]["0.001"], results["loop.ex2"]
    return Evidence(
        method="SDPA on Theorem 3 with ε > 0 for Example 2; the corrected certificate passes a Galerkin check.",
        holds=loop["storage"] > 0.0 and loop["dissipation"] <= 0.0,
        margin=loop["storage"],
        quantities={"least eigenvalue of 𝒫": loop["storage"], "largest eigenvalue of the form": loop["dissipation"]},
        solvers=(SolverRecord(**loop["solver"]),),
        as_printed=Evidence(
            method="As printed, -D ⪰ 0 asks S(-τ) ⪯ 0 while the first condition asks S(-τ) ⪰ ε.",
            holds=not printed["refuted"],
            note="One equality of the program is a sum of non-negative terms that ought to be negative.",
        ),
    )


for _part, _place, _statement in (
    ("theorem-4", "Theorem 4", "The given operator inverts an operator of the form (8)."),
    ("lemma-5", "Lemma 5", "The gains of Lemma 5 compose the inverse of Theorem 4 with 𝒵 of (10)."),
):
    THEOREM_4.feasible(
        f"theory.{_part}",
        place=_place,
        statement=_statement,
        pinned=CORRECTED,
        uses="inversion",
        erratum="theorem-4-factors",
    )(partial(inverse, _part.replace("-", "_")))

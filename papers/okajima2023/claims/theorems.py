"""Sec. III: Theorems 1 and 2, as identities on random data and as facts of all designs."""

from __future__ import annotations

from functools import partial

from papers.okajima2023.cases import DESIGNS, GAIN_SETS, case, gain_set
from papers.okajima2023.claims.formulation import identity
from replication.audit.declare import Part, below, positive
from replication.audit.model import Evidence, Results

THEOREMS = Part("Sec. III, Theorems 1 and 2")

ROUTE_TOLERANCE = 1e-8
ROUTE_REASON = "Relative distance of two routes to the same level; an interior-point solver ends about this near."
PRINTED_GAINS = tuple(map(gain_set, GAIN_SETS))

THEOREMS.feasible(
    "theory.dissipation",
    place="Eqs. (20)-(23)",
    statement="The quadratic form of the matrix (20) is the dissipation of eq. (23).",
    uses="identities",
)(partial(identity, "dissipation", "Quadratic form of (20) against the left-hand side of (23)"))

THEOREMS.feasible(
    "theory.schur",
    place="Eqs. (30)-(32)",
    statement="With Y = P L, the inequality (30) is the inequality (19) by a Schur complement.",
    uses="identities",
)(partial(identity, "schur", "Schur complement of (30) against (20)"))


@THEOREMS.feasible("theory.theorem1", place="Theorem 1", uses=PRINTED_GAINS)
def theorem1_is_exact(results: Results) -> Evidence:
    """The matrix inequality of Theorem 1 evaluates the gain of a given observer."""
    return below(
        max(abs(results[name]["theorem1"] / results[name]["norm"]["value"] - 1) for name in PRINTED_GAINS),
        ROUTE_TOLERANCE,
        ROUTE_REASON,
        method="Relative distance of Theorem 1's smallest level from the exact norm, largest of the four gain sets.",
        note="The text proves only that the condition is sufficient; it is also tight.",
    )


@THEOREMS.feasible("theory.theorem2", place="Theorem 2", uses=DESIGNS)
def theorem2_is_exact(results: Results) -> Evidence:
    """Minimising the level under Theorem 2 finds the optimal observer."""
    return below(
        max(abs(results[name]["lmi"]["level"] / results[name]["optimum"] - 1) for name in DESIGNS),
        ROUTE_TOLERANCE,
        ROUTE_REASON,
        method="Relative distance of Theorem 2's level from the exact optimum, largest of all designs.",
        quantities={"smallest eigenvalue of all P_k, Sec. IV-A": results[case("proposed")]["smallest_eigenvalue_P"]},
        note=(
            "The text claims sufficiency only; the condition loses nothing. The inequality forces P_k > WᵀW, more than "
            "the P_k > 0 that it is stated with."
        ),
    )


@THEOREMS.feasible("theory.gains-attain", place="Eq. (31)", uses=DESIGNS)
def gains_attain_level(results: Results) -> Evidence:
    """The gains P⁻¹Y of eq. (31) achieve the level of Theorem 2."""
    return below(
        max(results[name]["lmi"]["norm"] / results[name]["lmi"]["level"] - 1 for name in DESIGNS),
        ROUTE_TOLERANCE,
        ROUTE_REASON,
        method="Exact norm of the gains from the inequality as printed, relative to its level; largest of all designs.",
    )


@THEOREMS.feasible("theory.stable", place="Theorems 1 and 2, eqs. (33), (38)-(40)", uses=PRINTED_GAINS)
def stabilised(results: Results) -> Evidence:
    """The error system with the printed gains is stable."""
    return positive(
        1 - max(results[name]["spectral_radius"] for name in PRINTED_GAINS),
        method="Spectral radius over one period, largest of the four printed gain sets.",
    )

"""Secs. I to III: equations of the formulation, Theorems 1 and 2, on the example and on random plants."""

from functools import partial
from typing import Any

from papers._common import by_margin, solvers
from papers.okajima2023.claims.levels import OBSERVERS, of_gains
from papers.okajima2023.experiments.declared import CASES, DESIGNS, GAIN_SETS, case, gain_set, times
from papers.okajima2023.printed import DATA, PLANT, SCHEDULES
from replication.audit.declare import Part, below, number, positive, rounded
from replication.audit.model import NO_READING, Evidence, Results
from replication.verify.predicate import Predicate, Term, term

CYCLIC_FULL, CYCLIC_BLOCKS = "one full P", "P in blocks"
EARLIER = Part("Sec. I, size of the earlier design", reading=CYCLIC_FULL)
FORMULATION = Part("Sec. II, plant, schedules, observer, error system", reading=NO_READING)

TIMES = times(CASES["proposed"])
SIZES: dict[str, Any] = {
    "states": len(PLANT["A"]),
    "sensors": len(PLANT["C"]),
    "disturbances": len(PLANT["B_d"][0]),
    "inputs": len(number(DATA["plant"]["B_u"])[0]),
}
"""Of the example; the identities are stated for plants of that size."""

IDENTITY_TOLERANCE = 1e-12
"""Rounding alone leaves about a thousandth of it."""


@EARLIER.order(
    "size.cyclic-larger",
    place="Sec. I, on the earlier design by cycling",
    says=[
        Predicate(
            of=term("rows of the cyclic inequality", "stable", **TIMES),
            relation="more than",
            to=term("rows of Theorem 2", "stable"),
            reading=reading,
        )
        for reading in (CYCLIC_FULL, CYCLIC_BLOCKS)
    ],
)
def cyclic_is_larger(results: Results) -> Evidence:
    """For N₁ = 2 and N₂ = 3 the one inequality of the cyclic reformulation has more rows than each of Theorem 2."""
    size = results[case("proposed")]["size"]
    margin = float(size["cyclic_rows"] - size["rows"])
    return by_margin(
        # The blocks of P do not change the rows, only the unknowns.
        {CYCLIC_FULL: margin, CYCLIC_BLOCKS: margin},
        method="Rows counted: the cyclic plant has N times the states, disturbances and sensors.",
        quantities={
            "rows, cyclic": size["cyclic_rows"],
            "rows of each inequality, Theorem 2": size["rows"],
            "variables, cyclic with a full P": size["cyclic_variables"],
            "variables, Theorem 2 (or cyclic with a P of blocks)": size["variables"],
        },
        note="The rows of the cyclic form grow with N, those of each inequality of Theorem 2 do not. All N "
        "inequalities together have as many rows as the cyclic form.",
    )


@FORMULATION.feasible("theory.observable", place="Sec. II-A", says=term("observability", "stable"))
def observable(results: Results) -> Evidence:
    """The pair (C, A) of the example is observable."""
    return positive(
        results["observability"]["margin"],
        method="Smallest singular value of the observability matrix relative to the largest.",
    )


def diagonals_of_selection(name: str, results: Results) -> Evidence:
    """The diagonals of S_0 ... S_{N-1} of one example."""
    return Evidence(
        method="Schedule rule: sensor i measures at k iff k - θᵢ is a multiple of Nᵢ.",
        value=tuple(tuple(row) for row in results[f"schedule.{name}"]["diagonals"]),
    )


for _name, _printed in SCHEDULES.items():
    FORMULATION.matrix(
        f"schedule.{_name}",
        _printed["diagonals"],
        statement=f"Diagonals of S₀, S₁, … for periods {tuple(_printed['periods'])} and offsets "
        f"{tuple(_printed['offsets'])}, one row per instant.",
        says=term("measured sensors", **times(_printed)),
    )(partial(diagonals_of_selection, _name))


@FORMULATION.value("schedule.common-period", DATA["common-period"], says=term("common period", **TIMES))
def common_period(results: Results) -> Evidence:
    """The period of the observer for N₁ = 2 and N₂ = 3."""
    return Evidence(method="Least common multiple.", value=float(results["schedule.sec-4a"]["period"]))


FORMULATION.cited(
    "cited.16",
    place="After eq. (15); blog",
    statement="With S₀ = I and no other measurement, (15) is the dual-sampling-rate observer of reference [16].",
    reason="It reports another paper, which is not at hand. The schedule: claim theory.dual-rate.",
)


@FORMULATION.feasible(
    "theory.dual-rate",
    place="After eq. (15)",
    ours=True,
    says=term("dual-rate schedule", **times(CASES["C"])),
)
def dual_rate_is_special_case(results: Results) -> Evidence:
    """Equal periods without offsets, here 6, give S₀ = I and no other measurement: the dual-rate schedule."""
    first, *others = results["schedule.dual-rate"]["diagonals"]
    return Evidence(
        method="Schedule with N₁ = N₂ = 6 and no offset.",
        holds=all(value == 1 for value in first) and not any(value for row in others for value in row),
        note="Whether (15) is then the observer of reference [16] is claim cited.16.",
    )


def identity(residual: str, what: str, results: Results, note: str = "") -> Evidence:
    """One of the residuals of the identities on random data."""
    result = results["identities"]
    return rounded(
        result[residual],
        zero=IDENTITY_TOLERANCE,
        method=f"{what}, on {result['trials']} random problems of several sizes; largest relative residual.",
        quantities={"largest relative residual": result[residual]},
        note=note,
    )


FORMULATION.feasible(
    "theory.error-system",
    place="Eq. (16)",
    statement="For plants of the size of the example, the error of the observer (15) obeys the error system (16).",
    says=term("error system (16)", **SIZES),
)(partial(identity, "error_system", "Plant and observer in their own loops against the error system"))


@FORMULATION.feasible(
    "theory.product",
    place="After eq. (16)",
    says=term("same poles from the next instant", "gains-33", **TIMES),
)
def start_of_the_period(results: Results) -> Evidence:
    """For the gains (33), starting the product for A_e at instant 1, as printed, or at 0 gives the same poles."""
    orders = results["product-orders"]
    shifted, ascending = (
        max(abs(a - b) for a, b in zip(orders["descending"], orders[order], strict=True))
        for order in ("shifted", "ascending")
    )
    return below(
        shifted,
        IDENTITY_TOLERANCE,
        "Moduli that are equal in exact arithmetic: rounding alone leaves far less.",
        method="Moduli of the eigenvalues of the product over one period, started at 1 and at 0.",
        quantities={
            "difference if the product starts at 1 instead of 0": shifted,
            "difference if the factors are taken in the other order": ascending,
        },
        note="Conditions and printed gains count from 0 to N − 1, the product from 1 to N; the moduli are the same. "
        "With later factors to the right, which the product sign alone could mean, they are others.",
    )


# Sec. III: steps of the proofs of Theorems 1 and 2 on random data, and both theorems at the designs of Sec. IV


THEOREMS = Part("Sec. III, Theorems 1 and 2", reading=NO_READING)

ROUTE_TOLERANCE = 1e-8
ROUTE_REASON = "Relative distance of two routes to the same level, tighter than what is claimed; solvers end so near."
PRINTED_GAINS = tuple(map(gain_set, GAIN_SETS))
OF_SEC_4 = f"the {len(DESIGNS)} designs of Sec. IV for the stable plant"


def at_most_a_millionth(of: Term) -> Predicate:
    """What these claims say of a relative distance."""
    return Predicate(of=of, relation="at most", to="1e-6")


THEOREMS.feasible(
    "theory.dissipation",
    place="Eqs. (20)-(23)",
    statement="For plants of the size of the example, the quadratic form of (20) is the left-hand side of eq. (23).",
    says=term("identity (23)", **SIZES),
)(partial(identity, "dissipation", "Quadratic form of (20) against the left-hand side of (23)"))

THEOREMS.feasible(
    "theory.schur",
    place="Eqs. (30)-(32)",
    statement="For plants of the size of the example, the Schur complement of (30) with Y = P L is the matrix (20).",
    says=term("Schur complement (32)", **SIZES),
)(
    partial(
        identity,
        "schur",
        "Schur complement of (30) against (20)",
        note="Our copy lacks the matrix of (32) between them.",
    )
)


@THEOREMS.feasible("theory.sufficient-1", place="Theorem 1", says=term("Theorem 1"))
def condition_of_theorem_1_suffices(results: Results) -> Evidence:
    """If (20) is positive definite at each instant, A_e is Schur and the l2 gain is below γ."""
    sums, gains = results["summation"], [results[name] for name in PRINTED_GAINS]
    return _suffices(
        results["identities"]["dissipation"],
        [sums["bound_28"] - sums["largest_ratio"], *(1 - gain["spectral_radius"] for gain in gains)],
        "Quadratic form of (20) against (23) on random problems; beside it the ratio of norms in draws against (28), "
        "and the stability of A_e with the printed gains, whose levels Theorem 1 gives.",
    )


@THEOREMS.feasible("theory.sufficient-2", place="Theorem 2", says=term("Theorem 2"))
def condition_of_theorem_2_suffices(results: Results) -> Evidence:
    """If (30) is positive definite at each instant, the gains (31) make A_e Schur and the l2 gain less than γ."""
    return _suffices(
        results["identities"]["schur"],
        [ROUTE_TOLERANCE - (results[name]["lmi"]["norm"] / results[name]["lmi"]["level"] - 1) for name in DESIGNS],
        "Schur complement of (30) against (20) on random problems; beside it the exact norm of the gains (31) against "
        "the level of each design.",
    )


def _suffices(residual: float, margins: list[float], method: str) -> Evidence:
    """The identity of a proof holds up to rounding, and nothing computed contradicts what follows from it."""
    return Evidence(
        method=method,
        holds=residual < IDENTITY_TOLERANCE and min(margins) > 0,
        quantities={"largest relative residual": residual},
        note="The theorem is proved for all sizes and periods. The inequality forces P_k > WᵀW, more than the P_k > 0 "
        "that it is stated with.",
    )


@THEOREMS.feasible("theory.summation", place="Eqs. (26)-(28)")
def summation(results: Results) -> Evidence:
    """For the gains (33) under random noise, summing (25) gives (26), (27) and a ratio of l2 norms within (28)."""
    sums = results["summation"]
    room = min(sums["epsilon"], sums["excess_26"], sums["excess_27"], sums["bound_28"] - sums["largest_ratio"])
    return positive(
        # The sum must also telescope: what is left of it counts against the room.
        room - sums["sum_residual"],
        method="P_k of Theorem 1 at a level above its smallest one, ε of (22) from the least eigenvalue; both sides "
        f"of (26) and (27) over the energy of the noise, and the root of (28), in {sums['draws']} draws: least room.",
        solvers=solvers(sums),
        quantities={
            "level": sums["level"],
            "ε": sums["epsilon"],
            "bound of (28)": sums["bound_28"],
            "largest ratio in the draws": sums["largest_ratio"],
            "distance of the sum from the left-hand side of (26)": sums["sum_residual"],
        },
    )


@THEOREMS.feasible(
    "theory.theorem1",
    place="Theorem 1",
    ours=True,
    says=[at_most_a_millionth(of_gains("excess of Theorem 1", equation)) for equation in GAIN_SETS],
)
def theorem1_is_exact(results: Results) -> Evidence:
    """For the four gain sets printed for the stable plant Theorem 1 gives their l2 gain, to one part in a million."""
    return below(
        max(abs(results[name]["theorem1"] / results[name]["norm"]["value"] - 1) for name in PRINTED_GAINS),
        ROUTE_TOLERANCE,
        ROUTE_REASON,
        method="Relative distance of Theorem 1's smallest level from the exact norm, largest of the four gain sets.",
        note="The theorem says that the condition suffices, for all plants; for these gains it is tight too.",
    )


@THEOREMS.feasible(
    "theory.theorem2",
    place="Theorem 2",
    statement=f"For each of {OF_SEC_4}, Theorem 2 gives, to one part in a million, the least level that any gains "
    "achieve.",
    ours=True,
    says=[
        at_most_a_millionth(term("excess of Theorem 2", "stable", OBSERVERS, **inputs)) for inputs in DESIGNS.values()
    ],
)
def theorem2_is_exact(results: Results) -> Evidence:
    """Theorem 2 against the exact optimum."""
    return below(
        max(abs(results[name]["lmi"]["level"] / results[name]["optimum"] - 1) for name in DESIGNS),
        ROUTE_TOLERANCE,
        ROUTE_REASON,
        method=f"Relative distance of Theorem 2's level from the exact optimum, largest of {len(DESIGNS)} designs.",
        quantities={"smallest eigenvalue of all P_k, Sec. IV-A": results[case("proposed")]["smallest_eigenvalue_P"]},
        note="The theorem says that the condition suffices, for all plants; for these designs it loses nothing. The "
        "inequality forces P_k > WᵀW, more than the P_k > 0 that it is stated with.",
    )


@THEOREMS.feasible(
    "theory.gains-attain",
    place="Eq. (31)",
    statement=f"For each of {OF_SEC_4}, the gains P⁻¹Y of eq. (31) achieve the level of Theorem 2, to one part in a "
    "million.",
    says=[
        at_most_a_millionth(term("excess over gains of Theorem 2", "stable", **inputs)) for inputs in DESIGNS.values()
    ],
)
def gains_attain_level(results: Results) -> Evidence:
    """The exact norm of the gains of Theorem 2 against its level."""
    return below(
        max(results[name]["lmi"]["norm"] / results[name]["lmi"]["level"] - 1 for name in DESIGNS),
        ROUTE_TOLERANCE,
        ROUTE_REASON,
        method=f"Exact norm of these gains over the level, minus one; largest of {len(DESIGNS)} designs.",
    )


@THEOREMS.feasible(
    "theory.stable",
    place="Theorems 1 and 2, eqs. (33), (38)-(40)",
    says=[of_gains("stable error system", equation) for equation in GAIN_SETS],
)
def stabilised(results: Results) -> Evidence:
    """The error system is stable with each of the four gain sets printed for the stable plant."""
    return positive(
        1 - max(results[name]["spectral_radius"] for name in PRINTED_GAINS),
        method="Spectral radius over one period, largest of the four printed gain sets.",
    )

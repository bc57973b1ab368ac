"""Secs. I and II: the size of the earlier design, the schedules S_k, the observer and its error system."""

from __future__ import annotations

from functools import partial
from typing import Any

from papers.okajima2023.experiments.declared import CASES, case, times
from papers.okajima2023.printed import DATA, PLANT, SCHEDULES, matrix
from papers.okajima2023.readings import CYCLIC_BLOCKS, CYCLIC_FULL
from replication.audit.declare import Part, below, positive
from replication.audit.model import NO_READING, Evidence, Outcome, Results
from replication.verify.predicate import Predicate, term

EARLIER = Part("Sec. I, size of the earlier design", reading=CYCLIC_FULL)
FORMULATION = Part("Sec. II, plant, schedules, observer, error system", reading=NO_READING)

TIMES = times(CASES["proposed"])
SIZES: dict[str, Any] = {
    "states": len(PLANT["A"]),
    "sensors": len(PLANT["C"]),
    "disturbances": len(PLANT["B_d"][0]),
    "inputs": len(matrix(DATA["plant"]["B_u"])[0]),
}
"""Of the example; the identities are stated for plants of that size."""

IDENTITY_TOLERANCE = 1e-12
IDENTITY_REASON = "An identity on random data, relative: rounding alone leaves about a thousandth of it."


@EARLIER.order(
    "size.cyclic-larger",
    place="Sec. I, on the earlier design by cycling",
    uses=case("proposed"),
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
    return positive(
        margin,
        method="Rows counted: the cyclic plant has N times the states, disturbances and sensors.",
        # The blocks of P do not change the rows, only the unknowns.
        outcomes=tuple(Outcome(reading=name, holds=margin > 0, margin=margin) for name in (CYCLIC_FULL, CYCLIC_BLOCKS)),
        quantities={
            "rows, cyclic": size["cyclic_rows"],
            "rows of each inequality, Theorem 2": size["rows"],
            "variables, cyclic with a full P": size["cyclic_variables"],
            "variables, Theorem 2 (or cyclic with a P of blocks)": size["variables"],
        },
        note="The rows of the cyclic form grow with N, those of each inequality of Theorem 2 do not. All N "
        "inequalities together have as many rows as the cyclic form.",
    )


@FORMULATION.feasible(
    "theory.observable", place="Sec. II-A", uses="observability", says=term("observability", "stable")
)
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
        statement=(
            f"Diagonals of S₀, S₁, … for periods {tuple(_printed['periods'])} and offsets "
            f"{tuple(_printed['offsets'])}, one row per instant."
        ),
        uses=f"schedule.{_name}",
        says=term("measured sensors", **times(_printed)),
    )(partial(diagonals_of_selection, _name))


@FORMULATION.value(
    "schedule.common-period", DATA["common-period"], uses="schedule.sec-4a", says=term("common period", **TIMES)
)
def common_period(results: Results) -> Evidence:
    """The period of the observer for N₁ = 2 and N₂ = 3."""
    return Evidence(method="Least common multiple.", value=float(results["schedule.sec-4a"]["period"]))


@FORMULATION.feasible(
    "theory.dual-rate",
    place="After eq. (15)",
    uses="schedule.dual-rate",
    says=term("dual-rate schedule", **times(CASES["C"])),
)
def dual_rate_is_special_case(results: Results) -> Evidence:
    """Equal periods without offsets, here 6, give S₀ = I and no other measurement: the dual-rate schedule."""
    first, *others = results["schedule.dual-rate"]["diagonals"]
    return Evidence(
        method="Schedule with N₁ = N₂ = 6 and no offset.",
        holds=all(value == 1 for value in first) and not any(value for row in others for value in row),
        note="Whether (15) is then the observer of the cited work cannot be checked from this text.",
    )


def identity(residual: str, what: str, results: Results) -> Evidence:
    """One of the residuals of the identities on random data."""
    result = results["identities"]
    return below(
        result[residual],
        IDENTITY_TOLERANCE,
        IDENTITY_REASON,
        method=f"{what}, on {result['trials']} random problems of several sizes; largest relative residual.",
        quantities={"largest relative residual": result[residual]},
    )


FORMULATION.feasible(
    "theory.error-system",
    place="Eq. (16)",
    statement="For plants of the size of the example, the error of the observer (15) obeys the error system (16).",
    uses="identities",
    says=term("error system (16)", **SIZES),
)(partial(identity, "error_system", "Plant and observer in their own loops against the error system"))


@FORMULATION.feasible(
    "theory.product",
    place="After eq. (16)",
    uses="product-orders",
    says=term("same poles from the next instant", "gains-33", **TIMES),
)
def start_of_the_period(results: Results) -> Evidence:
    """For the gains (33), A_eN … A_e1, as A_e is spelled out, has poles of the same moduli as A_e,N−1 … A_e0."""
    orders = results["product-orders"]
    shifted, ascending = (
        max(abs(a - b) for a, b in zip(orders["descending"], orders[other], strict=True))
        for other in ("shifted", "ascending")
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
        note=(
            "Conditions and printed gains count from 0 to N − 1, the product from 1 to N; the moduli are the same. "
            "With later factors to the right, which the product sign alone could mean, they are others."
        ),
    )

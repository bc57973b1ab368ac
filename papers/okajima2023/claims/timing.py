"""Sec. IV-B: two sensors of the same period at three mutual timings, and the gains (38)-(40)."""

from __future__ import annotations

from itertools import combinations, pairwise

from papers.okajima2023.claims.levels import achieved, below_others, level, optimum, separation
from papers.okajima2023.experiments.declared import TIMINGS
from papers.okajima2023.printed import DATA, GAINS
from replication.audit.declare import Part, positive
from replication.audit.model import NO_READING, Evidence, Results
from replication.verify.predicate import Predicate

TIMING = Part("Sec. IV-B, timing, gains (38)-(40)", reading=NO_READING, figures="timing")

for _theta, (_case, _printed) in enumerate(DATA["level-of-timing"].items()):
    level(
        TIMING,
        f"timing.case-{_case}",
        _printed,
        TIMINGS[_theta],
        f"The smallest level for N₁ = N₂ = 3 and θ₁ = 0, θ₂ = {_theta}.",
    )
    achieved(TIMING, str(38 + _theta), _printed)


@TIMING.order(
    "order.timing-matters",
    place="Sec. IV-B",
    uses=TIMINGS,
    says=[Predicate(of=optimum(a), relation="is not", to=optimum(b)) for a, b in combinations(TIMINGS, 2)],
)
def timing_matters(results: Results) -> Evidence:
    """For N₁ = N₂ = 3 the three timings have three different optimal levels."""
    levels = sorted((results[name] for name in TIMINGS), key=lambda result: result["optimum"])
    return positive(
        min(following["lower"] - before["upper"] for before, following in pairwise(levels)),
        method="Distance between brackets of exact optima.",
        quantities={"relative spread of the optimum": levels[-1]["optimum"] / levels[0]["optimum"] - 1},
    )


@TIMING.order(
    "order.timing-best",
    place="Sec. IV-B; blog",
    uses=TIMINGS,
    says=below_others(TIMINGS[1], TIMINGS[0], TIMINGS[2]),
)
def second_timing_best(results: Results) -> Evidence:
    """Of the three timings for N₁ = N₂ = 3, Case 2 has the smallest optimal level."""
    margin = min(separation(results, TIMINGS[1], TIMINGS[theta]) for theta in (0, 2))
    return positive(margin, method="Distance between brackets of exact optima.")


@TIMING.order("gains.depend-on-timing", place="Sec. IV-B", uses=TIMINGS)
def gains_depend_on_timing(results: Results) -> Evidence:
    """The three timings have different gains of the first sensor at instant 0: those printed, and our central ones."""
    # The first sensor is measured at instant 0 in all three cases.
    ours = _least_difference([[row[0] for row in results[name]["gains"][0]] for name in TIMINGS])
    printed = _least_difference([[row[0] for row in GAINS[str(38 + theta)][0]] for theta in range(3)])
    return positive(
        min(ours, printed),
        method="Largest difference of the three entries for each pair of timings, the least of all pairs.",
        quantities={"printed gains": printed, "central optimal gains": ours},
        note="Several gains may have the optimal level, so this says that the designs differ, not that they must.",
    )


def _least_difference(columns: list[list[float]]) -> float:
    """The least over all pairs of columns of the largest difference of their entries."""
    return min(
        max(abs(a - b) for a, b in zip(first, second, strict=True)) for first, second in combinations(columns, 2)
    )

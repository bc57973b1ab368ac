"""Sec. IV-B: two sensors of the same period at three mutual timings, and the gains (38)-(40)."""

from __future__ import annotations

from itertools import pairwise

from papers.okajima2023.cases import TIMINGS
from papers.okajima2023.claims.levels import achieved, level, separation
from papers.okajima2023.printed import DATA
from replication.audit.declare import Part, positive
from replication.audit.model import Evidence, Results

TIMING = Part("Sec. IV-B, timing, gains (38)-(40), Figs. 6-8", figures=("fig6", "fig7", "fig8", "timing"))

for _theta, (_case, _printed) in enumerate(DATA["level-of-timing"].items()):
    level(
        TIMING,
        f"timing.case-{_case}",
        _printed,
        TIMINGS[_theta],
        f"The optimal level for N₁ = N₂ = 3 if the second sensor measures {_theta} instants after the first.",
    )
    achieved(TIMING, str(38 + _theta), _printed)


@TIMING.order("order.timing-matters", place="Sec. IV-B", uses=TIMINGS)
def timing_matters(results: Results) -> Evidence:
    """The optimal level depends on when the sensors measure, at equal periods."""
    levels = sorted((results[name] for name in TIMINGS), key=lambda result: result["optimum"])
    return positive(
        min(following["lower"] - before["upper"] for before, following in pairwise(levels)),
        method="Distance between brackets of exact optima.",
        quantities={"relative spread of the optimum": levels[-1]["optimum"] / levels[0]["optimum"] - 1},
    )


@TIMING.order("order.timing-best", place="Sec. IV-B; blog", uses=TIMINGS)
def second_timing_best(results: Results) -> Evidence:
    """Among the three timings, Case 2 has the smallest optimal level."""
    margin = min(separation(results, TIMINGS[1], TIMINGS[theta]) for theta in (0, 2))
    return positive(margin, method="Distance between brackets of exact optima.")


@TIMING.order("gains.depend-on-timing", place="Sec. IV-B", uses=TIMINGS)
def gains_depend_on_timing(results: Results) -> Evidence:
    """The gains change with the observation timing."""
    # The first sensor is measured at instant 0 in all three cases.
    columns = [[row[0] for row in results[name]["gains"][0]] for name in TIMINGS]
    differences = [
        max(abs(a - b) for a, b in zip(columns[i], columns[j], strict=True)) for i in range(3) for j in range(i + 1, 3)
    ]
    return positive(min(differences), method="Central optimal gains of the three timings, first column at instant 0.")

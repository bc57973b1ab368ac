"""Beyond Table 1: the optimum for every pair of periods up to a largest one, with and without the best timing."""

from __future__ import annotations

from papers.okajima2023.problem import Json, Matrix, build, optimum_json
from replication.estimation.multirate.timing import search_timing


def period_table(plant: dict[str, Matrix], largest: int) -> Json:
    """Smallest achievable gain for N_1, N_2 = 1 ... largest, all sensors at instant 0 and with the best offsets."""
    system = build(plant, [1, 1], [0, 0], [0, 1]).plant
    cells = []
    for first in range(1, largest + 1):
        for second in range(1, largest + 1):
            search = search_timing(system, (first, second))
            best = search.optima[search.best]
            cells.append(
                {
                    "periods": [first, second],
                    "synchronous": optimum_json(search.synchronous),
                    "best": optimum_json(best),
                    "best_offset": search.best[1],
                    "by_offset": [search.optima[offsets].value for offsets in sorted(search.optima)],
                }
            )
    return {"cells": cells}

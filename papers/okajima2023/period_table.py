"""Beyond Table 1: the optimum for every pair of periods up to a largest one, with and without the best timing."""

from __future__ import annotations

from papers.okajima2023.designs import PERIOD_TABLE
from papers.okajima2023.problem import Json, Matrix, build, optimum_json
from replication.audit.model import Results
from replication.estimation.multirate.timing import search_timing


def period_row(plant: dict[str, Matrix], first: int, largest: int) -> Json:
    """Smallest achievable gain for N_1 = first, N_2 = 1 ... largest, sensors at instant 0 and with the best offsets."""
    system = build(plant, [1, 1], [0, 0], [0, 1]).plant
    cells = []
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


def all_periods(results: Results) -> list[Json]:
    """The cells of all rows."""
    return [cell for name in PERIOD_TABLE for cell in results[name]["cells"]]

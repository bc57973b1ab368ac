"""Claims that compare: which observer, which timing and which periods are better, and the blog's reasons."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from papers.okajima2023 import data
from papers.okajima2023.designs import KEY, PERIOD_TABLE, case, pair
from papers.okajima2023.period_table import all_periods
from replication.audit.model import Claim, Evidence, Kind, Results, SolverRecord, Verdict


def separation(results: Results, smaller: str, larger: str) -> float:
    """How far the bracket of one optimum lies below that of another (positive if they are separated)."""
    return float(results[larger]["lower"] - results[smaller]["upper"])


def proposed_best(results: Results) -> Evidence:
    """The multi-rate observer against Cases A, B and C: smallest distance of the brackets."""
    margin = min(separation(results, case("proposed"), case(name)) for name in "ABC")
    return Evidence(method="Distance between brackets of exact optima.", holds=margin > 0, margin=margin)


def second_timing_best(results: Results) -> Evidence:
    """Case 2 of the timing against Cases 1 and 3."""
    margin = min(separation(results, pair((3, 3), 1), pair((3, 3), theta)) for theta in (0, 2))
    return Evidence(method="Distance between brackets of exact optima.", holds=margin > 0, margin=margin)


def timing_matters(results: Results) -> Evidence:
    """The three timings have three different optima, and their central gains differ."""
    levels = sorted((results[pair((3, 3), theta)] for theta in range(3)), key=lambda result: result["optimum"])
    margin = min(following["lower"] - before["upper"] for before, following in pairwise(levels))
    spread = levels[-1]["optimum"] / levels[0]["optimum"] - 1
    return Evidence(
        method="Distance between brackets of exact optima.",
        holds=margin > 0,
        margin=margin,
        quantities={"relative spread of the optimum": spread},
    )


def shorter_is_better_in_table(results: Results) -> Evidence:
    """All pairs of columns of Table 1 in which no period is longer and one is shorter."""
    columns = list(data.TABLE_1)
    steps = [
        separation(results, pair(a), pair(b))
        for a in columns
        for b in columns
        if a != b and a[0] <= b[0] and a[1] <= b[1]
    ]
    return Evidence(
        method="Distance between brackets of exact optima for every comparable pair of columns.",
        holds=min(steps) > 0,
        margin=min(steps),
        quantities={"pairs compared": len(steps)},
    )


def counterexamples(table: list[dict[str, Any]], timing: str) -> list[tuple[float, list[int], list[int]]]:
    """Neighbours in the table of periods where the longer period has the smaller optimum: (excess, shorter, longer)."""
    cells = {tuple(cell["periods"]): cell[timing] for cell in table}
    found = []
    for (first, second), cell in cells.items():
        for longer in ((first + 1, second), (first, second + 1)):
            if longer in cells and cells[longer]["upper"] < cell["lower"]:
                found.append((cell["lower"] - cells[longer]["upper"], [first, second], list(longer)))
    return sorted(found, reverse=True)


def shorter_is_better(results: Results) -> Evidence:
    """The general statement, against the table of all periods up to six with all sensors at instant 0."""
    found = counterexamples(all_periods(results), "synchronous")
    timed = counterexamples(all_periods(results), "best")
    if not found:
        return Evidence(method="Table of exact optima for periods up to six.", holds=True, note="No counter-example.")
    excess, shorter, longer = found[0]
    note = (
        f"Counter-example: periods {tuple(shorter)} have a larger optimum than the longer periods {tuple(longer)}. "
        "Sensors that measure more often but never together can be worse than synchronised slower ones."
    )
    if timed:
        note += f" With the best offsets for each, {tuple(timed[0][1])} is worse than {tuple(timed[0][2])} by "
        note += f"{timed[0][0]:.6f}."
    return Evidence(
        method="Brackets of exact optima for all periods up to six, sensors at instant 0.",
        holds=False,
        margin=-excess,
        quantities={"counter-examples, synchronous": len(found), "counter-examples, best timing": len(timed)},
        note=note,
    )


def periodic_matrices(results: Results) -> Evidence:
    """Level of Theorem 2 with one matrix P for all phases against the level with periodic P_k."""
    found = results[CONSTANT]
    return Evidence(
        method="Level with one P at every phase minus the level with P_k of their own, N₁ = 2 and N₂ = 1.",
        cross_check=f"The gains of the constant P have the exact norm {found['norm_constant']:.6f}.",
        holds=found["constant"] > found["periodic"],
        margin=found["constant"] - found["periodic"],
        solvers=tuple(SolverRecord(**record) for record in found["solvers"]),
        quantities={"level with one P": found["constant"], "level with periodic P": found["periodic"]},
    )


def idle_instants(results: Results) -> Evidence:
    """Longest run of instants without any measurement in Case 1 of the timing."""
    return Evidence(
        method="Counted on the schedule, cyclically.",
        value=float(longest_gap(results[f"{KEY}.schedule.case-1"]["diagonals"])),
    )


def longest_gap(diagonals: list[list[float]]) -> int:
    """Longest cyclic run of phases in which no sensor measures."""
    idle = "".join("0" if any(row) else "1" for row in diagonals)
    return max(len(run) for run in (idle * 2).split("0"))


def evenness(results: Results) -> Evidence:
    """The reason that the blog gives for Case 2, even spacing, holds for Case 3 too, whose optimum is larger."""
    gaps = {n: longest_gap(results[f"{KEY}.schedule.case-{n}"]["diagonals"]) for n in (1, 2, 3)}
    return Evidence(
        method="Longest cyclic run without measurement in each case, counted on the schedules.",
        holds=gaps[2] < gaps[1],
        margin=float(gaps[1] - gaps[2]),
        quantities={f"longest gap, Case {n}": float(gap) for n, gap in gaps.items()},
        note="Cyclically, Case 3 is as even as Case 2 and has the larger optimum: evenness alone does not rank them.",
    )


CONSTANT = f"{KEY}.constant-matrix"
ALL_TIMINGS = tuple(pair((3, 3), theta) for theta in range(3))
ALL_SCHEDULES = tuple(f"{KEY}.schedule.case-{n}" for n in (1, 2, 3))

CLAIMS: tuple[Claim, ...] = (
    Claim(
        id=f"{KEY}.order.proposed-best",
        place="Sec. IV-A, after Case C; blog",
        kind=Kind.ORDER,
        statement="The multi-rate observer has a smaller optimal level than each of the three dual-rate observers.",
        expected=Verdict.CONSISTENT,
        answer=proposed_best,
        uses=tuple(case(name) for name in ("proposed", "A", "B", "C")),
    ),
    Claim(
        id=f"{KEY}.order.timing-best",
        place="Sec. IV-B; blog",
        kind=Kind.ORDER,
        statement="Among the three timings, Case 2 has the smallest optimal level.",
        expected=Verdict.CONSISTENT,
        answer=second_timing_best,
        uses=ALL_TIMINGS,
    ),
    Claim(
        id=f"{KEY}.order.timing-matters",
        place="Sec. IV-B",
        kind=Kind.ORDER,
        statement="The optimal level depends on when the sensors measure, at equal periods.",
        expected=Verdict.CONSISTENT,
        answer=timing_matters,
        uses=ALL_TIMINGS,
    ),
    Claim(
        id=f"{KEY}.order.shorter-in-table",
        place="Sec. IV-A, on Table 1; blog",
        kind=Kind.ORDER,
        statement="Within Table 1, a shorter sensing period gives a smaller level.",
        expected=Verdict.CONSISTENT,
        answer=shorter_is_better_in_table,
        uses=tuple(pair(periods) for periods in data.TABLE_1),
    ),
    Claim(
        id=f"{KEY}.order.shorter-in-general",
        place="Blog, text on Table 1; Sec. IV-A",
        kind=Kind.ORDER,
        statement="Taken as a rule, as the blog does: a shorter sensing period gives a smaller level.",
        expected=Verdict.DIFFERS,
        answer=shorter_is_better,
        uses=PERIOD_TABLE,
    ),
    Claim(
        id=f"{KEY}.blog.periodic-matrices",
        place="Blog, on Theorem 1",
        kind=Kind.ORDER,
        statement="Periodic matrices P_k make the condition less conservative than one constant matrix.",
        expected=Verdict.CONSISTENT,
        answer=periodic_matrices,
        uses=(CONSTANT,),
    ),
    Claim(
        id=f"{KEY}.blog.idle-instants",
        place="Blog, text after the timing table",
        kind=Kind.VALUE,
        statement="In Case 1 this many consecutive instants pass without any measurement.",
        expected=Verdict.REPRODUCED,
        answer=idle_instants,
        uses=(f"{KEY}.schedule.case-1",),
        printed="2",
    ),
    Claim(
        id=f"{KEY}.blog.evenness",
        place="Blog, text after the timing table",
        kind=Kind.ORDER,
        statement="In Case 2 the measurements are spread more evenly over time than in Case 1.",
        expected=Verdict.CONSISTENT,
        answer=evenness,
        uses=ALL_SCHEDULES,
    ),
)

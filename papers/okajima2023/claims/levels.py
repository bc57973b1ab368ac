"""Claims about optimal levels: Table 1, Cases A-C, the timing cases, the orderings, and what the blog repeats."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

from papers.okajima2023 import data
from papers.okajima2023.designs import KEY, case, pair
from replication.audit.model import Claim, Evidence, Kind, Results, SolverRecord, Verdict

PERIOD_TABLE = f"{KEY}.period-table"

METHOD = (
    "Smallest level with a stabilising periodic Riccati solution (necessary and sufficient), by doubling; "
    "from below the non-causal bound that no estimator, smoothers included, can beat."
)


def level_evidence(result: dict[str, Any]) -> Evidence:
    """The exact optimum with its bracket, beside the levels of both matrix inequalities and their gains' norms."""
    best = result["optimum"]
    limit = "on the non-causal bound" if result["limited_by"] == "noncausal" else "above the non-causal bound"
    return Evidence(
        method=METHOD,
        cross_check=(
            f"Matrix inequality (30) as printed gives {result['lmi']['level']:.10f}, its reduced form "
            f"{result['reduced_lmi']['level']:.10f}; their gains have exact norms {result['lmi']['norm']:.10f} and "
            f"{result['reduced_lmi']['norm']:.10f}."
        ),
        value=best,
        lower=result["lower"],
        upper=result["upper"],
        solvers=tuple(SolverRecord(**record) for record in result["solvers"]),
        quantities={
            "non-causal bound": result["noncausal"]["value"],
            "relative distance of the printed inequality": result["lmi"]["level"] / best - 1,
            "relative distance of the reduced inequality": result["reduced_lmi"]["level"] / best - 1,
            "norm of the central Riccati gains": result["norm_central"]["value"],
            "white-noise performance of these gains": result["h2_central"],
            "white-noise performance of the Kalman filter": result["h2_kalman"],
            "gain of the Kalman filter": result["norm_kalman"],
        },
        note=f"The optimum lies {limit}.",
    )


def level(experiment: str) -> Callable[[Results], Evidence]:
    """An answer: the optimal level of one design."""

    def optimal_level(results: Results) -> Evidence:
        return level_evidence(results[experiment])

    return optimal_level


def _level_claim(name: str, place: str, statement: str, printed: str, experiment: str, expected: Verdict) -> Claim:
    return Claim(
        id=f"{KEY}.{name}",
        place=place,
        kind=Kind.VALUE,
        statement=statement,
        expected=expected,
        answer=level(experiment),
        uses=(experiment,),
        printed=printed,
    )


def _verdict(periods: tuple[int, int]) -> Verdict:
    return Verdict.DIFFERS if periods == (2, 1) else Verdict.REPRODUCED


def table_claim_id(periods: tuple[int, int]) -> str:
    """Id of the claim for one column of Table 1."""
    return f"{KEY}.table1.n{periods[0]}{periods[1]}"


def _table() -> list[Claim]:
    return [
        _level_claim(
            table_claim_id(periods).removeprefix(f"{KEY}."),
            f"Table 1, column ({periods[0]},{periods[1]})",
            f"The optimal level for periods N₁ = {periods[0]} and N₂ = {periods[1]}, both sensors at instant 0.",
            printed,
            pair(periods),
            _verdict(periods),
        )
        for periods, printed in data.TABLE_1.items()
    ]


def _cases() -> list[Claim]:
    what = {
        "A": ("Sec. IV-A, Case A", "y₁ alone is used, every second instant"),
        "B": ("Sec. IV-A, Case B", "y₂ alone is used, every third instant"),
        "C": ("Sec. IV-A, Case C", "both sensors are read only at their common period 6"),
    }
    proposed = _level_claim(
        "gamma.proposed",
        "Sec. IV-A, before eq. (33)",
        "The optimal level of the proposed multi-rate observer, N₁ = 2 and N₂ = 3.",
        data.GAMMA_PROPOSED,
        case("proposed"),
        Verdict.REPRODUCED,
    )
    return [
        proposed,
        *(
            _level_claim(
                f"gamma.case-{name.lower()}",
                place,
                f"The optimal level if {how}.",
                data.GAMMA_CASES[name],
                case(name),
                Verdict.REPRODUCED,
            )
            for name, (place, how) in what.items()
        ),
    ]


def _timing() -> list[Claim]:
    return [
        _level_claim(
            f"timing.case-{theta + 1}",
            f"Sec. IV-B, Case {theta + 1}",
            f"The optimal level for N₁ = N₂ = 3 if the second sensor measures {theta} instants after the first.",
            printed,
            pair((3, 3), theta),
            Verdict.REPRODUCED,
        )
        for theta, printed in data.GAMMA_TIMING.items()
    ]


def _blog() -> list[Claim]:
    rows = [
        (
            "proposed",
            "Blog, methods table, row Proposed",
            "the proposed observer",
            data.GAMMA_PROPOSED,
            case("proposed"),
        ),
        *(
            (f"case-{name.lower()}", f"Blog, methods table, row Case {name}", f"Case {name}", printed, case(name))
            for name, printed in data.GAMMA_CASES.items()
        ),
        ("n11", "Blog, text on Table 1", "N₁ = N₂ = 1", data.TABLE_1[1, 1], pair((1, 1))),
        ("n33", "Blog, text on Table 1", "N₁ = N₂ = 3", data.TABLE_1[3, 3], pair((3, 3))),
        *(
            (
                f"timing-{theta + 1}",
                f"Blog, timing table, Case {theta + 1}",
                f"Case {theta + 1} of the timing",
                printed,
                pair((3, 3), theta),
            )
            for theta, printed in data.GAMMA_TIMING.items()
        ),
    ]
    return [
        _level_claim(f"blog.{name}", place, f"The blog's level for {what}.", printed, experiment, Verdict.REPRODUCED)
        for name, place, what, printed, experiment in rows
    ]


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


def counterexamples(table: dict[str, Any], timing: str) -> list[tuple[float, list[int], list[int]]]:
    """Neighbours in the table of periods where the longer period has the smaller optimum: (excess, shorter, longer)."""
    cells = {tuple(cell["periods"]): cell[timing] for cell in table["cells"]}
    found = []
    for (first, second), cell in cells.items():
        for longer in ((first + 1, second), (first, second + 1)):
            if longer in cells and cells[longer]["upper"] < cell["lower"]:
                found.append((cell["lower"] - cells[longer]["upper"], [first, second], list(longer)))
    return sorted(found, reverse=True)


def shorter_is_better(results: Results) -> Evidence:
    """The general statement, against the table of all periods up to six with all sensors at instant 0."""
    found = counterexamples(results[PERIOD_TABLE], "synchronous")
    timed = counterexamples(results[PERIOD_TABLE], "best")
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


ALL_TIMINGS = tuple(pair((3, 3), theta) for theta in range(3))
ALL_SCHEDULES = tuple(f"{KEY}.schedule.case-{n}" for n in (1, 2, 3))

CLAIMS: tuple[Claim, ...] = (
    *_cases(),
    *_table(),
    *_timing(),
    *_blog(),
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
        place="Sec. IV-A, on Table 1; blog",
        kind=Kind.ORDER,
        statement="Read as a rule beyond Table 1: a shorter sensing period always gives a smaller level.",
        expected=Verdict.DIFFERS,
        answer=shorter_is_better,
        uses=(PERIOD_TABLE,),
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

"""Claims about optimal levels: Table 1, Cases A-C, the timing cases, the orderings, and what the blog repeats."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from papers.okajima2023 import data
from papers.okajima2023.designs import KEY, case, pair
from replication.audit.model import Claim, Evidence, Kind, Results, SolverRecord, Verdict

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


CLAIMS: tuple[Claim, ...] = (*_cases(), *_table(), *_timing(), *_blog())

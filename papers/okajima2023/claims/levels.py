"""Sec. IV-A: the optimal levels of the example and of Table 1, the gains (33), the size of the inequality."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from papers.okajima2023.cases import (
    CASES,
    GAIN_SETS,
    PERIOD_TABLE,
    all_periods,
    both,
    case,
    gain_set,
    pair,
    table_claim,
)
from papers.okajima2023.printed import DATA, GAINS, TABLE_1
from replication.audit.declare import Part, positive
from replication.audit.model import Evidence, Results, SolverRecord

LEVELS = Part("Sec. IV-A, levels, gains (33), size of the inequality")
TABLE = Part("Table 1", figures="periods")

READ_AS = {
    "A": "y₁ alone is used, every second instant",
    "B": "y₂ alone is used, every third instant",
    "C": "both sensors are read only at their common period 6",
}


def solvers_of(result: Mapping[str, Any]) -> tuple[SolverRecord, ...]:
    """The accounts of the solvers behind a result."""
    return tuple(SolverRecord(**record) for record in result["solvers"])


def optimal_level(experiment: str, results: Results) -> Evidence:
    """The exact optimum with its bracket, beside the levels of both matrix inequalities and their gains' norms."""
    result = results[experiment]
    best = result["optimum"]
    limit = "on the non-causal bound" if result["limited_by"] == "noncausal" else "above the non-causal bound"
    return Evidence(
        method=(
            "Smallest level with a stabilising periodic Riccati solution (necessary and sufficient), by doubling; "
            "from below the non-causal bound that no estimator, smoothers included, can beat."
        ),
        cross_check=(
            f"Matrix inequality (30) as printed gives {result['lmi']['level']:.10f}, its reduced form "
            f"{result['reduced_lmi']['level']:.10f}; their gains have exact norms {result['lmi']['norm']:.10f} and "
            f"{result['reduced_lmi']['norm']:.10f}."
        ),
        value=best,
        lower=result["lower"],
        upper=result["upper"],
        solvers=solvers_of(result),
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


def norm_of_printed_gains(equation: str, results: Results) -> Evidence:
    """The exact norm of the gains printed in an equation."""
    result = results[gain_set(equation)]
    norm, best = result["norm"], result["optimum"]
    return Evidence(
        method="Exact l2-induced norm of the error system (16) with the printed gains.",
        cross_check=f"Theorem 1 certifies {result['theorem1']:.10f} for the same gains.",
        value=norm["value"],
        lower=norm["lower"],
        upper=norm["upper"],
        solvers=solvers_of(result),
        quantities={
            "optimum": best,
            "excess over the optimum": norm["value"] - best,
            "effect of rounding the gains": result["rounding_spread"],
            "spectral radius over one period": result["spectral_radius"],
        },
        note=(
            "The optimal gains are not unique, so their entries are not compared: the printed gains are judged by "
            "what they achieve."
        ),
    )


def level(part: Part, name: str, printed: str, experiment: str, statement: str, pinned: str = "") -> None:
    """Declare the claim on the optimal level of one design."""
    answer = partial(optimal_level, experiment)
    part.value(name, printed, statement=statement, uses=experiment, pinned=pinned)(answer)


def achieved(part: Part, equation: str, printed: str) -> None:
    """Declare the claim on the level that the gains printed in an equation achieve."""
    part.value(
        f"gains.eq{equation}",
        printed,
        place=f"Eq. ({equation})",
        statement=f"The gains printed in eq. ({equation}) achieve the level printed beside them.",
        uses=gain_set(equation),
    )(partial(norm_of_printed_gains, equation))


def separation(results: Results, smaller: str, larger: str) -> float:
    """How far the bracket of one optimum lies below that of another (positive if they are separated)."""
    return float(results[larger]["lower"] - results[smaller]["upper"])


@LEVELS.value("size.variables", DATA["decision-variables"], uses=case("proposed"))
def decision_variables(results: Results) -> Evidence:
    """Number of decision variables of the matrix inequalities for N₁ = 2 and N₂ = 3."""
    result = results[case("proposed")]
    return Evidence(
        method="Counted: six symmetric P_k of order 3, six Y_k of 3 by 2, and the level.",
        value=float(result["size"]["variables"]),
        quantities={"of which act on the observer": result["acting_variables"]},
    )


@LEVELS.value("size.rows", DATA["rows"], uses=case("proposed"))
def block_size(results: Results) -> Evidence:
    """Rows (and columns) of the matrix inequality of each phase."""
    return Evidence(
        method="Rows of eq. (30): twice the states, the disturbance and the sensor noise.",
        value=float(results[case("proposed")]["size"]["rows"]),
    )


level(
    LEVELS,
    "gamma.proposed",
    DATA["level"],
    case("proposed"),
    "The optimal level of the proposed multi-rate observer, N₁ = 2 and N₂ = 3.",
)
achieved(LEVELS, "33", DATA["level"])


@LEVELS.feasible("gains.unmeasured", place="Eqs. (33), (38), (39), (40), (42)")
def unmeasured_columns(results: Results) -> Evidence:
    """The printed gains are zero wherever a sensor is not measured."""
    largest = max(
        abs(entry)
        for equation, observer in {**GAIN_SETS, "42": both((2, 3))}.items()
        for k, gain in enumerate(GAINS[equation])
        for row in gain
        for entry, period, offset in zip(row, observer["periods"], observer["offsets"], strict=True)
        if (k - offset) % period
    )
    return Evidence(
        method="Printed zeros compared with the sensing schedules.",
        holds=largest == 0.0,
        quantities={"largest entry on a sensor that is not measured": largest},
        note="Theorem 2 leaves these columns free; zero is a convention, and without effect in the observer.",
    )


for _case, _read in READ_AS.items():
    level(
        LEVELS,
        f"gamma.case-{_case.lower()}",
        DATA["level-of-case"][_case],
        case(_case),
        f"The optimal level if {_read}.",
    )


@LEVELS.order("order.proposed-best", place="Sec. IV-A, after Case C; blog", uses=map(case, CASES))
def proposed_best(results: Results) -> Evidence:
    """The multi-rate observer has a smaller optimal level than each of the three dual-rate observers."""
    margin = min(separation(results, case("proposed"), case(name)) for name in "ABC")
    return positive(margin, method="Distance between brackets of exact optima.")


for _periods, _printed in TABLE_1.items():
    level(
        TABLE,
        table_claim(_periods),
        _printed,
        pair(_periods),
        f"The optimal level for periods N₁ = {_periods[0]} and N₂ = {_periods[1]}, both sensors at instant 0.",
        pinned="differs" if _periods == (2, 1) else "",
    )


@TABLE.order("order.shorter-in-table", place="Sec. IV-A, on Table 1; blog", uses=map(pair, TABLE_1))
def shorter_is_better_in_table(results: Results) -> Evidence:
    """Within Table 1, a shorter sensing period gives a smaller level."""
    steps = [
        separation(results, pair(a), pair(b))
        for a in TABLE_1
        for b in TABLE_1
        if a != b and a[0] <= b[0] and a[1] <= b[1]
    ]
    return positive(
        min(steps),
        method="Distance between brackets of exact optima for every comparable pair of columns.",
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


@TABLE.order("order.shorter-in-general", place="Blog, text on Table 1; Sec. IV-A", uses=PERIOD_TABLE, pinned="differs")
def shorter_is_better(results: Results) -> Evidence:
    """Taken as a rule, as the blog does: a shorter sensing period gives a smaller level."""
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

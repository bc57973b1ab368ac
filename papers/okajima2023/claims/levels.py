"""Secs. IV-A and IV-B: optimal levels of the example, of Table 1 and of three timings; the printed gains."""

from functools import partial
from itertools import combinations, pairwise
from typing import Any

from papers._common import solvers
from papers.okajima2023.experiments.declared import (
    CASES,
    DESIGNS,
    GAIN_SETS,
    TIMINGS,
    both,
    case,
    gain_set,
    pair,
    table_claim,
    times,
)
from papers.okajima2023.printed import DATA, GAINS, TABLE_1
from replication.audit.declare import Part, positive
from replication.audit.model import NO_READING, Evidence, Results
from replication.verify.predicate import Predicate, Term, term

LEVELS = Part("Sec. IV-A, levels, gains (33), size of the inequality", reading=NO_READING)
TABLE = Part("Table 1", reading=NO_READING, figures="periods")

PREDICTORS = "observers of form (15)"
OBSERVERS = "periodic one-step observers"
"""The class of the observers (15)."""
ZEROS = "unmeasured columns are zero"
READ_AS = {
    "A": "uses y₁ alone, every second instant",
    "B": "uses y₂ alone, every third instant",
    "C": "reads both sensors at their common period 6 only",
}


def optimal_level(experiment: str, results: Results) -> Evidence:
    """The exact optimum with its bracket, beside the levels of both matrix inequalities and their gains' norms."""
    result = results[experiment]
    best = result["optimum"]
    limit = (
        "The optimum lies on the non-causal bound, so no estimator has a smaller level, not even a smoother."
        if result["limited_by"] == "noncausal"
        else "The optimum lies above the non-causal bound: it is that of observers (15), which estimate the state at "
        f"k + 1 from measurements up to k. Filters, which use the newest measurement too, reach {result['filter']:.4f}."
    )
    return Evidence(
        method="Smallest level with a stabilising periodic Riccati solution, by doubling; necessary and sufficient for "
        "observers of the form (15).",
        cross_check=f"Matrix inequality (30) as printed gives {result['lmi']['level']:.10f}, its reduced form "
        f"{result['reduced_lmi']['level']:.10f}; their gains have exact norms {result['lmi']['norm']:.10f} and "
        f"{result['reduced_lmi']['norm']:.10f}.",
        value=best,
        lower=result["lower"],
        upper=result["upper"],
        solvers=solvers(result),
        quantities={
            "non-causal bound": result["noncausal"],
            "smallest level of filters": result["filter"],
            "relative distance of the printed inequality": result["lmi"]["level"] / best - 1,
            "relative distance of the reduced inequality": result["reduced_lmi"]["level"] / best - 1,
            "norm of the central Riccati gains": result["norm_central"],
            "white-noise performance of these gains": result["h2_central"],
            "white-noise performance of the Kalman filter": result["h2_kalman"],
            "gain of the Kalman filter": result["norm_kalman"],
        },
        note=limit,
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
        solvers=solvers(result),
        quantities={
            "optimum": best,
            "excess over the optimum": norm["value"] - best,
            "effect of rounding the gains": result["rounding_spread"],
            "spectral radius over one period": result["spectral_radius"],
        },
        note="Several gains may have the same level, so entries are not compared: the printed gains are judged by what "
        "they achieve.",
    )


def optimum(experiment: str) -> Term:
    """The smallest gain of the observers that a design is one of."""
    return term("smallest gain", "stable", OBSERVERS, **DESIGNS[experiment])


def of_gains(quantity: str, equation: str) -> Term:
    """A number of the error system with the gains printed in an equation."""
    return term(quantity, f"gains-{equation}", **GAIN_SETS[equation])


def below_others(smaller: str, *larger: str) -> list[Predicate]:
    """That the optimum of one design is smaller than that of each other one."""
    return [Predicate(of=optimum(smaller), relation="less than", to=optimum(name)) for name in larger]


def level(part: Part, name: str, printed: str, experiment: str, statement: str, **fields: Any) -> None:
    """Declare the claim on the optimal level of one design; fields: reading and pinned, where they are needed."""
    declared = part.value(name, printed, statement=statement, says=optimum(experiment), optimum=True, **fields)
    declared(partial(optimal_level, experiment))


def achieved(part: Part, equation: str, printed: str) -> None:
    """Declare the claim on the level that the gains printed in an equation achieve."""
    part.value(
        f"gains.eq{equation}",
        printed,
        place=f"Eq. ({equation})",
        statement=f"The l2 gain with the gains printed in eq. ({equation}) is the level printed for them.",
        says=of_gains("gain", equation),
    )(partial(norm_of_printed_gains, equation))


def separation(results: Results, smaller: str, larger: str) -> float:
    """How far the bracket of one optimum lies below that of another (positive if they are separated)."""
    return float(results[larger]["lower"] - results[smaller]["upper"])


@LEVELS.value(
    "size.variables",
    DATA["decision-variables"],
    says=term("unknowns of Theorem 2", "stable", **times(CASES["proposed"])),
)
def decision_variables(results: Results) -> Evidence:
    """Number of decision variables of the inequalities (30) for N₁ = 2 and N₂ = 3."""
    result = results[case("proposed")]
    return Evidence(
        method="Counted: the P_k, symmetric, the Y_k with all their columns, and the level.",
        value=float(result["size"]["variables"]),
        quantities={"of which act on the observer": result["acting_variables"]},
    )


@LEVELS.value("size.rows", DATA["rows"], says=term("rows of Theorem 2", "stable"))
def block_size(results: Results) -> Evidence:
    """Rows, and columns, of the inequality (30) of each instant for the plant of the example."""
    return Evidence(
        method="Rows of eq. (30): twice the states, the disturbance and the sensor noise.",
        value=float(results[case("proposed")]["size"]["rows"]),
    )


level(
    LEVELS,
    "gamma.proposed",
    DATA["level"],
    case("proposed"),
    "The smallest level of the multi-rate observer (15) for N₁ = 2 and N₂ = 3.",
)
achieved(LEVELS, "33", DATA["level"])


@LEVELS.feasible(
    "gains.unmeasured",
    place="Eqs. (33), (38), (39), (40), (42)",
    says=[
        *(term(ZEROS, f"gains-{equation}", **times(inputs)) for equation, inputs in GAIN_SETS.items()),
        term(ZEROS, "section-4c", **times(both((2, 3)))),
    ],
)
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
        note="Theorem 2 leaves these columns free; they have no effect in the observer.",
    )


for _case, _read in READ_AS.items():
    level(
        LEVELS,
        f"gamma.case-{_case.lower()}",
        DATA["level-of-case"][_case],
        case(_case),
        f"The smallest level of a dual-rate observer that {_read}.",
        reading=PREDICTORS,
    )


@LEVELS.order(
    "order.proposed-best",
    place="Sec. IV-A, after Case C; blog",
    reading=PREDICTORS,
    says=below_others(*map(case, CASES)),
)
def proposed_best(results: Results) -> Evidence:
    """The multi-rate observer for N₁ = 2 and N₂ = 3 has a smaller optimal level than each of Cases A to C."""
    margin = min(separation(results, case("proposed"), case(name)) for name in "ABC")
    return positive(margin, method="Distance between brackets of exact optima.")


for _periods, _printed in TABLE_1.items():
    level(
        TABLE,
        table_claim(_periods),
        _printed,
        pair(_periods),
        f"The smallest level for N₁ = {_periods[0]} and N₂ = {_periods[1]}, both sensors at instant 0.",
        pinned="compatible" if _periods == (2, 1) else "",
    )


COMPARABLE = [(a, b) for a in TABLE_1 for b in TABLE_1 if a != b and a[0] <= b[0] and a[1] <= b[1]]
"""Pairs of columns of Table 1, the one with the shorter periods first."""


@TABLE.order(
    "order.shorter-in-table",
    place="Sec. IV-A, on Table 1; blog",
    says=[predicate for a, b in COMPARABLE for predicate in below_others(pair(a), pair(b))],
)
def shorter_is_better_in_table(results: Results) -> Evidence:
    """In Table 1 shortening a period, or both, always lowers the optimal level."""
    return positive(
        min(separation(results, pair(a), pair(b)) for a, b in COMPARABLE),
        method="Distance between brackets of exact optima for every comparable pair of columns.",
        quantities={"pairs compared": len(COMPARABLE)},
        note="The blog says it of the combinations that the paper shows. As a rule for all periods it is false (claim "
        "order.beyond-table).",
    )


def counterexamples(table: list[dict[str, Any]], timing: str) -> list[tuple[float, list[int], list[int]]]:
    """Neighbours in the table of periods where the longer period has the smaller optimum: (excess, shorter, longer)."""
    cells = {tuple(cell["periods"]): cell[timing] for cell in table}
    cases = []
    for (first, second), cell in cells.items():
        for longer in ((first + 1, second), (first, second + 1)):
            if longer in cells and cells[longer]["upper"] < cell["lower"]:
                cases.append((cell["lower"] - cells[longer]["upper"], [first, second], list(longer)))
    return sorted(cases, reverse=True)


# Sec. IV-B: two sensors of the same period at three mutual timings, and the gains (38)-(40)


TIMING = Part("Sec. IV-B, timing, gains (38)-(40)", reading=NO_READING, figures="timing")

for _theta, (_case_of_timing, _printed_of_timing) in enumerate(DATA["level-of-timing"].items()):
    level(
        TIMING,
        f"timing.case-{_case_of_timing}",
        _printed_of_timing,
        TIMINGS[_theta],
        f"The smallest level for N₁ = N₂ = 3 and θ₁ = 0, θ₂ = {_theta}.",
    )
    achieved(TIMING, str(38 + _theta), _printed_of_timing)


@TIMING.order(
    "order.timing-matters",
    place="Sec. IV-B",
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


@TIMING.order("order.timing-best", place="Sec. IV-B; blog", says=below_others(TIMINGS[1], TIMINGS[0], TIMINGS[2]))
def second_timing_best(results: Results) -> Evidence:
    """Of the three timings for N₁ = N₂ = 3, Case 2 has the smallest optimal level."""
    margin = min(separation(results, TIMINGS[1], TIMINGS[theta]) for theta in (0, 2))
    return positive(margin, method="Distance between brackets of exact optima.")


@TIMING.order("gains.depend-on-timing", place="Sec. IV-B")
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

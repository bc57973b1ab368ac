"""Abstract, Secs. I, III and VII: whether a level, and a solution of (6), are those of all sampling periods."""

import math
from functools import partial

from papers._common import solvers
from papers.mustafa.claims.algorithm import ALGORITHM_1, CORRECTED_GRID
from papers.mustafa.claims.preliminaries import FILTER, SLIP, WITH_SIZE, WITH_U3, down, no_grid, stable_room, up
from papers.mustafa.printed import EXAMPLES, GAMMA, upper_end
from replication.audit.declare import Part, positive
from replication.audit.model import NO_READING, Evidence, Outcome, Results
from replication.verify.predicate import Predicate, term

NOT_NOMINAL, SOME_LEVEL = "every sequence, against Theorem 3 and Sec. V-A", "a level, whichever"
GRID_PERIODS = "periods of the grid"
ABSTRACT = Part("Abstract, Secs. I and VII: what the filter guarantees", reading=NO_READING)


RANGE, MIDDLE = {"from": "h_l", "to": "h_u"}, {"from": "middle", "to": "middle"}
FILTERED = {1: "our-filter", 2: "printed-filter"}
"""The plant of an example with the filter that the bracket is of."""
STABLE_WITH = {e: term("stable for every sequence", FILTERED[e], "the given filter", **RANGE) for e in EXAMPLES}
"""That the error system of an example is stable for every sequence, with that filter."""
STABLE = {1: term("stability of Theorems 1 to 3"), 2: STABLE_WITH[2]}
"""That the error system of an example is stable for every sequence; in Example 1 with every filter that meets (6)."""


ANY_NUMBER = "3"
"""To have a level is to have a gain below some number: one above the gains of both examples stands for it."""


def printed_level(e: int) -> list[Predicate]:
    """That the level is kept, to its digits, by the filter that the bracket is of, and by some filter."""
    return [
        Predicate(of=gain, relation="at most", to=str(upper_end(GAMMA[e])), reading=reading)
        for reading, over in ((NOT_NOMINAL, RANGE), (GRID_PERIODS, MIDDLE))
        for gain in (
            term("gain over sequences", FILTERED[e], "the given filter", **over),
            term("least gain over sequences", f"example-{e}", "filters of form (4)", **over),
        )
    ]


def robust_level(e: int) -> list[Predicate]:
    """The same, and that the filter has any level."""
    gain = term("gain over sequences", FILTERED[e], "the given filter", **RANGE)
    some = Predicate(of=gain, relation="at most", to=ANY_NUMBER, reading=SOME_LEVEL)
    return [*printed_level(e), some]


def where_it_holds(e: int, results: Results) -> str:
    """The constant sampling periods at which the printed level holds to its digits, as a sentence."""
    c = results[f"curve.{e}"]
    return (
        f"For {FILTER[e]} the level holds, to its printed digits, at constant sampling periods from "
        f"{up(c['holds_from'], 5)} to {down(c['holds_to'], 5)} s around the middle {c['middle']:.5f} s of the range."
    )


LOOSEST = "the central filter at the largest level that rounds to the print"
UNDECIDED = "The bracket does not decide: its ends lie on both sides of the level."


def level_outcome(reading: str, level: float, lower: float, upper: float) -> Outcome:
    """Whether a gain between `lower` and `upper` keeps a level, and by how much at least; undecided between them."""
    if upper <= level or lower > level:
        end = upper if upper <= level else lower
        return Outcome(reading=reading, holds=end <= level, margin=level - end)
    return Outcome(reading=reading)


def some_level(e: int, results: Results) -> Outcome:
    """Whether the gain over every sequence is finite: proved by an upper end, impossible without stability."""
    stable = stable_room(e, results) > 0
    bounded = math.isfinite(results[f"bracket.{e}"]["upper"])
    return Outcome(reading=SOME_LEVEL, holds=stable if not stable or bounded else None)


def guaranteed(e: int, results: Results) -> Evidence:
    """Whether the printed level holds for every sequence in the range, and whether for the grid."""
    r, d, printed = results[f"bracket.{e}"], results[f"bracket-duration.{e}"], upper_end(GAMMA[e])
    curve = results[f"curve.{e}"]
    none = (
        f" No stable filter of form (4) has the level for every sequence: at the constant period "
        f"{curve['floor_at']:.5f} s each has a gain of at least {down(curve['floor'])}."
        if curve["floor"] > printed
        else ""
    )
    loosest = {f"{LOOSEST}, lower": results["loosest.1"]["lower"]} if e == 1 else {}
    every = level_outcome(NOT_NOMINAL, printed, r["lower"], r["upper"])
    outcomes = (some_level(e, results), level_outcome(GRID_PERIODS, printed, r["nominal"], r["nominal"]), every)
    return Evidence(
        method="Worst-case l2 gain over all sampling sequences. Lower end: the ratio along one sequence. Upper end: a "
        "path-dependent Lyapunov function for the continuum of periods. For the grid: the exact norm at its period.",
        cross_check="The lower end is a simulated ratio; the upper one is checked without the solver.",
        lower=r["lower"],
        upper=r["upper"],
        value=r["lower"],
        holds=outcomes[0].holds,
        not_checkable=UNDECIDED if None in [outcome.holds for outcome in outcomes] else "",
        outcomes=outcomes,
        quantities={
            "no filter of form (4) has less over every sequence than": curve["floor"],
            "no filter of form (4) has less: shown at the constant period (s)": curve["floor_at"],
            "upper over lower": r["upper"] / r["lower"],
            "lower over printed": r["lower"] / float(GAMMA[e]),
            "one Lyapunov function": r["common"],
            "leaves of the context tree": float(r["leaves"]),
            "duration-weighted, lower": d["lower"],
            "duration-weighted, upper": d["upper"],
            **loosest,
        },
        solvers=solvers(r),
        note="Abstract and Sec. VII say: with a level; the upper end is one. That the printed level is meant is ruled "
        "out: Theorem 3 gives it for the periods of the grid, Sec. V-A says that Algorithm 1 guarantees it for these "
        f"only, and Sec. VI-B calls that of Example 2 nominal. The bracket is that of {FILTER[e]}; its norms count "
        f"samples, not seconds.{none} {where_it_holds(e, results)}"
        + "".join(
            f" That our filter is next to the optimum matters little: {LOOSEST} has a gain of at least {down(low)}."
            for low in loosest.values()
        ),
    )


for e, place, said_of in (
    (1, "Abstract; Sec. VI-A; Sec. VII", "Theorem 3 and Sec. V-A say that it is for the grid"),
    (2, "Abstract; Sec. VII", "Sec. VI-B says that it is nominal"),
):
    ABSTRACT.feasible(
        f"robust-level.{e}",
        place=place,
        statement=f"Example {e} has a performance level for every sequence of sampling periods; of the printed one "
        f"{said_of}.",
        erratum=SLIP[e],
        says=robust_level(e),
        reading=SOME_LEVEL,
    )(partial(guaranteed, e))


@ALGORITHM_1.feasible(
    "step-3",
    place="Algorithm 1, step 3",
    reading=GRID_PERIODS,
    says=[predicate for e in EXAMPLES for predicate in printed_level(e)],
)
def level_of_step_3(results: Results) -> Evidence:
    """The filter of Algorithm 1 has its level, as step 3 says: for the periods of the grid, as Theorem 3 and Sec. V-A
    have it."""
    levels = [(results[f"bracket.{e}"], upper_end(GAMMA[e])) for e in EXAMPLES]
    grid = min(printed - r["nominal"] for r, printed in levels)
    every = min(printed - (r["upper"] if r["upper"] <= printed else r["lower"]) for r, printed in levels)
    open_ = any(r["lower"] <= printed < r["upper"] for r, printed in levels)
    return Evidence(
        method="In both examples, of the printed level with its rounding: the gain at the one period of the grid, and "
        "the bracket of the gain over all sequences of periods. Least room.",
        holds=grid >= 0,
        margin=grid,
        not_checkable=UNDECIDED if open_ else "",
        outcomes=(
            Outcome(reading=GRID_PERIODS, holds=grid >= 0, margin=grid),
            Outcome(reading=NOT_NOMINAL, holds=every >= 0, margin=every),
        ),
        note="Step 3 speaks of the error system (5), which runs over every sequence. Theorem 3, which the algorithm "
        f"follows, and Sec. V-A, by its name, keep the level to the grid. The filter of Example 1 is {FILTER[1]}.",
    )


def solution_is_valid(e: int, results: Results) -> Evidence:
    """Whether the filter that a grid of one period gives is valid at every period, in the sense that the text keeps."""
    curve = results[f"curve.{e}"]
    return positive(
        stable_room(e, results),
        method="Exact test of stability for every sequence, as A is Hurwitz and A_f Schur.",
        quantities={
            "no filter has less at a constant period than": curve["floor"],
            "no filter has less: shown at the period (s)": curve["floor_at"],
            f"largest gain of {FILTER[e]} at constant periods": max(curve["filter"]),
        },
        note="Sec. I can be read as more: that (6) itself holds at all periods, as Sec. III says of the grid of [7]. "
        "Here it does not: every filter of form (4) exceeds the level at one constant period. Sec. V-A rules it out. "
        f"{TAKEN_BACK} "
        f"{where_it_holds(e, results)}",
    )


def own_solution_is_valid(e: int, results: Results) -> Evidence:
    """Whether the level on the grid of the corrected algorithm is exceeded: (6) at every period would keep it."""
    solution = results[f"own-grid.{e}"]
    outcome = level_outcome(CORRECTED_GRID, solution["level"], solution["lower"], solution["upper"])
    return Evidence(
        method="The level of step 2 on the grid of the corrected algorithm, against the gain that its filter has "
        "along a sampling sequence; if (6) held at all periods, the level would be that of every sequence.",
        cross_check="A ratio that is simulated without the solver; the level by a second modeller before the same "
        "solver, relative difference "
        f"{abs(solution['level_again'] / solution['level'] - 1):.1e}.",
        holds=None if outcome.holds is None else not outcome.holds,
        margin=None if outcome.margin is None else -outcome.margin,
        not_checkable=UNDECIDED if outcome.holds is None else "",
        quantities={
            "elements": float(len(solution["periods"])),
            "level of step 2": solution["level"],
            "largest gain at an element": solution["at_elements"],
            "largest gain at a constant period": solution["largest"],
            "largest gain at a constant period: at the period (s)": solution["largest_at"],
            "gain over all sequences, lower": solution["lower"],
            "gain over all sequences, upper": solution["upper"],
        },
        solvers=solvers(solution),
        as_printed=no_grid(e, results),
        note=f"{TAKEN_BACK} Step 2 has one matrix for all elements, so its level holds for every sequence of them. "
        f"{WITH_U3} Step 2 minimises subject to (10) without its repeated row (erratum row). {WITH_SIZE}",
    )


TAKEN_BACK = (
    "Stability is not in doubt: the error system is stable for every sequence. Of the level of Algorithm 1 Theorem 3 "
    "and Sec. V-A say that it is for the periods of the grid."
)

for e in EXAMPLES:
    ABSTRACT.feasible(
        f"valid.{e}",
        place="Sec. I, on the grid",
        statement=f"In Example {e} the filter of the one period of the grid is valid at all periods of the range: the "
        "error system is stable for every sequence.",
        erratum=SLIP[e],
        says=STABLE_WITH[e],
    )(partial(solution_is_valid, e))
    ABSTRACT.feasible(
        f"valid-own.{e}",
        place="Sec. I, on the grid; Sec. III, before Lemma 2",
        statement=f"Example {e}: even the filter of our corrected grid exceeds its level along some sequence of "
        "periods.",
        ours=True,
        erratum="algorithm",
        pinned="compatible",
        reading=CORRECTED_GRID,
        says=Predicate(of=term("grid solutions of (6) are valid", f"example-{e}"), relation="fails"),
    )(partial(own_solution_is_valid, e))

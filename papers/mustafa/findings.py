"""The findings, most important first: what happens to who relies on the paper."""

from __future__ import annotations

from decimal import Decimal

from papers.mustafa.claims.preliminaries import down, up
from papers.mustafa.method.algorithm1 import AS_PRINTED, CORRECT, WITH_SET_MINUS
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA, upper_end
from replication.audit.model import Results


def times(bound: float, printed: str) -> Decimal:
    """How many times a printed level a lower bound is, to three digits and not more than it is."""
    ratio = bound / float(printed)
    return down(ratio, 2 if ratio < 10 else 1)


def findings(results: Results) -> tuple[str, ...]:
    """The levels, stability, what varying periods cost, what can be guaranteed, the grids."""
    worst = [times(results[f"bracket.{e}"]["lower"], GAMMA[e]) for e in EXAMPLES]
    kept = all(results[f"bracket.{e}"]["nominal"] <= upper_end(GAMMA[e]) for e in EXAMPLES)
    in_seconds = [down(results[f"bracket-duration.{e}"]["lower"]) for e in EXAMPLES]
    sizes = [results[f"grids.{e}"]["algorithm"][CORRECT.name]["size"] for e in EXAMPLES]
    by_condition = [results[f"condition.{e}"]["elements"] for e in EXAMPLES]
    as_read = [reading.name for reading in (AS_PRINTED, WITH_SET_MINUS)]
    ends = {results[f"grids.{e}"]["algorithm"][name]["end"] for e in EXAMPLES for name in as_read}
    floor = times(results["curve.1"]["floor"], GAMMA[1])
    robust = [up(results[f"robust.{e}"]["guaranteed"]) for e in EXAMPLES]
    own = [times(results[f"own-grid.{e}"]["lower"], str(results[f"own-grid.{e}"]["level"])) for e in EXAMPLES]
    return (
        f"{'Both' if kept else 'Not both'} printed levels are right at one constant sampling period; the paper calls "
        "them nominal.",
        "If the period varies within the range, our filter's gain in Example 1 is at least "
        f"{worst[0]} times as large, the printed filter's {worst[1]} times.",
        "The error systems are stable for every sequence of periods: a stable plant and (6) at one period suffice, "
        "without grid or condition (8).",
        f"In Example 1 no stable filter of form (4) guarantees less than {floor} times the printed level for every "
        "sequence.",
        f"Levels for every sequence can be had: one Lyapunov function guarantees {robust[0]} in Example 1 and "
        f"{robust[1]} in Example 2, counting samples.",
        f"In Example 1 the measurement itself, taken as the estimate, guarantees {DATA['example-1']['D']} for every "
        "sequence, less than the printed level.",
        f"One grid element does not cover the range of Example 1: Algorithm 1, corrected, ends with {sizes[0]}, and by "
        f"condition (8) itself with {by_condition[0]:g}.",
        f"In Example 2 the corrected algorithm ends with {sizes[1]} elements by (9), and with {by_condition[1]:g} by "
        "condition (8) itself.",
        f"On the grids of the corrected algorithm the level holds at the elements; along some sequence the gain is "
        f"{own[0]} and {own[1]} times as large.",
        *(
            (
                "As printed, Algorithm 1 covers the range in neither example, with or without the missing set-minus "
                "sign.",
            )
            if ends == {"STALLED"}
            else ()
        ),
        f"Counted in seconds instead of samples, the gains for varying periods are at least {in_seconds[0]} and "
        f"{in_seconds[1]}, still above both levels.",
    )

"""What a reader of the paper must know, with the numbers of a run."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal

from papers.mustafa.claims.main_results import elements
from papers.mustafa.method.algorithm1 import AS_PRINTED, CORRECT
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA
from papers.mustafa.readings import CONDITION_8
from replication.audit.model import Results

WORDS = {1: "first", 2: "second"}


def findings(results: Results) -> tuple[str, ...]:
    """The levels of both examples, the grids, a robust design, the floor, stability: one consequence each."""
    bracket, weighted = (
        {e: results[f"{name}.{e}"]["lower"] for e in EXAMPLES} for name in ("bracket", "bracket-duration")
    )
    whose = {1: "a filter that is optimal for the middle period", 2: "the printed filter"}
    sizes = [results[f"grids.{e}"]["algorithm"][CORRECT.name]["size"] for e in EXAMPLES]
    ends = {results[f"grids.{e}"]["algorithm"][AS_PRINTED.name]["end"] for e in EXAMPLES}
    direct = {e: results[f"condition.{e}"]["constant_bound"] < 1 for e in EXAMPLES}
    own, robust = ({e: results[f"{name}.{e}"] for e in EXAMPLES} for name in ("own-grid", "robust"))
    floor = results["curve.1"]["floor"]
    return (
        *(
            f"The level of the {WORDS[e]} example is nominal only: over all sequences, {whose[e]} has a gain of at "
            f"least {_down(bracket[e])} against {GAMMA[e]}, norms counting samples."
            for e in EXAMPLES
        ),
        f"Norms that count seconds leave the same conclusion: the gains are at least {_down(weighted[1])} and "
        f"{_down(weighted[2])}.",
        f"By the bound (9), corrected, the examples need {sizes[0]} and {sizes[1]} elements in their grids; the paper "
        "has one in each.",
        *(_covers(e, direct[e], elements(e, results)[CONDITION_8.name]) for e in EXAMPLES),
        *(
            f"The corrected algorithm's own level is not robust either in the {WORDS[e]} example: "
            f"{_up(own[e]['level'])}, with a gain of at least {_down(own[e]['lower'])} over all sequences."
            for e in EXAMPLES
        ),
        *(
            (
                "As the text at hand reads, the algorithm stops at its first element in both examples, without "
                "covering the range.",
            )
            if ends == {"STALLED"}
            else ()
        ),
        f"Robust levels can be had: one Lyapunov function guarantees {_up(robust[1]['guaranteed'])} and "
        f"{_up(robust[2]['guaranteed'])} for every sequence, with certificates.",
        f"In the first example no filter of form (4) does better than {_down(floor)}; the measurement as the estimate "
        f"has {DATA['example-1']['D']}, for every sequence.",
        "Stability for every sequence needs no grid: it holds whenever A is Hurwitz and A_f Schur.",
    )


def _covers(e: int, holds: bool, count: float) -> str:
    if holds:
        return f"The printed grid of the {WORDS[e]} example satisfies condition (8) itself; only its bound (9) fails."
    return (
        f"One element does not satisfy condition (8) in the {WORDS[e]} example; evaluated directly, it takes {count:g}."
    )


def _down(number: float) -> Decimal:
    """To four digits, not above the number."""
    return _rounded(number, ROUND_FLOOR)


def _up(number: float) -> Decimal:
    """To four digits, not below the number."""
    return _rounded(number, ROUND_CEILING)


def _rounded(number: float, rounding: str) -> Decimal:
    return Decimal(number).quantize(Decimal("0.0001"), rounding=rounding)

"""Every small fault of these modules of the second verifier is told, by tests of its steps or by the first one."""

from __future__ import annotations

import math
import os
from collections import Counter
from functools import cache
from importlib import import_module

import faults
import mutants
import pytest
from corpus import true

from replication import twice

WHOLE = os.environ.get("MUTANTS") == "all"
SHARE = 8
"""Faults of each module that are tried, evenly spread over it; all with MUTANTS=all (`make mutants-both`)."""
PARTS = ("test_nonuniform_parts", "test_refusals")
TESTS = {
    "interval": ("test_intervals",),
    "nonuniform.condition": PARTS,
    "nonuniform.definite": ("test_definite",),
    "nonuniform.filters": PARTS,
    "nonuniform.grid": PARTS,
    "nonuniform.levels": ("test_level_pieces", "test_refusals"),
}
"""The modules, and the tests of their steps."""
TOUCHES = "an end at zero gives the same on every branch"
TERMS = "more or fewer terms: what is left out is bounded for a norm of up to one, however many they are"
WIDER = "one unit of the last place wider"
WORK = "how much work is done at most"
LATER = "what this refuses, the next line refuses"
WIDTH = "only where an enclosure ends exactly at the bound; this one is of no single number"
TWICE = "twice as large is as positive"
ROWS = "all rows are as long as the first; a plant of one state that is refused is not proved"
SHORT = "e^x - 1 < x + x^2 for all x up to one"
EARLIER = "what this tells apart was refused before"
SAME: dict[str, list[tuple[str, tuple[str, ...], str]]] = {
    "interval": [
        ("least = 0 if self.low < 0 < self.high", ("Lt became LtE", "Lt became LtE"), TOUCHES),
        ("least = 0 if self.low < 0 < self.high", ("became 1", "became 1"), "one unit squared is rounded to none"),
        ("if self.low >= 0 or self.high <= 0:", ("GtE became Gt", "LtE became Lt", "became 1"), TOUCHES),
        ("return 0 if self.low <= 0 <= self.high", ("LtE became Lt", "LtE became Lt"), TOUCHES),
        ("return max(sum((abs(Interval.of(entry))", ("became 1",), "of the sum the upper end alone is read"),
        ("norm, halvings = norm_above(matrix), 4", ("became 5",), TERMS),
        ("while norm * 16", ("Gt became GtE", "Mult became Add", "became 17", "became 2"), TERMS),
        ("halvings += 1", ("became 2",), TERMS),
        ("order, left = 0, Fraction(1)", ("became 2",), TERMS),
        ("while left * ONE > 2:", ("Gt became GtE", "became 3"), TERMS),
        ("for order in range(1, 2 * BITS, 2)", ("Mult became Add", "became 3"), TERMS),
        ("return total.widened(abs(term) * 3)", ("became 4",), WIDER),
        (
            "total, order = Interval(0, 0), 1",
            ("became 1", "became 1"),
            "one unit less on one side, where more than a hundred terms were each rounded to both sides",
        ),
        ("while over**order < ONE:", ("Lt became LtE",), "no power of an odd number is one of two"),
        ("answer: Interval = total.widened(Fraction(1, ONE))", ("became 2",), WIDER),
        ("@lru_cache(maxsize=1000)", ("became 1001",), "how much is kept"),
    ],
    "nonuniform.definite": [
        ("DIGITS = 60", ("became 61",), "any change that is invertible will do"),
        ("spare = max(0, max(", ("became 901",), "any change that is invertible will do"),
        ("if i == j and rest <= 0:", ("became 1",), "without a change the pivots decide, as well for small integers"),
    ],
    "nonuniform.condition": [
        ("HALVINGS = 10", ("became 11",), WORK),
        ("MOST_PIECES = 1000", ("became 1001",), WORK),
        ("small(len(p) <= MOST_PIECES", ("LtE became Lt",), WORK),
        ("need(any(response(one, h, middle) > 1", ("became all",), "a complex pair responds alike, real ones by less"),
        ("need(any(response(one, h, middle) > 1", ("Gt became GtE",), WIDTH),
        ("need(all(imaginary == 0", ("need left out", "became any"), f"{LATER}: a pair has one real part"),
        (
            "need(all(response(one, end, middle) < 1",
            ("need left out", "became any", "Lt became LtE", "became 2"),
            "so it is for real eigenvalues: 2 sqrt(pq) <= p + q < 1 + q for p, q = e^(ah) at the ends, a < 0",
        ),
        ("generator = blocks(", ("Mult became Add",), "2 * 2 = 2 + 2, and there are two states"),
    ],
    "nonuniform.filters": [
        ("ROUNDS = 3", ("became 4",), WORK),
        ("MOST_POINTS = 1000", ("became 1001",), WORK),
        ("need(0 < len(points) <= MOST_POINTS", ("LtE became Lt",), WORK),
        ("n, inputs = len(case.output[0]), len(plant.B[0])", ("became 1",), ROWS),
        ("need(len(plant.B[0]) == len(plant.C)", ("became 1",), ROWS),
        ("largest = max(0,", ("became 1",), "larger to begin with it bounds the entries all the same"),
    ],
    "nonuniform.grid": [
        ("MOST_PASSES = 10", ("became 11",), WORK),
        ("need(0 < len(passes) <= MOST_PASSES", ("LtE became Lt",), WORK),
        ("return one < other", ("Lt became LtE",), EARLIER),
        ("need(spent > 0 and modulus2(answer)", ("Gt became GtE",), "the response to nothing is nothing: no larger"),
        ("need(low <= high", ("need left out", "LtE became Lt"), "both were proved, so that they are not crossed"),
        ("above, below = logarithmic_norm(plant.A)", ("became 2",), TWICE),
        ("need(spent > 0 and modulus2(times(delta", ("Gt became GtE", "Gt became GtE"), f"nothing to nothing; {WIDTH}"),
        ("if above > 0:", ("Gt became GtE",), EARLIER),
        ("need(any(sum(row[j] * row[j]", ("Gt became GtE",), WIDTH),
        ("need(logarithmic_norm(scaled(-1,", ("became 2",), TWICE),
    ],
    "nonuniform.levels": [
        ("HALVINGS = 24", ("became 25",), WORK),
        ("LONG = Fraction(1, 4)", ("became 2", "became 5"), SHORT),
        ("if x >= LONG:", ("GtE became Gt",), SHORT),
        ("need(len(cuts) > 1", ("Gt became GtE",), "one cut is not both zero and one"),
        (
            "slight = off",
            ("Add became Sub", "Mult became Add", "became 3"),
            "rest + off would do for what is off across and off for the rest: all of these are at least so large",
        ),
    ],
}
"""Lines of which a fault alters no answer: how they begin, each fault that is so as often as it is, and why."""


@cache
def corpus() -> list[faults.Case]:
    """Of the nonuniform paper, whose statements use these modules, and of own plants."""
    found = faults.attacked(("stamped", "cells")) + [
        case
        for path, one in true().items()
        if path.startswith(("mustafa/", "own/stamped"))
        for case in faults.made_of(one, 4 if WHOLE else 400)
    ]
    return [case for case in found if not twice.compared(case.one, case.other).conflict]


def unexplained(module: str, left: list[mutants.Mutant]) -> list[mutants.Mutant]:
    """Those that are none of the faults that alter no answer, or are so more often than is said."""
    allowed = Counter((text, change) for text, changes, _ in SAME[module] for change in changes)
    found = []
    for one in left:
        known = [key for key in allowed if one.text.startswith(key[0]) and one.change == key[1] and allowed[key] > 0]
        if known:
            allowed[known[0]] -= 1
        else:
            found.append(one)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("module", TESTS)
def test_each_fault_is_told_by_a_test_of_its_step_or_by_the_first_verifier(module: str) -> None:
    name = f"replication.recheck.{module}"
    import_module(name)
    listed = mutants.mutants_of(name)
    tried = listed if WHOLE else listed[:: math.ceil(len(listed) / SHARE)]
    assert len(tried) > 4
    left = unexplained(module, mutants.survivors(name, tried, TESTS[module]))
    # Most are told by then; a true certificate and its alterations tell others.
    left = list(faults.unnoticed(name, left, corpus())) if left else []
    assert not left, "\n".join(f"{one}: {one.text}" for one in left)


def test_every_line_of_which_a_fault_alters_nothing_is_there() -> None:
    for module, rules in SAME.items():
        name = f"replication.recheck.{module}"
        made = Counter((one.text, one.change) for one in mutants.mutants_of(name))
        for text, changes, reason in rules:
            for change in changes:
                number = sum(count for (line, what), count in made.items() if line.startswith(text) and what == change)
                assert number >= changes.count(change), (module, text, change, reason)

"""The gains under losses and with time stamps, of plants of one state whose true gains are found by hand or by lifting:
above them some storage proves a level, below them none is accepted, by neither verifier, and no lower bound above them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

import faults
import numpy as np
import pytest
from corpus import Certificate

from replication.recheck.reading import NoCheck, Unproved

FREQUENCIES = np.exp(2j * np.pi * np.linspace(0, 0.5, 33))


def proved(certificate: Certificate) -> bool:
    """Whether it is, by both; a refusal says why, and no work is refused as too much."""
    outcome, found = faults.by_first(certificate), faults.by_second(certificate)
    assert not isinstance(found, NoCheck)
    assert "ended in" not in f"{outcome.reason} {found}"
    assert (outcome.theorem is None) == isinstance(found, Unproved), (outcome.reason, found)
    return outcome.theorem is not None


def lifted(steps: Sequence[tuple[float, np.ndarray]]) -> float:
    """The gain from v to e of e+ = a e + b v in a pattern that repeats for ever: the largest over frequencies."""
    count, width = len(steps), steps[0][1].size
    through, driven, states, inputs = 1.0, np.zeros((1, count * width)), [], []
    for k, (a, b) in enumerate(steps):
        states.append(through)
        inputs.append(driven)
        through, driven = a * through, a * driven
        driven[0, k * width : (k + 1) * width] += b
    assert abs(through) < 1
    return max(
        float(np.linalg.norm([(s * driven / (z - through) + own)[0] for s, own in zip(states, inputs, strict=True)], 2))
        for z in FREQUENCIES
    )


def own(statement: str, **groups: Any) -> Certificate:
    return {
        "format": "replication-certificate/1", "paper": None, "name": "by-hand", "claims": [], "statement": statement,
        **groups,
    }  # fmt: skip


A, B, NOISE = Fraction(21, 20), Fraction(1, 5), Fraction(1, 10)
GAIN = Fraction(3, 4)
WALK = ((0, 0), (0, 1), (1, 0))
"""At each instant a sample, of which no two in a row are lost: the sample comes, is lost, comes after a loss."""


def lossy(level: str, stored: Sequence[str], gains: Sequence[Fraction] = (GAIN, GAIN, GAIN)) -> Certificate:
    """x+ = 21/20 x + d/5, y = x + w/10. From below the pattern in which every second sample is lost."""
    return own(
        "multirate.gain-under-losses",
        plant={
            "name": "drift", "A": [[str(A)]], "B_d": [[str(B)]], "C": [["1"]], "D": [[str(NOISE)]], "W": [["1"]],
        },
        parameters={"sensors": [0], "periods": [1], "offsets": [0], "together": 0, "misses": [1]},
        bound={"lower": "1/100", "upper": level},
        witness={
            "L": [[[str(gain)]] for gain in gains],
            "at": [0, 1],
            "to": [[0, 1], [0]],
            "P": [[[one]] for one in stored],
            "word": [1, 2],
            "turn": [["1"]],
            "v": [[["1"], ["0"]], [["0"], ["0"]]],
        },
    )  # fmt: skip


def lossy_gain(longest: int) -> float:
    """Over all patterns up to a length, by lifting."""
    comes = (float(A - GAIN), np.array([float(B), -float(GAIN * NOISE)]))
    lost = (float(A), np.array([float(B), 0.0]))
    words = (word for size in range(1, longest + 1) for word in product((True, False), repeat=size))
    allowed = (word for word in words if all(one or other for one, other in zip(word, (*word[1:], word[0]), strict=True)))
    return max(lifted([comes if one else lost for one in word]) for word in allowed)


def stored(low: float, high: float, count: int, places: int = 10_000) -> list[str]:
    return [str(Fraction(round(one * places), places)) for one in np.geomspace(low, high, count)]


def some_storage(make: Callable[..., Certificate], level: float, values: Sequence[str], number: int = 2) -> bool:
    """Whether one of these storage functions proves the level."""
    shown = str(Fraction(round(level * 10**6), 10**6))
    return any(proved(make(shown, one)) for one in product(values, repeat=number))


def test_a_level_under_losses_lies_above_the_gain_by_lifting() -> None:
    true, values = lossy_gain(8), stored(1.01, 6, 16)
    assert some_storage(lossy, 1.3 * true, values)
    assert not some_storage(lossy, 0.999 * true, values)


CELLS = (Fraction(0), Fraction(1, 2), Fraction(1))
CORRECTIONS = ((Fraction(9, 10), Fraction(0)), (Fraction(3, 5), Fraction(1, 10)))
"""G after short periods and after long ones: these leave 2/5 of the error, so that long after long is worst."""


def stamped(
    level: str,
    stored: Sequence[str],
    corrections: Sequence[tuple[Fraction, Fraction]] = CORRECTIONS,
    rate: str = "0",
    pattern: Sequence[tuple[str, int]] = (("1", 1),),
) -> Certificate:
    """x' = rate x + w, y = x, z = x at periods from 1 to 2 s: an integrator where the rate is zero."""
    count = sum(number for _, number in pattern)
    return own(
        "nonuniform.stamped-gain",
        plant={
            "name": "drive", "A": [[rate]], "B": [["1"]], "C": [["1"]], "D": [["0"]], "L": [["1"]],
            "h_l": ["1", "0"], "h_u": ["2", "0"],
        },
        parameters={},
        bound={"lower": "1/100", "upper": level},
        witness={
            "filter": {"cells": list(map(str, CELLS)), "G": [[[str(x)], [str(w)]] for x, w in corrections]},
            "T": [["1"]],
            "storage": {"cells": list(map(str, CELLS)), "before": [[0, 0]], "P": [[[one]] for one in stored]},
            "pattern": [list(run) for run in pattern],
            "turn": "0",
            "w": [[["1", "0"]]] * count,
        },
    )  # fmt: skip


def stamped_gain(longest: int) -> float:
    """Of the integrator over patterns of the shortest and longest period of each cell, by lifting."""
    # Just below 3/2 s a period is of the first cell: the error is continuous in the period, so 3/2 stands for it.
    periods = ((1.0, 0), (1.5, 0), (1.5, 1), (2.0, 1))

    def steps(word: Sequence[tuple[float, int]]) -> list[tuple[float, np.ndarray]]:
        before = [word[-1], *word[:-1]]
        found = []
        for (h, _), (_, cell) in zip(word, before, strict=True):
            x, w = map(float, CORRECTIONS[cell])
            found.append((1 - x - h * w, np.array([h])))
        return found

    words = (word for size in range(1, longest + 1) for word in product(periods, repeat=size))
    return max(lifted(steps(word)) for word in words)


@pytest.mark.slow
def test_a_level_with_time_stamps_lies_above_the_gain_by_lifting() -> None:
    true, values = stamped_gain(4), stored(1.01, 6, 8)
    assert some_storage(stamped, 1.1 * true, values)
    assert not some_storage(stamped, 0.999 * true, values)


def test_with_an_error_that_grows_nothing_is_proved() -> None:
    """Whatever the level and the storage: where no sample corrects, where half are lost, and after long periods."""
    values = [*stored(1.01, 6, 4), "1000", "1000000000"]
    none, weak = (Fraction(0),) * 3, (GAIN, GAIN, Fraction(-1, 2))
    for gains in (none, weak):
        assert not some_storage(lambda level, one, gains=gains: lossy(level, one, gains), 1e9, values)  # type: ignore[misc]
    # e+ = -3/2 e after long periods, and these may follow each other.
    left = (CORRECTIONS[0], (Fraction(5, 2), Fraction(0)))
    for rate, corrections in (("0", left), ("0", left[::-1]), ("1", ((Fraction(1, 2), Fraction(0)),) * 2)):
        for one in product(values[::2], repeat=2):
            assert not proved(stamped("1000000000", one, corrections, rate, [("0", 1)]))


LEVEL = "1"
STORED = ("3", "3/2")
WIDE = ("3/2", "3/2")


def with_(certificate: Certificate, *way: Any, new: Any) -> Certificate:
    """The same with another value in one place."""
    inner = certificate
    for key in way[:-1]:
        inner = inner[key]
    inner[way[-1]] = new
    return certificate


NEVER = {"word": [1, 1], "two in a row": [1, 0], "from nowhere": [2, 2], "one too many": [1, 2, 1], "none": []}


def test_a_pattern_that_is_not_allowed_proves_no_lower_bound() -> None:
    for word in NEVER.values():
        certificate = lossy(LEVEL, STORED)
        certificate["witness"] |= {"word": word, "v": [[["1"], ["0"]]] * len(word)}
        assert not proved(certificate)
    assert proved(lossy(LEVEL, STORED))


@pytest.mark.parametrize(
    "change",
    [
        {"to": [[0], [0]]},
        {"to": [[0, 0], [0]]},
        {"to": [[0, 1], []]},
        {"to": [[0, 1]], "at": [0], "P": [[["3"]]]},
        {"to": [[0]], "at": [1], "P": [[["3"]]]},
        {"at": [1, 0], "to": [[0], [0, 1]]},
        {"at": [0, 2], "to": [[0, 1], []]},
        {"to": [[0, 2], [0], [0, 1]], "at": [0, 1, 0], "P": [[["3"]], [["3/2"]], [["3"]]]},
        {"L": [[["3/4"]]] * 2},
        {"L": [[["3/4"]]] * 4},
    ],
)
def test_a_storage_that_leaves_out_a_case_proves_nothing(change: dict[str, Any]) -> None:
    certificate = lossy(LEVEL, STORED)
    certificate["witness"] |= change
    assert not proved(certificate)


@pytest.mark.parametrize(
    ("part", "cells"),
    [
        ("filter", ["0", "1"]),
        ("filter", ["0", "1/3", "1"]),
        ("storage", ["0", "1"]),
        ("storage", ["0", "3/4", "1"]),
        ("both", ["0", "1/2"]),
        ("both", ["1/2", "1"]),
        ("both", ["0", "1/2", "9/10"]),
        ("both", ["0", "1", "1"]),
        ("both", ["0", "1", "1/2", "1"]),
        ("both", ["0", "1/1000", "1"]),
    ],
)
def test_cells_that_leave_out_periods_or_are_not_those_of_the_filter_prove_nothing(part: str, cells: list[str]) -> None:
    """The last: nearly all periods have the gain of the second cell, which leaves more of the error."""
    level = f"{27 if '1/1000' not in cells else 24}/10"
    assert proved(stamped("27/10", WIDE))
    certificate = stamped(level, WIDE)
    for one in ("filter", "storage") if part == "both" else (part,):
        certificate["witness"][one]["cells"] = cells
    assert not proved(certificate)

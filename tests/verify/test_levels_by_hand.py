"""The gains under losses and with time stamps, of plants of one state whose true gains are found by hand or by lifting:
above them some storage proves a level, below them none is accepted, and no lower bound above them.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

import byhand
import numpy as np
import pytest
from byhand import CORRECTIONS, GAIN, LEVEL, NOISE, STORED, WIDE, A, B, Certificate, lossy, stamped
from tampered import Altered

from replication.verify.run import check
from replication.verify.theorem import Refused

FREQUENCIES = np.exp(2j * np.pi * np.linspace(0, 0.5, 33))


def proved(certificate: Certificate) -> bool:
    """Whether it is."""
    try:
        return check(certificate) is not None
    except Refused:
        return False


Steps = Sequence[tuple[float, np.ndarray]]
"""(a, b) of e+ = a e + b v at each instant of a pattern that repeats for ever."""


def response(steps: Steps, z: complex) -> np.ndarray:
    """From v over one pattern to e over it, where both turn by z from pattern to pattern."""
    count, width = len(steps), steps[0][1].size
    through, driven, states, inputs = 1.0, np.zeros((1, count * width)), [], []
    for k, (a, b) in enumerate(steps):
        states.append(through)
        inputs.append(driven)
        through, driven = a * through, a * driven
        driven[0, k * width : (k + 1) * width] += b
    assert abs(through) < 1
    return np.vstack([s * driven / (z - through) + own for s, own in zip(states, inputs, strict=True)])


def lifted(steps: Steps) -> float:
    """The gain: the largest over frequencies."""
    return max(float(np.linalg.norm(response(steps, z), 2)) for z in FREQUENCIES)


COMES = (float(A - GAIN), np.array([float(B), -float(GAIN * NOISE)]))
LOST = (float(A), np.array([float(B), 0.0]))


def lossy_gain(longest: int) -> float:
    """Over all patterns up to a length, by lifting."""
    words = (word for size in range(1, longest + 1) for word in product((True, False), repeat=size))
    allowed = (
        word for word in words if all(one or other for one, other in zip(word, (*word[1:], word[0]), strict=True))
    )
    return max(lifted([COMES if one else LOST for one in word]) for word in allowed)


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


def stamped_gain(longest: int) -> float:
    """Of the integrator over patterns of the shortest and longest period of each cell, by lifting."""
    # Just below 3/2 s a period is of the first cell: the error is continuous in the period, so 3/2 stands for it.
    periods = ((1.0, 0), (1.5, 0), (1.5, 1), (2.0, 1))

    def steps(word: Sequence[tuple[float, int]]) -> Steps:
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


def with_(certificate: Certificate, *way: Any, new: Any) -> Certificate:
    """The same with another value in one place."""
    inner = certificate
    for key in way[:-1]:
        inner = inner[key]
    inner[way[-1]] = new
    return certificate


def test_no_disturbance_exceeds_the_gain_by_lifting() -> None:
    """Drawn patterns and disturbances reach no bound above it; those of the largest ratio reach one just below."""
    rng, above = np.random.default_rng(11), Fraction(1001, 1000)
    words = ([0], [1, 2], [2, 1], [1, 2, 0], [0, 0, 1, 2])
    for number in range(40):
        word = words[number % len(words)]
        noise = [[[str(int(i))] for i in rng.integers(-9, 10, 2)] for _ in word]
        certificate = lossy(LEVEL, STORED)
        certificate["bound"]["lower"] = str(Fraction(lossy_gain(4)).limit_denominator(10**6) * above)
        assert not proved({**certificate, "witness": {**certificate["witness"], "word": word, "v": noise}})
        runs = [(str(Fraction(int(share), 4)), 1) for share in rng.integers(0, 5, 3)]
        certificate = stamped("27/10", WIDE, pattern=runs)
        certificate["witness"]["w"] = [[[str(int(i)) for i in rng.integers(-9, 10, 2)]] for _ in runs]
        certificate["bound"]["lower"] = str(Fraction(5, 2) * above)
        assert not proved(certificate)
    assert proved(with_(stamped("27/10", WIDE), "bound", "lower", new="2499/1000"))
    worst = np.linalg.svd(response([LOST, COMES], 1.0))[2][0].reshape(2, 2)
    certificate = lossy(LEVEL, STORED)
    certificate["witness"]["v"] = [[[str(Fraction(entry).limit_denominator(10**6))] for entry in v] for v in worst]
    assert proved(with_(certificate, "bound", "lower", new="133/250"))


@pytest.mark.parametrize("row", byhand.ATTACKS, ids=str)
def test_an_attack_is_refused(row: Altered) -> None:
    """Patterns that are not allowed, covers that leave out a case or periods, levels beyond the true ones."""
    row.check(byhand.attacked(row.name))


def test_what_is_attacked_is_true() -> None:
    assert all(map(proved, byhand.certificates().values()))

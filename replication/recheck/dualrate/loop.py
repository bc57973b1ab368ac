"""The dual-rate loop over one slow period: the plant, its observers, and a command that is held over T."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from replication.recheck.exact import Complex, blocks, minus, nought, plus, scaled, solved, times, unit
from replication.recheck.interval import Interval, exponential, wave
from replication.recheck.reading import Matrix, matrix, need, one_of, positive, small, square, take

OBSERVERS = (
    *("single_rate", "model_interpolation", "alternating_predictive", "running_prediction", "fast_sensor"),
    *("held_measurement", "single_correction", "slow_input_interpolation"),
)
MOST_PERIODS, MOST_STATES = 2000, 10


@dataclass(frozen=True, eq=False)
class Loop:
    """Plant (1), gains K and L, fast period T, ratio M; x(0) if it is given."""

    A: Matrix
    B: Matrix
    C: Matrix
    K: Matrix
    L: Matrix
    T: Fraction
    M: int
    start: Matrix | None = None

    @property
    def guided(self) -> Matrix:
        """A - L C."""
        return minus(self.A, times(self.L, self.C))


def read_loop(plant: Mapping[str, Any], *more: str) -> Loop:
    """The loop of a certificate."""
    _, a, b, c, k, gain, period, ratio, *start = take(plant, "plant", "name", "A", "B", "C", "K", "L", "T", "M", *more)
    state = square(a, "A")
    n = len(state)
    whole = positive(ratio, "M")
    need(whole.denominator == 1, "M is no integer")
    need(whole <= MOST_PERIODS, f"M is above {MOST_PERIODS}")
    small(n <= MOST_STATES, f"more than {MOST_STATES} states")
    return Loop(
        state,
        matrix(b, "B", n, 1),
        matrix(c, "C", 1, n),
        matrix(k, "K", 1, n),
        matrix(gain, "L", n, 1),
        positive(period, "T"),
        int(whole),
        matrix(start[0], "start", n, 1) if start else None,
    )


def read_observer(value: Any, where: str = "observer") -> str:
    """An observer by its name."""
    return one_of(value, where, *OBSERVERS)


def held(state: Matrix, inputs: Matrix, time: Any) -> tuple[Matrix, Matrix]:
    """exp(A t) and the integral of exp(A s) B over [0, t]."""
    n, m = len(inputs), len(inputs[0])
    whole = blocks([[state, inputs], [nought(m, n), nought(m, m)]])
    key = tuple(tuple(row) for row in whole)
    found = _cached(key, time) if isinstance(time, Fraction) else exponential(scaled(time, whole))
    return [row[:n] for row in found[:n]], [row[n:] for row in found[:n]]


@lru_cache(maxsize=500)
def _cached(key: tuple[tuple[Fraction, ...], ...], time: Fraction) -> Matrix:
    return exponential(scaled(time, [list(row) for row in key]))


@dataclass(frozen=True)
class Passage:
    """States and estimates at the phases and the inputs held from them, a column for each start; and how it ends."""

    states: list[Matrix]
    estimates: list[Matrix]
    inputs: list[Matrix]
    end: Matrix


def passed(loop: Loop, observer: str, state: Matrix, own: Matrix, commands: list[Matrix] | None = None) -> Passage:
    """One slow period from x = state and zeta = own; commands: what is added to K times the estimate, by phase.

    single_rate: (2) with the first input and measurement held over M T. model_interpolation: (2) with the measurement
    held over M T and the input over T, while the model alone carries the estimate that K acts on. fast_sensor: (7) with
    a measurement at each instant. alternating_predictive: (7) with (6). running_prediction: (7), where the virtual
    measurement is the one before plus C ((Abar - I) zeta + Bbar u). held_measurement: (2), its measurement held over
    M T. single_correction: (7) at the slow instant, then the model alone. slow_input_interpolation: model
    interpolation whose zeta takes the input of the slow instant throughout.
    """
    free, driven = held(loop.A, loop.B, loop.T)
    f, gh = held(loop.guided, blocks([[loop.B, loop.L]]), loop.T)
    estimate = own
    measured = times(loop.C, state)
    states, estimates, inputs = [], [], []
    for k in range(loop.M):
        if k == 0 or observer != "single_rate":
            u = times(loop.K, estimate)
            u = plus(u, commands[k]) if commands else u
        if observer == "fast_sensor":
            measured = times(loop.C, state)
        states.append(state)
        estimates.append(estimate)
        inputs.append(u)
        state = plus(times(free, state), times(driven, u))
        ahead = plus(times(free, estimate), times(driven, u))
        corrected = k == 0 or observer != "single_correction"
        known = inputs[0] if observer == "slow_input_interpolation" else u
        before, own = own, plus(times(f, own), times(gh, [*known, *measured])) if corrected else ahead
        if observer == "alternating_predictive":
            measured = times(loop.C, ahead)
        elif observer == "running_prediction":
            measured = plus(measured, times(loop.C, minus(ahead, before)))
        estimate = ahead if observer in ("model_interpolation", "slow_input_interpolation") else own
    return Passage(states, estimates, inputs, [*state, *own])


def monodromy(loop: Loop, observer: str) -> Matrix:
    """Phi of (x, zeta) over one slow period, without a command."""
    n = len(loop.A)
    both = unit(2 * n)
    return passed(loop, observer, both[:n], both[n:]).end


def command(loop: Loop, sigma: Fraction, corrected: bool) -> Complex:
    """The amplitude of ybar_d - K (y_d, y_d', y_d'') for y_d of amplitude one at s = j sigma.

    As printed b ybar_d is y_d'' + a2 y_d' + a3 y_d; corrected, so that it inverts the plant, each term has one more
    derivative, in another order: (s^3 + a3 s^2 + a2 s) y_d.
    """
    (_, _, _), (_, _, _), (zero, a2, a3) = _position(loop)
    need(zero == 0, "the plant has no integrator")
    b = loop.B[2][0]
    s, square_ = Complex(Fraction(0), sigma), Complex(-sigma * sigma)
    printed = square_ + s * -a2 + Complex(-a3)
    given = (s * square_ + square_ * -a3 + s * -a2 if corrected else printed) * (1 / b)
    k = loop.K[0]
    answer: Complex = given - (Complex(k[0]) + s * k[1] + square_ * k[2])
    return answer


def _position(loop: Loop) -> Matrix:
    one = Fraction(1)
    need(len(loop.A) == 3, "the command is that of three states")
    need(loop.A[:2] == [[0, one, 0], [0, 0, one]], "the states are no position with its derivatives")
    need(loop.B[:2] == [[0], [0]] and loop.B[2][0] != 0 and [[one, 0, 0]] == loop.C, "B or C is no position form")
    return loop.A


def turn(sigma: Fraction, time: Any) -> Complex:
    """e^(j sigma t)."""
    return Complex(*wave(sigma * time))


def steady(loop: Loop, observer: str, sigma: Fraction, corrected: bool = False) -> tuple[Matrix, list[Matrix]]:
    """The amplitude of (x, zeta) at the slow instants in the steady state, and the commands by phase."""
    n = len(loop.A)
    amplitude = command(loop, sigma, corrected)
    commands = [[[amplitude * turn(sigma, k * loop.T)]] for k in range(loop.M)]
    rest: Matrix = [[Complex(Interval.of(0))] for _ in range(n)]
    forced = passed(loop, observer, rest, rest, commands).end
    system = minus(unit(2 * n, turn(sigma, loop.M * loop.T)), monodromy(loop, observer))
    return solved(system, forced), commands


def steady_passage(loop: Loop, observer: str, sigma: Fraction, corrected: bool = False) -> Passage:
    """The amplitudes over a slow period in the steady state."""
    first, commands = steady(loop, observer, sigma, corrected)
    n = len(loop.A)
    return passed(loop, observer, first[:n], first[n:], commands)

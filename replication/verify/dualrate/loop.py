"""The dual-rate loop of Shao et al. over one slow period, enclosed: eqs. (2) to (8) carried out on many starts at once.

Every start is a column. Nothing of an observer but its estimate ζ outlives a slow period, since each begins with a
measurement; so the loop is z = (x, ζ) → Φ z with Φ of size 2n.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from typing import Any

from flint import arb_mat, fmpq_mat

from replication.verify.algebra.linear import hold, identity
from replication.verify.algebra.work import BALL, spend
from replication.verify.reading import fields, matrix, one_of, positive, sized, states
from replication.verify.statement import statement
from replication.verify.theorem import require

LARGEST_RATIO = 2000
BITS = 256
"""Working precision of ball arithmetic."""


class Observer(StrEnum):
    """What estimates the state between two measurements; words: the loop with it, in a sentence."""

    words: str
    SRC = "single_rate", "the single-rate loop"
    SRC_SINGLE = "single_rate_correction", "the single-rate loop with one correction in a slow period"
    PMI = "model_interpolation", "the loop with model interpolation"
    HELD = "held_measurement", "the loop with the measurement held over the slow period"
    SINGLE = "single_correction", "the loop with one correction in a slow period"
    SLOW_INPUT = (
        "slow_input_interpolation",
        "the loop with model interpolation whose observer takes the input of the slow instant",
    )
    APO = "alternating_predictive", "the loop with the alternating predictive observer"
    RESTARTED = "running_prediction", "the loop with the restarted predictor"
    FAST = "fast_sensor", "the loop with a sensor at every fast instant"

    def __new__(cls, name: str, words: str) -> Observer:
        """The string `name`, with words."""
        member = str.__new__(cls, name)
        member._value_, member.words = name, words
        return member


OBSERVER = sized(one_of, Observer)
"""The reader of an observer by its name."""


def held_over(*observers: Observer) -> str:
    """For how long a command is held in loops with these observers."""
    single = [observer in SINGLE_RATE for observer in observers]
    return "M T" if all(single) else "T, over M T in the single-rate loop" if any(single) else "T"


SINGLE_RATE = (Observer.SRC, Observer.SRC_SINGLE)
"""Those whose controller, too, acts at the slow instants only."""
INTERPOLATED = {Observer.HELD: "pmi-held", Observer.SINGLE: "pmi-one-correction", Observer.SLOW_INPUT: "pmi-slow-input"}
"""Readings of the manuscript under which an observer is that of DRC-PMI; it is PMI under the others."""
ALTERNATIVES = {Observer.SRC_SINGLE: "src-one-correction", **INTERPOLATED}
"""The same of SRC and DRC-PMI; the observer of SRC is SRC under the others."""


Command = Callable[[int], arb_mat]
"""What is added to K x̂ at each phase 0 … M − 1, for each column."""


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Plant (1), one input, one output, gains K of (8) and L of (3), fast period T in s, ratio M; x(0) and its name.

    T is rational, or a ball of all periods that are meant.
    """

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat
    K: fmpq_mat
    L: fmpq_mat
    T: Any
    M: int
    start: fmpq_mat = field(default_factory=partial(fmpq_mat, 0, 1))
    name: str = ""

    @property
    def data(self) -> str:
        """Its matrices, gains and M where all are numbers, else its size and M."""
        if self.order > 1:
            return f"{self.order} states, M = {self.M}"
        listed = ((name, getattr(self, name)[0, 0]) for name in "ABCKL")
        return ", ".join([*(f"{name} = {value}" for name, value in listed), f"M = {self.M}"])

    @property
    def order(self) -> int:
        """Number n of states of the plant."""
        return self.A.nrows()

    @property
    def guided(self) -> fmpq_mat:
        """A − L C, the Â of (3)."""
        return self.A - self.L * self.C


@dataclass(frozen=True, kw_only=True)
class Passage:
    """States x and estimates x̂ at the phases 0 … M − 1 and the inputs held from them, one column per start; x and ζ
    after M phases."""

    states: list[arb_mat]
    used: list[arb_mat]
    inputs: list[arb_mat]
    state: arb_mat
    estimate: arb_mat


def read_loop(plant: Any, path: str = "plant", *start: str) -> Loop:
    """The loop of a certificate, with x(0) where `start` names it; refused unless all shapes fit."""
    name, A, B, C, K, L, T, M, *first = fields(plant, path, "name", "A", "B", "C", "K", "L", "T", "M", *start)
    A = states(A, f"{path}.A")
    n = A.nrows()
    ratio = positive(M, f"{path}.M")
    require(
        ratio.denominator == 1 and ratio <= LARGEST_RATIO,
        f"{path}.M must be whole and at most {LARGEST_RATIO}, got {ratio}",
    )
    return Loop(
        A=A,
        B=matrix(B, f"{path}.B", n, 1),
        C=matrix(C, f"{path}.C", 1, n),
        K=matrix(K, f"{path}.K", 1, n),
        L=matrix(L, f"{path}.L", n, 1),
        T=positive(T, f"{path}.T"),
        M=int(ratio.numerator),
        start=matrix(first[0], f"{path}.start", n, 1) if first else fmpq_mat(0, 1),
        name=str(name),
    )


on_loop = partial(statement, plant=read_loop, bits=BITS)
on_paper = partial(on_loop, source="shao")
"""A statement on such a loop, and one in words of the paper."""


def pass_period(loop: Loop, observer: Observer, state: arb_mat, estimate: arb_mat, command: Command) -> Passage:
    """One slow period from x = state and ζ = estimate, each (n, columns), at a slow instant."""
    n = loop.order
    spend((12 * loop.M * n**2 * state.ncols() + 200 * (n + 1) ** 3) * BALL, "the loop over a slow period")
    A, B = hold(loop.A, loop.B, loop.T)
    F, G = hold(loop.guided, loop.B, loop.T)
    H = hold(loop.guided, loop.L, loop.T)[1]
    C, K = arb_mat(loop.C), arb_mat(loop.K)
    x, zeta = state, estimate
    states, estimates, inputs = [], [], []
    measured, used = C * x, zeta
    u = first = K * used + command(0)
    for phase in range(loop.M):
        states.append(x)
        estimates.append(used)
        inputs.append(u)
        predicted, carried = A * zeta + B * u, A * used + B * u
        step = C * (predicted - zeta)
        alone = observer in (Observer.SINGLE, Observer.SRC_SINGLE) and phase > 0
        known = first if observer is Observer.SLOW_INPUT else u
        x, zeta = A * x + B * u, predicted if alone else F * zeta + G * known + H * measured
        if observer is Observer.APO:  # (6)
            measured = C * predicted
        elif observer is Observer.RESTARTED:  # (6) as a step on from the last measurement
            measured = measured + step
        elif observer is Observer.FAST:
            measured = C * x
        used = carried if observer in (Observer.PMI, Observer.SLOW_INPUT) else zeta
        if observer not in SINGLE_RATE:
            u = K * used + command(phase + 1)
    return Passage(states=states, used=estimates, inputs=inputs, state=x, estimate=zeta)


def monodromy(loop: Loop, observer: Observer) -> arb_mat:
    """Φ of size 2n: x and ζ at a slow instant to those at the next one, without a command."""
    n, nothing = loop.order, arb_mat(1, 2 * loop.order)
    unit = identity(2 * n).tolist()
    end = pass_period(loop, observer, arb_mat(unit[:n]), arb_mat(unit[n:]), lambda _: nothing)
    return arb_mat(end.state.tolist() + end.estimate.tolist())

"""The dual-rate loop of Shao et al. over one slow period, enclosed: eqs. (2) to (8) carried out on many starts at once.

Every start is a column. Nothing of an observer but its estimate ζ outlives a slow period, since each begins with a
measurement; so the loop is z = (x, ζ) → Φ z with Φ of size 2n.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, ctx, fmpq, fmpq_mat

from replication.verify.algebra.linear import require_order
from replication.verify.reading import fields, matrix, positive, text
from replication.verify.theorem import Theorem, require

SRC, PMI, APO = "single_rate", "model_interpolation", "alternating_predictive"
REPAIRED, FAST = "running_prediction", "fast_sensor"
LOOP_FIELDS = ("name", "A", "B", "C", "K", "L", "T", "M")
LARGEST_RATIO = 100
BITS = 256
"""Working precision of ball arithmetic."""
OBSERVERS = (SRC, PMI, APO, REPAIRED, FAST)

Command = Callable[[int], acb]
"""What is added to K x̂ at each phase 0 … M − 1."""


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Plant (1) with one input and one output, gains K of (8) and L of (3), fast period T in s, ratio M."""

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat
    K: fmpq_mat
    L: fmpq_mat
    T: fmpq
    M: int

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

    states: list[acb_mat]
    used: list[acb_mat]
    inputs: list[acb_mat]
    state: acb_mat
    estimate: acb_mat


def read_loop(plant: Any) -> Loop:
    """The loop of a certificate; refused unless all shapes fit."""
    _, A, B, C, K, L, T, M = fields(plant, "plant", *LOOP_FIELDS)
    A = matrix(A, "plant.A")
    n = A.nrows()
    require(A.ncols() == n, f"plant.A must be square, got {n} x {A.ncols()}")
    require_order(n, "plant.A")
    ratio = positive(M, "plant.M")
    require(ratio.q == 1 and ratio <= LARGEST_RATIO, f"plant.M must be whole and at most {LARGEST_RATIO}, got {ratio}")
    return Loop(
        A=A,
        B=matrix(B, "plant.B", n, 1),
        C=matrix(C, "plant.C", 1, n),
        K=matrix(K, "plant.K", 1, n),
        L=matrix(L, "plant.L", n, 1),
        T=positive(T, "plant.T"),
        M=int(ratio.p),
    )


def hold(A: fmpq_mat, inputs: fmpq_mat, time: fmpq | arb) -> tuple[arb_mat, arb_mat]:
    """e^{A t} and ∫₀^t e^{A τ} dτ · inputs, as blocks of one exponential."""
    n, m = inputs.nrows(), inputs.ncols()
    rows = [[*A.tolist()[i], *inputs.tolist()[i]] for i in range(n)] + [[0] * (n + m)] * m
    power = (arb_mat(rows) * arb(time)).exp().tolist()
    return arb_mat([row[:n] for row in power[:n]]), arb_mat([row[n:] for row in power[:n]])


def pass_period(loop: Loop, observer: str, state: acb_mat, estimate: acb_mat, command: Command) -> Passage:
    """One slow period from x = state and ζ = estimate, each (n, columns), at a slow instant."""
    A, B = map(acb_mat, hold(loop.A, loop.B, loop.T))
    F, G = map(acb_mat, hold(loop.guided, loop.B, loop.T))
    H = acb_mat(hold(loop.guided, loop.L, loop.T)[1])
    C, K = acb_mat(loop.C), acb_mat(loop.K)
    x, zeta = state, estimate
    states, estimates, inputs = [], [], []
    measured, used = C * x, zeta
    u = K * used + _row(command(0), x.ncols())
    for phase in range(loop.M):
        states.append(x)
        estimates.append(used)
        inputs.append(u)
        predicted, carried = A * zeta + B * u, A * used + B * u
        step = C * (predicted - zeta)
        x, zeta = A * x + B * u, F * zeta + G * u + H * measured
        if observer == APO:  # (6)
            measured = C * predicted
        elif observer == REPAIRED:  # (6) as a step on from the last measurement
            measured = measured + step
        elif observer == FAST:
            measured = C * x
        used = carried if observer == PMI else zeta
        if observer != SRC:
            u = K * used + _row(command(phase + 1), x.ncols())
    return Passage(states=states, used=estimates, inputs=inputs, state=x, estimate=zeta)


def _row(value: acb, columns: int) -> acb_mat:
    return acb_mat([[value] * columns])


def monodromy(loop: Loop, observer: str) -> arb_mat:
    """Φ of size 2n: x and ζ at a slow instant to those at the next one, without a command."""
    unit = [[int(i == j) for j in range(2 * loop.order)] for i in range(2 * loop.order)]
    end = pass_period(loop, observer, acb_mat(unit[: loop.order]), acb_mat(unit[loop.order :]), lambda _: acb(0))
    return arb_mat([[entry.real for entry in line] for line in end.state.tolist() + end.estimate.tolist()])


def read_observer(value: Any) -> str:
    """One of `OBSERVERS`."""
    name = text(value, "parameters.observer")
    require(name in OBSERVERS, f"parameters.observer must be one of {', '.join(OBSERVERS)}, got {name!r:.40}")
    return name


def precisely(statement: Callable[[Mapping[str, Any]], Theorem]) -> Callable[[Mapping[str, Any]], Theorem]:
    """The statement proved at a working precision of `BITS`."""

    def proved(certificate: Mapping[str, Any]) -> Theorem:
        with ctx.workprec(BITS):
            return statement(certificate)

    return proved

"""The loop's response to y_d = sin σt: its steady state, and the largest error of that between and at all instants.

With s = jσ all signals of the steady state are Im(amplitude · e^{st}) with amplitudes of period M T: at the slow
instants X = (e^{sMT} I − Φ)^{-1} Γ, where Γ is what the command alone brings about in one slow period.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from flint import acb, acb_mat, acb_poly, arb, arb_poly, fmpq

from replication.verify.algebra.linear import identity, largest, solved, zeros
from replication.verify.algebra.work import BALL, spend
from replication.verify.dualrate.loop import Loop, Observer, Passage, monodromy, pass_period
from replication.verify.kernel import Below, Within, decide, holds
from replication.verify.reading import fields, integer, positive, rational, sequence
from replication.verify.theorem import Refused, require

TERMS, PIECES, PARTS = 24, 32, 2000
"""Of the Taylor polynomials; of a fast period; that a piece may be cut into before the bound is given up."""


class Feedforward(StrEnum):
    """ȳ_d: as printed, or as the inverse of the plant."""

    PRINTED = "printed"
    CORRECTED = "corrected"

    @property
    def words(self) -> str:
        """The command with it, in a sentence on the manuscript."""
        return {Feedforward.PRINTED: "as printed", Feedforward.CORRECTED: "with ȳ_d that inverts the motor"}[self]

    @property
    def formula(self) -> str:
        """b ȳ_d."""
        return {
            Feedforward.PRINTED: "y_d'' + a₂ y_d' + a₃ y_d",
            Feedforward.CORRECTED: "y_d''' + a₃ y_d'' + a₂ y_d'",
        }[self]


PRINTED = Feedforward.PRINTED


@dataclass(frozen=True, kw_only=True)
class Motion:
    """v' = N v on one fast period, v = (x, u, w) with u held and w' = s w, and the error y − y_d = row · v.

    scales: positive weights of v, in which ‖v‖ = max |v_i|/scales_i and `growth` is a bound of the norm of N.
    """

    N: acb_mat
    row: acb_mat
    scales: Sequence[fmpq]

    @property
    def growth(self) -> arb:
        """Largest row sum of N in the weights."""
        sums = [
            sum((abs(entry) * arb(b) for entry, b in zip(row, self.scales, strict=True)), arb(0)) / arb(a)
            for row, a in zip(self.N.tolist(), self.scales, strict=True)
        ]
        return largest(sums)

    def size(self, v: acb_mat) -> arb:
        """‖v‖."""
        return largest([abs(entry) / arb(a) for entry, a in zip(v.entries(), self.scales, strict=True)])

    def output_size(self) -> arb:
        """The largest |row · v| with ‖v‖ = 1."""
        return sum((abs(c) * arb(a) for c, a in zip(self.row.entries(), self.scales, strict=True)), arb(0))


def require_position_form(loop: Loop) -> None:
    """Refuse unless the plant is θ''' + a₃ θ'' + a₂ θ' = b u with x = (θ, θ', θ'') and y = θ."""
    require(loop.order == 3, f"the command is defined for a plant of order 3, not {loop.order}")
    b = loop.B[2, 0]
    chained = loop.A.entries()[:7] == [0, 1, 0, 0, 0, 1, 0]
    reached = [*loop.C.entries(), *loop.B.entries()] == [1, 0, 0, 0, 0, b]
    require(chained and reached and b != 0, "the command is defined for a plant in position, speed and acceleration")


def command_amplitude(loop: Loop, s: acb, form: Feedforward) -> acb:
    """r of u = K x̂ + Im(r e^{st}): ȳ_d − K (y_d, y_d', y_d'') with one of the forms of ȳ_d.

    The loop is one for which `require_position_form` holds.
    """
    A, b = loop.A, acb(loop.B[2, 0])
    a2, a3 = acb(-A[2, 1]), acb(-A[2, 2])
    pushed = s**2 + a2 * s + a3 if form is PRINTED else s**3 + a3 * s**2 + a2 * s
    return pushed / b - sum((acb(loop.K[0, i]) * s**i for i in range(3)), acb(0))


def turn(s: acb, time: fmpq) -> acb:
    """e^{s t}."""
    return (s * acb(time)).exp()


def steady_start(loop: Loop, observer: Observer, s: acb, form: Feedforward = PRINTED) -> acb_mat:
    """X: amplitude of (x, ζ) at the slow instants, shape (2n, 1); refused if e^{sMT} may be an eigenvalue of Φ."""
    n, amplitude = loop.order, command_amplitude(loop, s, form)
    nothing = acb_mat(zeros(n, 1))
    end = pass_period(loop, observer, nothing, nothing, lambda k: amplitude * turn(s, k * loop.T))
    added = acb_mat(end.state.tolist() + end.estimate.tolist())
    shifted = acb_mat(identity(2 * n)) * turn(s, loop.M * loop.T) - acb_mat(monodromy(loop, observer))
    X: acb_mat = solved(shifted, added, "the reference may excite an eigenvalue of Φ on the unit circle")
    return X


def steady_passage(loop: Loop, observer: Observer, s: acb, form: Feedforward = PRINTED) -> Passage:
    """Amplitudes at the phases of a slow period that starts at t = 0, not turned back."""
    n, amplitude = loop.order, command_amplitude(loop, s, form)
    start = steady_start(loop, observer, s, form).tolist()
    return pass_period(
        loop, observer, acb_mat(start[:n]), acb_mat(start[n:]), lambda k: amplitude * turn(s, k * loop.T)
    )


def steady_motion(
    loop: Loop, observer: Observer, sigma: fmpq, scales: Sequence[fmpq], form: Feedforward = PRINTED
) -> tuple[Motion, list[acb_mat]]:
    """The motion within a fast period and v at each phase, with y_d = sin σt; refused unless the loop is stable."""
    require_position_form(loop)
    decide(Within(monodromy(loop, observer).charpoly(), "the eigenvalues of Φ"))
    n, s, zero = loop.order, acb(0, arb(sigma)), acb(0)
    rows = [[*map(acb, A), *map(acb, B), zero] for A, B in zip(loop.A.tolist(), loop.B.tolist(), strict=True)]
    N = acb_mat([*rows, [zero] * (n + 2), [*[zero] * (n + 1), s]])
    passage = steady_passage(loop, observer, s, form)
    begun = [
        acb_mat([*x.tolist(), *u.tolist(), [turn(s, k * loop.T)]])
        for k, (x, u) in enumerate(zip(passage.states, passage.inputs, strict=True))
    ]
    return Motion(N=N, row=acb_mat([[*loop.C.entries(), 0, -1]]), scales=scales), begun


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where an error is large: a time after the instant of a phase; and the weights in which the motion is bounded."""

    phase: int
    time: fmpq
    scales: Sequence[fmpq]


def read_place(value: Any, path: str, loop: Loop) -> Place:
    """{phase, time, scales}; refused unless phase and time lie within a slow period."""
    phase, time, scales = fields(value, path, "phase", "time", "scales")
    at, after = integer(phase, f"{path}.phase"), rational(time, f"{path}.time")
    require(at < loop.M and 0 <= after <= loop.T, f"{path}.phase or {path}.time lies outside the slow period")
    return Place(phase=at, time=after, scales=sequence(scales, f"{path}.scales", positive, loop.order + 2))


def error_at(moving: Motion, start: acb_mat, time: fmpq) -> arb:
    """|y − y_d| at a time after an instant."""
    return abs((moving.row * (moving.N * acb(time)).exp() * start)[0, 0])


def pieces(moving: Motion, start: acb_mat, length: fmpq) -> Iterator[tuple[acb_poly, arb]]:
    """Taylor polynomial of the error about the middle of each piece of [0, length], and a bound of its remainder.

    With x = growth · h, h the half width, the remainder is at most |row| ‖v‖ x^n/n! e^x.
    """
    half = length / (2 * PIECES)
    reach = moving.growth * arb(half)
    step = (moving.N * acb(2 * half)).exp()
    v = (moving.N * acb(half)).exp() * start
    rows = [moving.row]
    for k in range(1, TERMS):
        rows.append(rows[-1] * moving.N / k)
    of_error = acb_mat([row.entries() for row in rows])
    tail = moving.output_size() * reach**TERMS / arb.fac_ui(TERMS) * reach.exp()
    for _ in range(PIECES):
        yield acb_poly((of_error * v).entries()), tail * moving.size(v)
        v = step * v


def require_all_below(moving: Motion, begun: Sequence[acb_mat], length: fmpq, bound: fmpq) -> None:
    """Refuse unless |y − y_d| ≤ bound in all fast periods of a slow one."""
    for start in begun:
        require_error_below(moving, start, length, bound)


def require_error_below(moving: Motion, start: acb_mat, length: fmpq, bound: fmpq) -> None:
    """Refuse unless |y − y_d| ≤ bound on all of a fast period."""
    half = length / (2 * PIECES)
    for polynomial, remainder in pieces(moving, start, length):
        allowed = arb(bound) - remainder
        decide(Below(0, allowed, "the remainder of the Taylor polynomial exceeds the bound; choose other scales"))
        parts = polynomial.coeffs()
        real, imaginary = arb_poly([c.real for c in parts]), arb_poly([c.imag for c in parts])
        require_below(real * real + imaginary * imaginary - arb_poly([allowed**2]), -half, half)


def require_below(polynomial: arb_poly, left: fmpq, right: fmpq) -> None:
    """Refuse unless the polynomial is negative on [left, right]: halves, with the mean value theorem on each part."""
    slope, todo = polynomial.derivative(), [(left, right)]
    for _ in range(PARTS):
        if not todo:
            return
        spend(100 * BALL, "the largest error")
        a, b = todo.pop()
        middle, steepest = (a + b) / 2, abs(slope(arb(a).union(arb(b))))
        if not holds(Below(polynomial(arb(middle)) + steepest * arb(b - middle), 0, "this part")):
            todo += [(a, middle), (middle, b)]
    raise Refused("the largest error is not proved to be below the bound")

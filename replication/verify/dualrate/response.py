"""The loop's response to y_d = sin σt: its steady state, statements on the largest errors of tracking and estimate.

With s = jσ all signals of the steady state are Im(amplitude · e^{st}) with amplitudes of period M T: at the slow
instants X = (e^{sMT} I − Φ)^{-1} Γ, where Γ is what the command alone brings about in one slow period.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import factorial
from typing import Any

from flint import acb, acb_mat, acb_poly, arb, arb_mat, arb_poly, fmpq

from replication.verify.algebra.linear import above, amplitudes, below, energy, largest, parts, resolved
from replication.verify.algebra.work import BALL, spend
from replication.verify.dualrate.loop import (
    INTERPOLATED,
    OBSERVER,
    Loop,
    Observer,
    Passage,
    held_over,
    monodromy,
    on_paper,
    pass_period,
)
from replication.verify.kernel import decide, holds, less, within
from replication.verify.predicate import NO_READING, Says
from replication.verify.reading import Reader, integer, one_of, positive, rational, record, sequence, several, sized
from replication.verify.statement import Depends
from replication.verify.theorem import Found, Refused, require

TERMS, PIECES, PARTS = 24, 32, 2000
"""Of the Taylor polynomials; of a fast period; that a piece may be cut into before the bound is given up."""


PRINTED = "printed"
COMMANDS = {
    PRINTED: {"command": "as printed", "input": "y_d'' + a₂ y_d' + a₃ y_d"},
    "corrected": {"command": "with ȳ_d that inverts the motor", "input": "y_d''' + a₃ y_d'' + a₂ y_d'"},
}
"""By the form of ȳ_d, printed or the inverse of the plant: the command in a sentence on the manuscript, and b ȳ_d."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """v' = N v on one fast period, v = (x, u, w) with u held and w' = s w, and the error y − y_d = row · v.

    scales: positive weights of v, in which ‖v‖ = max |v_i|/scales_i.
    """

    N: acb_mat
    row: acb_mat
    scales: Sequence[fmpq]


def norm(M: acb_mat, into: Sequence[fmpq], of: Sequence[fmpq]) -> arb:
    """The norm of M, its largest row sum, where vectors are measured by max |v_i|/weight_i before and after it."""
    rows = (sum((abs(entry) * arb(b) for entry, b in zip(row, of, strict=True)), arb(0)) for row in M.tolist())
    return largest([total / arb(a) for total, a in zip(rows, into, strict=True)])


def require_position_form(loop: Loop) -> None:
    """Refuse unless the plant is θ''' + a₃ θ'' + a₂ θ' = b u with x = (θ, θ', θ'') and y = θ."""
    require(loop.order == 3, f"the command is defined for a plant of order 3, not {loop.order}")
    b = loop.B[2, 0]
    chained = loop.A.entries()[:7] == [0, 1, 0, 0, 0, 1, 0]
    reached = [*loop.C.entries(), *loop.B.entries()] == [1, 0, 0, 0, 0, b]
    require(chained and reached and b != 0, "the command is defined for a plant in position, speed and acceleration")


def command_amplitude(loop: Loop, s: acb, form: str) -> acb:
    """r of u = K x̂ + Im(r e^{st}): ȳ_d − K (y_d, y_d', y_d'') with one of the forms of ȳ_d.

    The loop is one for which `require_position_form` holds.
    """
    A, b = loop.A, acb(loop.B[2, 0])
    a2, a3 = acb(-A[2, 1]), acb(-A[2, 2])
    pushed = s**2 + a2 * s + a3 if form == PRINTED else s**3 + a3 * s**2 + a2 * s
    return pushed / b - sum((acb(loop.K[0, i]) * s**i for i in range(3)), acb(0))


def turn(s: acb, time: fmpq) -> acb:
    """e^{s t}."""
    return (s * acb(time)).exp()


def driven(loop: Loop, observer: Observer, s: acb, form: str, start: Sequence[acb]) -> Passage:
    """Parts of the amplitudes over a slow period with the command, from those of (x, ζ)."""
    n, amplitude = loop.order, command_amplitude(loop, s, form)
    return pass_period(
        loop, observer, parts(start[:n]), parts(start[n:]), lambda k: parts([amplitude * turn(s, k * loop.T)])
    )


def steady_start(loop: Loop, observer: Observer, s: acb, form: str = PRINTED) -> list[acb]:
    """X: amplitudes of (x, ζ) at the slow instants; refused if e^{sMT} may be an eigenvalue of Φ."""
    end = driven(loop, observer, s, form, [acb(0)] * (2 * loop.order))
    added = acb_mat([[entry] for entry in amplitudes(end.state) + amplitudes(end.estimate)])
    excited = "the reference may excite an eigenvalue of Φ on the unit circle"
    return resolved(monodromy(loop, observer), turn(s, loop.M * loop.T), added, excited).entries()


def steady_passage(loop: Loop, observer: Observer, s: acb, form: str = PRINTED) -> Passage:
    """Parts of the amplitudes at the phases of a slow period that starts at t = 0, not turned back."""
    return driven(loop, observer, s, form, steady_start(loop, observer, s, form))


def steady_motion(
    loop: Loop, observer: Observer, sigma: fmpq, scales: Sequence[fmpq], form: str = PRINTED
) -> tuple[Motion, acb_mat]:
    """The motion within a fast period and v at each phase, a column, with y_d = sin σt; refused unless stable."""
    require_position_form(loop)
    decide(within(monodromy(loop, observer), "the eigenvalues of Φ"))
    n, s, zero = loop.order, acb(0, arb(sigma)), acb(0)
    rows = [[*map(acb, A), *map(acb, B), zero] for A, B in zip(loop.A.tolist(), loop.B.tolist(), strict=True)]
    N = acb_mat([*rows, [zero] * (n + 2), [*[zero] * (n + 1), s]])
    passage = steady_passage(loop, observer, s, form)
    begun = [
        [*amplitudes(x), *amplitudes(u), turn(s, k * loop.T)]
        for k, (x, u) in enumerate(zip(passage.states, passage.inputs, strict=True))
    ]
    return Motion(N=N, row=acb_mat([[*loop.C.entries(), 0, -1]]), scales=scales), acb_mat(begun).transpose()


def error_at(moving: Motion, start: acb_mat, time: fmpq) -> arb:
    """|y − y_d| at a time after an instant at which v is `start`."""
    return abs((moving.row * (moving.N * acb(time)).exp() * start)[0, 0])


def pieces(moving: Motion, begun: acb_mat, length: fmpq) -> Iterator[list[tuple[acb_poly, arb]]]:
    """Taylor polynomial of the error about the middle of each piece of [0, length], and a bound of its remainder, from
    each start, a column.

    With x = ‖N‖ h, h the half width, the remainder is at most ‖row‖ ‖v‖ x^n/n! e^x.
    """
    half, scales, one = length / (2 * PIECES), moving.scales, [fmpq(1)]
    reach = norm(moving.N, scales, scales) * arb(half)
    step = (moving.N * acb(2 * half)).exp()
    v = (moving.N * acb(half)).exp() * begun
    rows = [moving.row]
    for k in range(1, TERMS):
        rows.append(rows[-1] * moving.N / k)
    of_error = acb_mat([row.entries() for row in rows])
    tail = norm(moving.row, one, scales) * reach**TERMS / factorial(TERMS) * reach.exp()
    for _ in range(PIECES):
        polynomials, states = (M.transpose().tolist() for M in (of_error * v, v))
        sizes = [norm(acb_mat([[entry] for entry in state]), scales, one) for state in states]
        yield [(acb_poly(terms), tail * size) for terms, size in zip(polynomials, sizes, strict=True)]
        v = step * v


def require_errors_below(moving: Motion, begun: acb_mat, length: fmpq, bound: fmpq) -> None:
    """Refuse unless |y − y_d| ≤ bound on all of a fast period, from each start, a column."""
    half = length / (2 * PIECES)
    for piece in pieces(moving, begun, length):
        for polynomial, remainder in piece:
            allowed = arb(bound) - remainder
            decide(less(0, allowed, "the remainder of the Taylor polynomial exceeds the bound; choose other scales"))
            require_modulus_below(polynomial, allowed, -half, half)


def require_modulus_below(polynomial: acb_poly, bound: arb, left: fmpq, right: fmpq) -> None:
    """Refuse unless |p| < bound on [left, right]: halves, with the mean value theorem for |p|² on each part."""
    both = [arb_poly([*column]) for column in zip(*parts(polynomial.coeffs()).tolist(), strict=True)]
    slopes, todo = [part.derivative() for part in both], [(left, right)]
    for _ in range(PARTS):
        if not todo:
            return
        spend(100 * BALL, "the largest error")
        a, b = todo.pop()
        middle, span = (a + b) / 2, arb(a).union(arb(b))
        steepest = abs(sum((p(span) * slope(span) for p, slope in zip(both, slopes, strict=True)), arb(0))) * 2
        square = energy(arb_mat([[p(arb(middle)) for p in both]]))
        if not holds(less(square + steepest * arb(b - middle), bound**2, "this part")):
            todo += [(a, middle), (middle, b)]
    raise Refused("the largest error is not proved to be below the bound")


# Statements: bounds of the largest errors, and which of two observers errs less.


MOST = 6
"""Frequencies of a theorem, those of Table I."""
INSTANTS = {"all": "at all times", "fast": "at the fast instants"}
READINGS: Mapping[tuple[str, str], str] = {
    ("printed", "all"): "literal",
    ("printed", "fast"): "fast-instants",
    ("corrected", "all"): "corrected-feedforward",
    ("corrected", "fast"): "corrected-feedforward-fast-instants",
}
"""Under which reading a command and instants are those of both columns of Table I."""
COLUMNS = (Observer.PMI, Observer.APO)


@dataclass(frozen=True)
class Error:
    """Bounds of a largest error in percent of the amplitude; where the lower one is met: a time after the instant of a
    phase; and the weights in which the motion is bounded."""

    lower: fmpq
    upper: fmpq
    phase: int
    time: fmpq
    scales: Sequence[fmpq]


def read_error(value: Any, path: str, loop: Loop) -> Error:
    """{lower, upper, phase, time, scales}; refused unless phase and time lie within a slow period."""
    readers: dict[str, Reader] = {
        "lower": positive,
        "upper": positive,
        "phase": integer,
        "time": rational,
        "scales": sized(sequence, positive, loop.order + 2),
    }
    error = Error(**record(value, path, readers))
    inside = error.phase < loop.M and 0 <= error.time <= loop.T
    require(inside, f"{path}.phase or {path}.time lies outside the slow period")
    return error


def _readings(parameters: Mapping[str, Any]) -> tuple[str, ...]:
    observer, rest = parameters["observer"], (parameters["feedforward"], parameters["instants"])
    if rest == ("printed", "all") and observer not in (Observer.PMI, Observer.SRC):
        # Other readings of DRC-PMI leave DRC-APO as it is.
        names = ("literal", *INTERPOLATED.values()) if observer == Observer.APO else (INTERPOLATED.get(observer, ""),)
        return tuple(name for name in names if name) or (NO_READING,)
    return (READINGS[rest],) if observer in COLUMNS else (NO_READING,)


def _compared(parameters: Mapping[str, Any]) -> tuple[str, ...]:
    """The reading under which one of two observers is that of DRC-PMI, and the error is that at the fast instants."""
    names = [INTERPOLATED[name] for name in (parameters["observer"], parameters["than"]) if name in INTERPOLATED]
    return tuple(f"estimate-{name}" for name in names or ["literal"])


def _setting(i: int, parameters: Mapping[str, Any]) -> dict[str, Any]:
    fixed = {name: value for name, value in parameters.items() if name != "frequencies"}
    return {**fixed, "frequency": parameters["frequencies"][min(i, len(parameters["frequencies"]) - 1)]}


def _bounds(i: int, known: Mapping[str, Any]) -> Found:
    error = known["errors"][min(i, len(known["errors"]) - 1)]
    return Found(lower=error.lower, upper=error.upper)


@on_paper(
    "dualrate.tracking-errors",
    parameters={
        "observer": OBSERVER,
        "feedforward": sized(one_of, COMMANDS),
        "instants": sized(one_of, INSTANTS),
        "frequencies": sized(several, positive, MOST),
    },
    witness={"errors": Depends(lambda case: sized(sequence, sized(read_error, case.plant), len(case.frequencies)))},
    says=tuple(
        Says(
            quantity="largest tracking error",
            setting=partial(_setting, i),
            readings=_readings,
            found=partial(_bounds, i),
        )
        for i in range(MOST)
    ),
)
def tracking_errors(
    plant: Loop, observer: Observer, feedforward: str, instants: str, frequencies: list[fmpq], errors: list[Error]
) -> Found:
    """With y_d = sin σt and the command <{command}|K x̂ + ȳ_d − K (y_d, y_d', y_d''), b ȳ_d = {input}>, held over
    {hold}, the largest tracking error of {observer.words}< of the plant {plant.name}|> {where} of the steady state is
    {sizes}.

    The error is Im(amplitude · e^{st}) with an amplitude of period M T. σ M T is rational and not zero, so no
    rational multiple of π: the phases at which an instant of the period is met are dense, and the supremum is the
    largest modulus of the amplitude.
    """
    for frequency, error in zip(frequencies, errors, strict=True):
        moving, begun = steady_motion(plant, observer, frequency, error.scales, feedforward)
        start = acb_mat([[row[error.phase]] for row in begun.tolist()])
        reached = error_at(moving, start, error.time)
        decide(less(error.lower / 100, reached, f"the error at the given time is not as large, σ = {frequency}"))
        if instants == "all":
            require_errors_below(moving, begun, plant.T, error.upper / 100)
        else:
            require(error.time == 0, "the given time is not that of a fast instant")
            most = largest([abs(gap) for gap in (moving.row * begun).entries()])
            decide(less(most, error.upper / 100, f"the largest error is above the bound, σ = {frequency}"))
    sizes = (
        f"{below(error.lower, 7)} to {above(error.upper, 7)} percent of the amplitude at σ = {frequency}"
        for frequency, error in zip(frequencies, errors, strict=True)
    )
    where = {"hold": held_over(observer), "where": INSTANTS[instants]}
    return Found(words={**COMMANDS[feedforward], **where, "sizes": ", ".join(sizes)})


@on_paper(
    "dualrate.estimates-ordered",
    parameters={"observer": OBSERVER, "than": OBSERVER, "frequency": positive},
    holds=True,
    says=(
        Says(quantity="better estimate", readings=_compared),
        Says(
            quantity="better estimate",
            setting=lambda parameters: {**parameters, "observer": parameters["than"], "than": parameters["observer"]},
            readings=_compared,
            found=lambda known: Found(holds=False),
        ),
    ),
)
def estimates_ordered(plant: Loop, observer: Observer, than: Observer, frequency: fmpq) -> Found:
    """With y_d = sin({frequency} t) and the command <as printed|K x̂ + ȳ_d − K (y_d, y_d', y_d''), b ȳ_d = y_d'' + a₂
    y_d' + a₃ y_d>, held over {hold}, the largest error of C x̂ at the fast instants in the steady state< of the plant
    {plant.name}|> is {sizes}.

    As for the tracking error, the supremum is the largest modulus of an amplitude, here over the M phases.
    """
    errors = [_estimation_error(plant, compared, frequency) for compared in (observer, than)]
    decide(less(errors[0], errors[1], f"the estimation errors are {errors[0].str(5)} and {errors[1].str(5)}"))
    sizes = (
        f"{below(100 * error.lower().fmpq(), 4)} to {above(100 * error.upper().fmpq(), 4)} percent of the amplitude in "
        f"{compared.words}"
        for error, compared in zip(errors, (observer, than), strict=True)
    )
    return Found(words={"hold": held_over(observer, than), "sizes": ", ".join(sizes)})


def _estimation_error(loop: Loop, observer: Observer, sigma: fmpq) -> arb:
    require_position_form(loop)
    decide(within(monodromy(loop, observer), "the eigenvalues of Φ"))
    passage, C = steady_passage(loop, observer, acb(0, arb(sigma))), arb_mat(loop.C)
    errors = (amplitudes(C * (x - used)) for x, used in zip(passage.states, passage.used, strict=True))
    return largest([abs(error) for (error,) in errors])

"""The closed loop of a delay plant and an observer of it, with true exponentials: its stability and its exact gain.

With the innovation eps, the errors follow [e'; z; eps] = M(s) [e; w] - I(s) eps, where M is the plant and I what the
innovation adds to the observer. If the observer takes other delays for granted than the plant has, the states of both
stay in the equations, and the plant has to be stable.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import wraps
from typing import ParamSpec, TypeVar

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.delay.exact.response import GainBracket, Response, gain_bracket, right_roots
from replication.estimation.delay.exact.terms import Kernel, PlantTerms, Terms, polynomial, projected, stacked
from replication.estimation.delay.general.lines import DelayObserver
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.validation import Array, as_array, positive_scalar

# A delay plant, and an observer of it, as matrix functions of s; field by field, apart from the synthesis


def plant_terms(plant: DelayPlant) -> PlantTerms:
    """(x', z, y) = M(s) (x, w) + N(s) u of a plant."""
    n, p, q, r, m = plant.states, plant.outputs, plant.measurements, plant.inputs, plant.known_inputs
    constant = np.block([[plant.a0, plant.b], [plant.c10, plant.d11], [plant.c2, plant.d21]])
    delayed, kernels, known = [], [], []
    for i in range(plant.delay_count):
        outputs = np.hstack([plant.c1[i], np.zeros((p, r))])
        measured = np.hstack([plant.c2_delayed[i], plant.d21_delayed[i]])
        delayed.append(np.vstack([np.hstack([plant.a[i], plant.b_delayed[i]]), outputs, measured]))
        kernels.append(_average((plant.a_spread[i], plant.c1_spread[i], plant.c2_spread[i]), r))
        known.append(np.vstack([plant.b_u_delayed[i], np.zeros((p + q, m))]))
    terms = Terms(constant, plant.delays, tuple(delayed), tuple(kernels))
    first = np.vstack([plant.b_u, np.zeros((p + q, m))])
    return PlantTerms((n, p, q, r), terms, Terms(first, plant.delays, tuple(known), (None,) * plant.delay_count))


def _average(weights: Sequence[Array], r: int) -> Kernel | None:
    """The kernel whose rows are the given sums of powers of the lag, (k, rows, n) each; None for zero."""
    if not any(np.any(part) for part in weights):
        return None
    count = max(len(part) for part in weights)
    padded = [np.pad(part, ((0, count - len(part)), (0, 0), (0, r))) for part in weights]
    powers, exponents = np.concatenate(padded, axis=1), np.arange(count)
    return polynomial(projected(lambda lags: np.tensordot(lags[:, None] ** exponents, powers, axes=1), count - 1))


def injection_terms(observer: DelayObserver) -> Terms:
    """What the innovation adds to the observer's (x', z, y): gains and, for each line, its kernel over the lags.

    The far end of line i adds tau L(lag - 1); its moment c adds tau times the integral of p_c(s) L(s + lag) over
    -1 <= s <= -lag.
    """
    form = observer.form
    q = form.measurements
    constant = np.vstack([observer.l0, observer.lz, np.zeros((q, q))])
    kernels = []
    for i, line in enumerate(form.lines):
        count = len(line.moments)
        degree = len(observer.kernels[i]) + count

        def values(lags: Array, i: int = i, count: int = count) -> Array:
            line = form.lines[i]
            total = np.einsum("am,tmq->taq", line.end, observer.kernel(i, lags - 1.0))
            if count:
                nodes, weights = legendre.gauss(len(observer.kernels[i]) + count + 1)
                for t, lag in enumerate(lags):
                    points = -1.0 + (1.0 - lag) * (nodes + 1.0)
                    basis = legendre.evaluate(count, points) * (weights * (1.0 - lag))[:, None]
                    gains = observer.kernel(i, points + lag)
                    total[t] += np.einsum("cam,tc,tmq->aq", line.moments, basis, gains)
            return np.asarray(line.delay * total)

        kernels.append(polynomial(projected(values, degree)))
    delays = tuple(line.delay for line in form.lines)
    return Terms(constant, delays, tuple(np.zeros_like(constant) for _ in delays), tuple(kernels))


def no_injection(plant: PlantTerms) -> Terms:
    """That of the estimate zero."""
    return Terms(np.zeros((len(plant.terms.constant), plant.sizes[2])))


P = ParamSpec("P")
T = TypeVar("T")


def decided(door: Callable[P, T]) -> Callable[P, T]:
    """`door`, with SolverError where a matrix in it is singular to rounding: no number comes of that."""

    @wraps(door)
    def refusing(*given: P.args, **more: P.kwargs) -> T:
        try:
            return door(*given, **more)
        except np.linalg.LinAlgError as error:
            raise SolverError(
                f"rounding decides ({error}): a root of the plant lies on the imaginary axis where nothing moves it or "
                "shows it, or its numbers lie too far apart; disturb and measure that mode, or choose other units"
            ) from None

    return refusing


@decided
def exact_gain(observer: DelayObserver, relative: float = 1e-6) -> GainBracket:
    """The L2 gain from w to the error of z, delays and kernels exact.

    Parameters
    ----------
    observer : DelayObserver
        What a synthesis gave.
    relative : float
        Relative width of the bracket that is asked for.

    Returns
    -------
    GainBracket
        Both ends, in floating point; the error system is stable.

    Raises
    ------
    InvalidInputError
        `relative` is not positive.
    InfeasibleError
        The error does not die out.
    SolverError
        A root of the error lies on the imaginary axis, or so near that stability stays open.
    """
    positive_scalar("relative", relative)
    return gain_bracket(error_response(plant_terms(observer.plant), injection_terms(observer)), relative)


@decided
def worst_gain(
    observer: DelayObserver, ranges: Sequence[tuple[float, float]] | None = None, relative: float = 1e-3
) -> GainBracket:
    """The largest gain of an observer while the delays of the plant, constant and unknown, lie anywhere in ranges.

    Parameters
    ----------
    observer : DelayObserver
        Made for the nominal delays, which it keeps.
    ranges : sequence of K pairs of floats, optional
        Shortest and longest delay, s; those of the plant unless given.
    relative : float
        Relative width of the bracket that is asked for.

    Returns
    -------
    GainBracket
        The upper end holds for all delays of the ranges, in floating point; the lower end is attained at the delays
        that it names. The upper end is infinite where stability over the ranges stays open.

    Raises
    ------
    InvalidInputError
        `relative` is not positive, or the ranges are no pairs of positive, ordered delays.
    InfeasibleError
        The plant is unstable: with the least error in a delay the estimate does not follow it.
    SolverError
        Stability at the nominal delays stays open, or the plant has a root on the axis, to rounding.

    Notes
    -----
    The ranges and the frequencies are cut into cells. On each the response is its value and slope at the centre, plus a
    remainder that is bounded. An observer that is stable at the nominal delays, and has no root on the axis in any
    cell, is stable for all delays of the ranges.
    """
    plant = plant_terms(observer.plant)
    positive_scalar("relative", relative)
    given = observer.plant.ranges if ranges is None else ranges
    ends = as_array("ranges", given, (len(plant.terms.delays), 2), axes="(delays, 2)")
    if np.any(ends[:, 0] <= 0.0) or np.any(ends[:, 0] > ends[:, 1]):
        raise InvalidInputError(f"ranges must be pairs (shortest, longest) of positive delays, got {ends.tolist()}")
    roots = decided(right_roots)(error_response(plant, no_injection(plant)))[1]
    if roots:
        raise InfeasibleError(
            f"the plant has {roots} unstable roots: with an error in a delay, however small, no estimate follows it; "
            "stabilise the plant, or measure the delays"
        )
    middle = [float(value) for value in ends.mean(axis=1)]
    pairs = [(float(low), float(high)) for low, high in ends]
    response = mismatched_response(plant, injection_terms(observer), middle, pairs)
    found = decided(gain_bracket)(response, relative)
    return replace(found, delays=found.delays[: len(pairs)])


def error_response(plant: PlantTerms, injection: Terms) -> Response:
    """From w to the error of z, for an observer of the plant itself; signals e, eps, z, w."""
    n, p, q, r = plant.sizes
    rows, e, eps, z, w = _places(n, q, p, r)
    # Rows (x', z, y) of the plant go to those of e, z and eps.
    to = np.hstack([rows[e].T, rows[z].T, rows[eps].T])
    loop = stacked(
        [(plant.terms, -to, np.vstack([rows[e], rows[w]])), (injection, to, rows[eps])],
        np.zeros((n + q + p + r,) * 2),
    )
    ranges = tuple((delay, delay) for delay in loop.delays)
    return Response(loop, (n, p, r), _direct(plant, injection), ranges)


def mismatched_response(
    assumed: PlantTerms, injection: Terms, true: Sequence[float], ranges: Sequence[tuple[float, float]]
) -> Response:
    """From w to the error of z of an observer that takes the delays of `assumed` for granted; signals x, x^, eps, z, w.

    The plant has the delays `true`, or any others of their `ranges`.
    """
    n, p, q, r = assumed.sizes
    rows, x, guess, eps, z, w = _places(n, n, q, p, r)
    plant_to = np.hstack([rows[x].T, rows[z].T, rows[eps].T])
    copy_to = np.hstack([rows[guess].T, -rows[z].T, -rows[eps].T])
    nothing = np.zeros((r, plant_to.shape[0]))
    loop = stacked(
        [
            (replace(assumed.terms, delays=tuple(true)), -plant_to, np.vstack([rows[x], rows[w]])),
            (assumed.terms, -copy_to, np.vstack([rows[guess], nothing])),
            (injection, -copy_to, rows[eps]),
        ],
        np.zeros((2 * n + q + p + r,) * 2),
    )
    fixed = ((delay, delay) for delay in loop.delays[len(true) :])
    return Response(loop, (2 * n, p, r), _direct(assumed, injection), (*ranges, *fixed))


def _places(*sizes: int) -> tuple[Array, ...]:
    """The identity and, for each signal, its rows."""
    eye = np.eye(sum(sizes))
    stops = np.cumsum(sizes)
    return eye, *(np.arange(stop - size, stop) for size, stop in zip(sizes, stops, strict=True))


def _direct(plant: PlantTerms, injection: Terms) -> Terms:
    """D_z w - L_z D_y w at frequencies beyond all dynamics, L_z what the innovation adds to z at once."""
    _, estimated, measured = plant.rows
    noise = plant.columns[1]
    rows, columns = np.eye(len(plant.terms.constant)), np.eye(plant.terms.constant.shape[1])
    left = rows[estimated] - injection.constant[estimated] @ rows[measured]
    return plant.terms.without_kernels().applied(left, columns[:, noise])

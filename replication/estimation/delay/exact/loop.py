"""The closed loop of a delay plant and an observer of it, with true exponentials: its stability and its exact gain.

With the innovation eps, the errors follow [e'; z; eps] = M(s) [e; w] - I(s) eps, where M is the plant and I what the
innovation adds to the observer. With other delays than it takes for granted the states of both stay.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import wraps
from itertools import repeat
from typing import ParamSpec, TypeVar

import numpy as np

from replication.errors import SolverError
from replication.estimation.delay.exact.response import Response
from replication.estimation.delay.exact.terms import Kernel, PlantTerms, Terms, projected, stacked
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.validation import Array

# A delay plant as matrix functions of s; field by field, apart from the synthesis


def plant_terms(plant: DelayPlant) -> PlantTerms:
    """(x', z, y) = M(s) (x, w) + N(s) u of a plant."""
    n, p, q, r, m = plant.states, plant.outputs, plant.measurements, plant.inputs, plant.known_inputs

    def driven(b_u: Array) -> Array:
        return np.vstack([b_u, np.zeros((p + q, m))])

    present = np.block([[plant.a0, plant.b], [plant.c10, plant.d11], [plant.c2, plant.d21]])
    states = zip(plant.a, plant.b_delayed, plant.c1, plant.c2_delayed, plant.d21_delayed, strict=True)
    late = tuple(np.block([[a, b], [c1, np.zeros((p, r))], [c2, d2]]) for a, b, c1, c2, d2 in states)
    kernels = tuple(map(_average, zip(plant.a_spread, plant.c1_spread, plant.c2_spread, strict=True), repeat(r)))
    known = Terms(driven(plant.b_u), plant.delays, tuple(map(driven, plant.b_u_delayed)), (None,) * len(late))
    return PlantTerms((n, p, q, r), Terms(present, plant.delays, late, kernels), known)


def _average(parts: tuple[Array, ...], inputs: int) -> Kernel | None:
    """The kernel of a mean from what multiplies powers of the lag in x', z and y, each (k, rows, n); None for zero."""
    count = max(map(len, parts))
    powers = np.concatenate([np.pad(part, ((0, count - len(part)), (0, 0), (0, inputs))) for part in parts], axis=1)
    if not np.any(powers):
        return None
    return Kernel(projected(lambda lags: np.tensordot(lags[:, None] ** np.arange(count), powers, axes=1), count - 1))


P = ParamSpec("P")
T = TypeVar("T")


def decided(door: Callable[P, T]) -> Callable[P, T]:
    """`door`, with SolverError where a matrix in it is singular to rounding: no number comes of that."""

    @wraps(door)
    def refusing(*args: P.args, **named: P.kwargs) -> T:
        try:
            return door(*args, **named)
        except np.linalg.LinAlgError as error:
            raise SolverError(
                f"rounding decides ({error}): a root of the plant lies on the imaginary axis where nothing moves it or "
                "shows it, or its numbers lie too far apart; disturb and measure that mode, or choose other units"
            ) from None

    return refusing


def error_response(plant: PlantTerms, injection: Terms | None = None) -> Response:
    """From w to the error of z, for an observer of the plant itself, or the estimate zero; signals e, eps, z, w."""
    n, p, q, r = plant.sizes
    injection = Terms(np.zeros((len(plant.terms.constant), q))) if injection is None else injection
    rows, e, eps, z, w = _places(n, q, p, r)
    # Rows (x', z, y) of the plant go to those of e, z and eps.
    to = np.hstack([rows[e].T, rows[z].T, rows[eps].T])
    loop = stacked(
        [(plant.terms, -to, np.vstack([rows[e], rows[w]])), (injection, to, rows[eps])], np.zeros((n + q + p + r,) * 2)
    )
    ranges = tuple((delay, delay) for delay in loop.delays)
    return Response(loop, (n, p, r), _direct(plant, injection), ranges)


def mismatched_response(
    assumed: PlantTerms, injection: Terms, true: Sequence[float], ranges: Sequence[tuple[float, float]]
) -> Response:
    """From w to the error of z where the delays are not those that are `assumed`; signals x, x^, eps, z, w."""
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

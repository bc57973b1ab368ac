"""Disturbances that bound a gain from below: the worst one for given gains, and those that no sensor shows."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg

from replication.certify.rounding import rounded_array
from replication.errors import SolverError
from replication.estimation.linear.periodic import PeriodicSystem, Stage, frequency_response
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array, ComplexArray

BITS = 24
"""Of the entries of a disturbance of norm one: its ratio is off by the square of that."""
TURN_BITS = 20
NEAR = 1e-7
"""How near to the optimum, relatively, a disturbance of finite length must come."""
MOST_PERIODS = 60


class Turn(NamedTuple):
    """A rational point of the unit circle: the angle per period, and the rational rotation (or 1, or -1)."""

    angle: float
    matrix: list[list[str]]


def rational_turn(angle: float) -> Turn:
    """The rotation by about `angle` in [0, pi] with entries (1 - t^2, 2t) / (1 + t^2), t = tan(angle/2) rounded."""
    if np.sin(angle) < 2.0**-TURN_BITS:
        return Turn(0.0, [["1"]]) if angle < 1 else Turn(np.pi, [["-1"]])
    t = Fraction(round(np.tan(angle / 2) * 2**TURN_BITS), 2**TURN_BITS)
    c, s = (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)
    return Turn(float(2 * np.arctan(float(t))), [[str(c), str(s)], [str(-s), str(c)]])


def peak_disturbance(system: PeriodicSystem, angle: float) -> tuple[list[list[str]], list[Any]]:
    """The turn per period and the inputs v_k (m, r) of the largest singular value of the lifted response there."""
    turn = rational_turn(angle)
    response = frequency_response(system.lift(), turn.angle)
    right = np.linalg.svd(response)[2][0].conj()
    return turn.matrix, _phases(right, [stage.B.shape[1] for stage in system.stages], turn)


def unseen_forever(problem: MultirateProblem, angle: float) -> tuple[list[list[str]], list[Any]]:
    """The turn per period and the d_k (m_d, r) that disturb z most, sensor noise that hides them counted in.

    That noise is w_k = -D_k^+ C_k x_k; a generalised eigenvector of outputs against disturbances.
    """
    turn = rational_turn(angle)
    plant, N = problem.plant, problem.schedule.period
    hidden = [-np.linalg.pinv(plant.D[rows]) @ plant.C[rows] for rows in problem.measured_rows()]
    zero = np.zeros((plant.W.shape[0], plant.B_d.shape[1]))
    states = PeriodicSystem(tuple(Stage(plant.A, plant.B_d, plant.W, zero) for _ in range(N)))
    noises = PeriodicSystem(tuple(Stage(plant.A, plant.B_d, H, np.zeros((len(H), plant.B_d.shape[1]))) for H in hidden))
    T_x, T_w = (frequency_response(system.lift(), turn.angle) for system in (states, noises))
    largest = _largest(T_x.conj().T @ T_x, np.eye(T_w.shape[1]) + T_w.conj().T @ T_w)
    return turn.matrix, _phases(largest, [plant.B_d.shape[1]] * N, turn)


def unseen_for_long(problem: MultirateProblem, level: float) -> tuple[int, list[Any], float]:
    """Phase at the start, d_k (m_d, 1) and ratio of a disturbance that no measurement shows until its end.

    Horizons grow until the ratio is within NEAR of `level`; all phases at the start are tried. Raises SolverError if
    MOST_PERIODS do not do.
    """
    N = problem.schedule.period
    for length in range(N, MOST_PERIODS * N, N):
        found = [(*_best_of_length(problem, start, length), start) for start in range(N)]
        ratio, d, start = max(found, key=lambda candidate: candidate[0])
        if ratio >= level * (1 - NEAR):
            return start, rounded_array(d[:, :, None], BITS), ratio
    raise SolverError(f"no disturbance of {MOST_PERIODS} periods comes within {NEAR:g} of the level {level!r}")


def _best_of_length(problem: MultirateProblem, start: int, length: int) -> tuple[float, Array]:
    """The largest ratio of z(1) .. z(T) to d, w at 0 .. T - 1 without a measurement, and its d (T, m_d)."""
    plant, rows = problem.plant, problem.measured_rows()
    m = plant.B_d.shape[1]
    state = np.zeros((plant.order, length * m))
    outputs, noises = [], [np.eye(length * m)]
    for k in range(length):
        measured = rows[(start + k) % len(rows)]
        noises.append(np.linalg.pinv(plant.D[measured]) @ plant.C[measured] @ state)
        state = plant.A @ state
        state[:, k * m : (k + 1) * m] += plant.B_d
        outputs.append(plant.W @ state)
    Z, V = np.vstack(outputs), np.vstack(noises)
    d = np.real(_largest(Z.T @ Z, V.T @ V))
    return float(np.linalg.norm(Z @ d) / np.linalg.norm(V @ d)), d.reshape(length, m)


def _largest(first: ComplexArray | Array, second: ComplexArray | Array) -> ComplexArray:
    """The eigenvector, of norm one, of the largest eigenvalue of a pair of Hermitian matrices."""
    vector = scipy.linalg.eigh(first, second, subset_by_index=[len(first) - 1] * 2)[1][:, 0]
    return np.asarray(vector / np.linalg.norm(vector))


def _phases(vector: ComplexArray, sizes: list[int], turn: Turn) -> list[Any]:
    """A complex signal over one period as v_k (m, r): its parts beside each other, or the real part alone if it is all.

    z v with z = e^{j angle} is then v turned by the matrix of `turn`.
    """
    vector = vector * np.exp(-1j * np.angle(vector[np.argmax(np.abs(vector))]))
    columns = [vector.real, vector.imag][: len(turn.matrix)]
    return [rounded_array(np.stack(part, axis=1), BITS) for part in _split(columns, sizes)]


def _split(columns: list[Array], sizes: list[int]) -> list[list[Array]]:
    return [list(parts) for parts in zip(*(np.split(c, np.cumsum(sizes)[:-1]) for c in columns), strict=True)]

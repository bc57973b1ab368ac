"""Certificates of dual-rate loops: eigenvalues over a slow period, times of largest error, Lyapunov matrices."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.linalg
from flint import fmpq, fmpq_mat

from replication.certify import as_floats, bracket, exact, rounded, rounded_array, rounded_down
from replication.estimation.dualrate.loop import (
    DualRateLoop,
    Points,
    fast_errors,
    monodromy,
    reference,
    tracking_error_peak,
)
from replication.verify.algebra.linear import block, zeros

MARGIN = 2e-7
"""Relative distance of a bound to the number found in floating point."""
LEVEL_BITS, ROOT_BITS, TIME_BITS, VECTOR_BITS = 40, 60, 50, 40


def spectral_radius(loop: DualRateLoop) -> dict[str, Any]:
    """Both bounds of the spectral radius over one slow period, and the eigenvalue that attains it."""
    root = _largest_eigenvalue(loop)
    return {"bound": _around(abs(root)), "witness": {"root": _pair(root)}}


def stable(loop: DualRateLoop) -> dict[str, Any]:
    """A radius below one that holds all eigenvalues."""
    return {"bound": {}, "witness": {"radius": _around(abs(_largest_eigenvalue(loop)))["upper"]}}


def excited(loop: DualRateLoop) -> dict[str, Any]:
    """The eigenvalue outside the unit circle that the reference excites."""
    return {"bound": {}, "witness": {"root": _pair(_largest_eigenvalue(loop))}}


def tracking_error(loop: DualRateLoop, points: Points) -> dict[str, Any]:
    """Both bounds of the largest steady-state error in percent, where it is met, weights that balance the motion."""
    if points is Points.BETWEEN:
        ratio, time = tracking_error_peak(loop)
        phase = min(int(time // loop.design.period), loop.design.ratio - 1)
        after = rounded_down(max(0.0, time - phase * loop.design.period), TIME_BITS)
    else:
        sizes = fast_errors(loop)
        phase, after = int(np.argmax(sizes)), "0"
        ratio = float(sizes[phase])
    return {**_around(100 * ratio), "phase": phase, "time": after, "scales": _weights(loop)}


def lyapunov_solution(plant: Mapping[str, Any]) -> list[list[str]]:
    """The exact P of ÃᵀP + P Ã = −I for the loop of a certificate."""
    A, B, C, K, L = (exact(plant[name]) for name in "ABCKL")
    joint = block([[A + B * K, -(B * K)], [zeros(A.nrows(), A.nrows()), A - L * C]])
    size = joint.nrows()
    equations = fmpq_mat(size**2, size**2)
    for i in range(size):
        for j in range(size):
            for k in range(size):
                equations[i * size + j, k * size + j] += joint[k, i]
                equations[i * size + j, i * size + k] += joint[k, j]
    constant = fmpq_mat(size**2, 1, [-int(i == j) for i in range(size) for j in range(size)])
    solution = equations.solve(constant)
    return [[str(solution[i * size + j, 0]) for j in range(size)] for i in range(size)]


def lyapunov(plant: Mapping[str, Any]) -> dict[str, Any]:
    """P with a lower bound of its smallest and an upper bound of its largest eigenvalue, and vectors near those."""
    P = lyapunov_solution(plant)
    values, vectors = np.linalg.eigh(as_floats(P))
    return {
        "P": P,
        "low": _around(float(values[0]))["lower"],
        "high": _around(float(values[-1]))["upper"],
        "least": rounded_array(vectors[:, :1], VECTOR_BITS),
        "most": rounded_array(vectors[:, -1:], VECTOR_BITS),
    }


def worst_error(plant: Mapping[str, Any]) -> list[list[str]]:
    """χ = (x, ξ) with the largest |C ξ| for its V = χᵀP χ: P⁻¹ (0, Cᵀ), of length one."""
    P, C = as_floats(lyapunov_solution(plant)), as_floats(plant["C"])
    chi = np.linalg.solve(P, np.hstack([0 * C, C]).T)
    vector: list[list[str]] = rounded_array(chi / np.linalg.norm(chi), VECTOR_BITS)
    return vector


def _largest_eigenvalue(loop: DualRateLoop) -> complex:
    values = np.linalg.eigvals(monodromy(loop)).astype(complex)
    # Of a pair, the one with a positive imaginary part.
    return complex(max(values, key=lambda value: (round(abs(value), 12), value.imag)))


def _pair(value: complex) -> list[str]:
    return [rounded(value.real, ROOT_BITS), rounded(value.imag, ROOT_BITS)]


def _around(value: float) -> dict[str, str]:
    return bracket(value, value, MARGIN, LEVEL_BITS)


def _weights(loop: DualRateLoop) -> list[str]:
    """Powers of two for (x, u, w), between which x' = A x + B u and w' = σ w are balanced."""
    n, plant = loop.plant.order, loop.plant
    motion = np.zeros((n + 2, n + 2))
    motion[:n, :n], motion[:n, n], motion[-1, -1] = plant.A, plant.B_u[:, 0], reference(loop).frequency
    weights = scipy.linalg.matrix_balance(motion, permute=False, separate=True)[1][0]
    return [str(fmpq(*float(weight).as_integer_ratio())) for weight in weights]

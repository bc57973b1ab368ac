"""The non-causal bound: what no estimator beats, not even a smoother that knows all measurements, past and future."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from replication.estimation.linear.lifted import LiftedResponse, compressed, largest_singular_value
from replication.estimation.linear.norms import DENSE_INPUTS, GainBracket, peak_on_circle, slowest_angle, spectral_norm
from replication.estimation.linear.periodic import PeriodicSystem, Stage, frequency_response
from replication.estimation.linear.riccati import RiccatiMap, recentre
from replication.estimation.multirate.kalman import kalman_centre, state_scales, state_units
from replication.estimation.multirate.problem import MultirateProblem, require_problem
from replication.estimation.multirate.scaled import ScaledProblem, scaled_problem
from replication.estimation.validation import Array, ComplexArray

NOISE = 1.0
"""Process noise, in state units, of the filter whose innovations stand for the measurements: any stable one does."""
ROUNDING = 1e-13
"""A gain below this share of the error system's own is rounding: it counts as zero."""


def noncausal_bound(problem: MultirateProblem) -> GainBracket:
    """sup over frequency of the best gain of any estimator that knows all measurements, past and future.

    With T_x from d to W x and T_y from d to the whitened measurements it is sqrt(lambda_max(T_x*T_x, I + T_y*T_y)).
    Evaluated on a stabilised error system instead, so that unstable plants and poles on the circle do no harm: with
    E from (d, w) to W e and V to the innovations, it is the norm of E on the kernel of V. Where the period is long the
    system is that of the Kalman filter, whose V has orthonormal rows, and no matrix is formed; raises as
    `kalman_design` then.
    """
    require_problem(problem)
    return bound_in(problem, state_units(problem))


def bound_in(problem: MultirateProblem, units: Array) -> GainBracket:
    """`noncausal_bound`, where the `state_units` of the problem are known."""
    inputs = sum(problem.plant.B_d.shape[1] + len(rows) for rows in problem.measured_rows())
    if inputs <= DENSE_INPUTS:
        scaled = scaled_problem(problem, state_scales(problem, units, NOISE))
        # In these coordinates the covariance of the filter is the identity at every phase.
        reference = np.stack([np.eye(problem.plant.order)] * problem.schedule.period)
        errors, innovations = _filter(scaled, scaled.corrected(reference, scaled.maps()))
        value = _dense(errors, innovations)
    else:
        centre = kalman_centre(problem)
        scaled, reference = centre.scaled, centre.states
        errors, innovations = _filter(scaled, scaled.corrected(reference, scaled.maps()))
        value = _by_operators(errors, _whitened(innovations, reference))

    def maps(level: float) -> RiccatiMap:
        return recentre(scaled.maps(level), reference)

    return peak_on_circle(value, maps, slowest_angle(errors.monodromy()))


def _filter(scaled: ScaledProblem, corrected: Array) -> tuple[PeriodicSystem, PeriodicSystem]:
    """The systems from (d, whitened w) to W e and to the innovations C_k e + w."""
    closed, gains = scaled.closed_loop(corrected), scaled.whitened_gains(corrected)
    errors, innovations = [], []
    for A, B, W, C, L in zip(closed, scaled.B, scaled.W, scaled.C, gains, strict=True):
        drive = np.hstack([B, -L])
        noise = np.hstack([np.zeros((len(C), B.shape[1])), np.eye(len(C))])
        errors.append(Stage(A, drive, W, np.zeros((len(W), drive.shape[1]))))
        innovations.append(Stage(A, drive, C, noise))
    return PeriodicSystem(tuple(errors)), PeriodicSystem(tuple(innovations))


def _dense(errors: PeriodicSystem, innovations: PeriodicSystem) -> Callable[[float], float]:
    """The norm of E on the kernel of V, both formed in full, as a function of the angle."""
    lifted_errors, lifted_innovations = compressed(errors.lift()), innovations.lift()

    def value(angle: float) -> float:
        E, V = frequency_response(lifted_errors, angle), frequency_response(lifted_innovations, angle)
        seen = np.linalg.qr(V.conj().T).Q
        found = spectral_norm(E - (E @ seen) @ seen.conj().T)
        return found if found > ROUNDING * float(np.linalg.norm(E)) else 0.0

    return value


def _whitened(innovations: PeriodicSystem, covariance: Array) -> PeriodicSystem:
    """The innovations of the Kalman filter in units of their covariance I + C_k X_k C_k': white, so V V* = I."""
    stages = []
    for stage, X in zip(innovations.stages, covariance, strict=True):
        root = np.linalg.cholesky(np.eye(len(stage.C)) + stage.C @ X @ stage.C.T)
        C, D = (np.asarray(np.linalg.solve(root, M), dtype=float) for M in (stage.C, stage.D))
        stages.append(Stage(stage.A, stage.B, C, D))
    return PeriodicSystem(tuple(stages))


def _by_operators(errors: PeriodicSystem, white: PeriodicSystem) -> Callable[[float], float]:
    """The norm of E (I - V*V), which is that on the kernel of V if V V* = I, as a function of the angle."""
    error_response, white_response = LiftedResponse(errors), LiftedResponse(white)
    size = error_response.inputs

    def value(angle: float) -> float:
        (E, E_adjoint), (V, V_adjoint) = error_response.at(angle), white_response.at(angle)

        def unseen(v: ComplexArray) -> ComplexArray:
            return v - V_adjoint(V(v))

        own = largest_singular_value(lambda v: E_adjoint(E(v)), size)
        return largest_singular_value(lambda v: unseen(E_adjoint(E(unseen(v)))), size, floor=ROUNDING * own)

    return value

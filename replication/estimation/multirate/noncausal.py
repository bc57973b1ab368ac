"""The non-causal bound: what no estimator beats, not even a smoother that knows all measurements, past and future."""

from __future__ import annotations

import numpy as np

from replication.estimation.multirate.kalman import state_scales
from replication.estimation.multirate.problem import MultirateProblem, require_problem
from replication.estimation.multirate.scaled import ScaledProblem, scaled_problem
from replication.estimation.norms import GainBracket, compressed, peak_on_circle, slowest_angle, spectral_norm
from replication.estimation.periodic import PeriodicSystem, Stage, frequency_response
from replication.estimation.riccati import RiccatiMap, recentre
from replication.estimation.validation import Array

NOISE = 1.0
"""Process noise, in state units, of the filter whose innovations stand for the measurements: any stable one does."""
ROUNDING = 1e-13
"""A gain below this share of the error system's own is rounding: it counts as zero."""


def noncausal_bound(problem: MultirateProblem) -> GainBracket:
    """sup over frequency of the best gain of any estimator that knows all measurements, past and future.

    With T_x from d to W x and T_y from d to the whitened measurements it is sqrt(lambda_max(T_x*T_x, I + T_y*T_y)).
    Evaluated on a stabilised error system instead, so that unstable plants and poles on the circle do no harm: with
    E from (d, w) to W e and V to the innovations, it is the norm of E on the kernel of V.
    """
    require_problem(problem)
    scaled = scaled_problem(problem, state_scales(problem, NOISE))
    # In these coordinates the covariance of the filter is the identity at every phase.
    reference = np.broadcast_to(np.eye(problem.plant.order), scaled.A.shape)
    corrected = scaled.corrected(reference, scaled.maps())
    errors, innovations = _lifted(scaled, corrected)

    def value(angle: float) -> float:
        E, V = frequency_response(errors, angle), frequency_response(innovations, angle)
        seen = np.linalg.qr(V.conj().T).Q
        found = spectral_norm(E - (E @ seen) @ seen.conj().T)
        return found if found > ROUNDING * float(np.linalg.norm(E)) else 0.0

    def maps(level: float) -> list[RiccatiMap]:
        return recentre(scaled.maps(level), list(reference))

    return peak_on_circle(value, maps, slowest_angle(errors.A))


def _lifted(scaled: ScaledProblem, corrected: Array) -> tuple[Stage, Stage]:
    """The lifted systems from (d, whitened w) to W e and to the whitened innovations C_k e + w."""
    closed, gains = scaled.closed_loop(corrected), scaled.whitened_gains(corrected)
    errors, innovations = [], []
    for A, B, W, C, L in zip(closed, scaled.B, scaled.W, scaled.C, gains, strict=True):
        drive = np.hstack([B, -L])
        noise = np.hstack([np.zeros((len(C), B.shape[1])), np.eye(len(C))])
        errors.append(Stage(A, drive, W, np.zeros((len(W), drive.shape[1]))))
        innovations.append(Stage(A, drive, C, noise))
    return compressed(PeriodicSystem(tuple(errors)).lift()), PeriodicSystem(tuple(innovations)).lift()

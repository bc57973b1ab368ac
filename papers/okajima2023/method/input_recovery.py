"""Section IV-C: which B_d and D may stand behind the gains printed in eq. (42), given A and C.

Gains that solve Theorem 2 achieve nearly the smallest possible level, so the excess of their exact norm over the exact
optimum ranks the candidates (B_d, D). The winner is checked by a computation that shares no code with that: how near
the printed gains come to the central path of the matrix inequality, which interior-point solvers follow.
Only the ratio of B_d to D matters and the sign of B_d does not: D[0][0] = 1 is a choice. No random numbers.
"""

import itertools
from operator import itemgetter
from typing import Any

import numpy as np
import numpy.typing as npt

from papers.okajima2023.method.central_path import central_path
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import frequency_response
from replication.estimation.linear.riccati import RiccatiMap, compose, down, tree
from replication.estimation.multirate.optimum import optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array

Json = dict[str, Any]
Matrix = list[list[float]]

STEP = 0.5
"""Step of the entries of B_d that are tried."""
RATIOS = (0.5, 1.0, 2.0)
"""Noise of each further sensor relative to the first that is tried."""
ANGLES = (0.0, 1.0, np.pi)
"""Lifted frequencies, radians per period, of the cheap lower bound of the norm of the printed gains."""
FIRST_CUT = 0.01
DOUBLINGS = 12
"""Of the period map: 4096 periods."""
ESCAPE, ROUNDING = 1e100, 1e-9
PATH_FACTOR = 1.05
PATH_END = 1e-4
"""Gap at the end of the central path, relative to the square of the optimum."""


def recover_inputs(
    A: Matrix, C: Matrix, printed_gains: list[Matrix], schedule: SensingSchedule, bound: float = 3.0
) -> Json:
    """Find the (B_d, D) for which the printed gains (N, n, q) exceed the optimum least, and the centre nearest to them.

    Tried: B_d (n, 1) with entries in halves up to `bound`, one of each +-B_d, and diagonal D with D[0][0] = 1 and
    RATIOS for the others. Excesses are relative (norm / optimum - 1). largest_gain_difference: that of an entry of the
    printed gains from those of the centre where it is least.
    """
    gains = np.array(printed_gains)
    values = STEP * np.arange(-round(bound / STEP), round(bound / STEP) + 1)
    directions = [b for b in itertools.product(values, repeat=len(A)) if b > (0.0,) * len(A)]
    noises = [(1.0, *ratios) for ratios in itertools.product(RATIOS, repeat=len(C) - 1)]
    B_d, D = (np.array(entries) for entries in zip(*itertools.product(directions, noises), strict=True))
    (best, problem), (second, _) = _least_excess(np.array(A), np.array(C), schedule, gains, B_d, D)
    points = central_path(problem, gains, gap=PATH_END * optimum(problem).value ** 2, factor=PATH_FACTOR)
    return {
        "tried": len(B_d),
        "best_excess": best,
        "second_excess": second,
        "B_d": problem.plant.B_d.tolist(),
        "D": problem.plant.D.tolist(),
        "largest_gain_difference": min(float(np.max(np.abs(point.gains - gains))) for point in points),
    }


def _least_excess(
    A: Array, C: Array, schedule: SensingSchedule, gains: Array, B_d: Array, D: Array
) -> list[tuple[float, MultirateProblem]]:
    """The two candidates with the smallest excess, of B_d (m, n) and diagonals of D (m, q).

    A candidate is dropped without its exact optimum if a level below the attained norm by more than a cut is
    achievable. The cut grows until it is above the second excess found, so no candidate below that was dropped.
    """
    attained, cut = _attained(A, C, schedule, gains, B_d, D), FIRST_CUT
    while True:
        candidates = []
        for i in np.flatnonzero(~_achievable(A, C, schedule, B_d, D, attained / (1 + cut))):
            plant = MultiratePlant(A=A, B_d=B_d[i][:, None], C=C, D=np.diag(D[i]))
            problem = MultirateProblem(plant, schedule)
            candidates.append((l2_gain(problem.error_system(gains)).value / optimum(problem).value - 1, problem))
        candidates.sort(key=itemgetter(0))
        if len(candidates) > 1 and candidates[1][0] <= cut:
            return candidates[:2]
        cut *= 4


def _attained(A: Array, C: Array, schedule: SensingSchedule, gains: Array, B_d: Array, D: Array) -> Array:
    """Lower bounds (m,) of the norms of the printed gains: largest singular values at ANGLES.

    The error system is that of unit disturbances of every state and sensor, its inputs weighted for each candidate.
    """
    n, q = C.T.shape
    system = MultirateProblem(MultiratePlant(A=A, B_d=np.eye(n), C=C, D=np.eye(q)), schedule).error_system(gains)
    weights = np.zeros((len(B_d), n + q, n + q))
    weights[:, :n, :n] = B_d[:, :, None] * B_d[:, None, :]
    weights[:, range(n, n + q), range(n, n + q)] = D**2
    # Inputs of a stage: one per state, then one per sensor; without measurement, no sensor noise.
    widths, level = [stage.B.shape[1] for stage in system.stages], np.zeros(len(B_d))
    for angle in ANGLES:
        parts = np.split(frequency_response(system.lift(), angle), np.cumsum(widths)[:-1], axis=1)
        squares = sum(
            part @ weights[:, :width, :width] @ part.conj().T for part, width in zip(parts, widths, strict=True)
        )
        level = np.maximum(level, np.sqrt(np.linalg.eigvalsh(squares)[:, -1]))
    return level


def _achievable(
    A: Array, C: Array, schedule: SensingSchedule, B_d: Array, D: Array, level: Array
) -> npt.NDArray[np.bool_]:
    """Whether a stabilising X_k >= 0 with X_k < level^2 I was found (W = I), per candidate; False may be in doubt."""
    information = np.einsum("kq,qi,mq,qj->kmij", schedule.mask, C, D**-2.0, C)
    G = information - np.eye(len(A)) / level[:, None, None] ** 2
    H = np.broadcast_to(B_d[:, :, None] * B_d[:, None, :], G.shape)
    good = np.ones(len(B_d), dtype=bool)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        levels = tree(RiccatiMap(np.broadcast_to(A, G.shape), G, H))
        total = RiccatiMap(*(part[0] for part in levels[-1]))
        for _ in range(DOUBLINGS):
            total = compose(total, total)
            # Where the recursion escapes it is replaced by the zero map, and the level counts as not achieved.
            good &= np.all([np.abs(part).max(axis=(1, 2)) < ESCAPE for part in total], axis=0)
            total = RiccatiMap(*(np.where(good[:, None, None], part, 0.0) for part in total))
        spectrum = np.linalg.eigvalsh(down(levels, total.H))
    least, largest = spectrum[..., 0], spectrum[..., -1]
    good &= np.all((least > -ROUNDING * largest) & (largest < level**2), axis=0)
    return np.asarray(good & (np.abs(total.A).max(axis=(1, 2)) < ROUNDING))

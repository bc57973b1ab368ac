"""Section IV-C: which B_d and D may stand behind the gains printed in eq. (42), given A and C.

Gains that solve Theorem 2 achieve nearly the smallest possible level, so the excess of their exact norm over the exact
optimum ranks the candidates (B_d, D). The winner is checked by a computation that shares no code with that: how near
the printed gains come to the central path of the matrix inequality, which interior-point solvers follow.
Only the ratio of B_d to D matters and the sign of B_d does not: D[0][0] = 1 is a choice. No random numbers.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from papers.okajima2023.method.central_path import CentralPoint, central_path
from papers.okajima2023.method.recovery import by_modulus, gains_array
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import frequency_response
from replication.estimation.linear.riccati import RiccatiMap, compose
from replication.estimation.multirate.optimum import optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array, as_matrix, positive_scalar

Json = dict[str, Any]
Matrix = list[list[float]]
Flags = npt.NDArray[np.bool_]

STEP = 0.5
"""Step of the entries of B_d that are tried."""
RATIOS = (0.5, 1.0, 2.0)
"""Noise of each further sensor relative to the first that is tried."""
ANGLES = (0.0, 1.0, np.pi)
"""Lifted frequencies, radians per period, of the cheap lower bound of the norm of the printed gains."""
FIRST_CUT = 0.01
DOUBLINGS = 12
"""Of the period map: 4096 periods."""
ESCAPE, SETTLED = 1e100, 1e-9
PATH_FACTOR = 1.05
PATH_END = 1e-4
"""Gap at the end of the central path, relative to the square of the optimum."""


class _Candidate(NamedTuple):
    """A problem of the grid with the exact optimum, the exact norm of the printed gains, and norm / optimum - 1."""

    excess: float
    optimum: float
    norm: float
    problem: MultirateProblem


def recover_inputs(A: Matrix, C: Matrix, printed_gains: list[Matrix], bound: float = 3.0) -> Json:
    """Find the (B_d, D) for which the printed gains (N, n, q) exceed the optimum least, and the centre nearest to them.

    Tried: B_d (n, 1) with entries in halves up to `bound`, one of each +-B_d, and diagonal D with D[0][0] = 1 and
    RATIOS for the others. Excesses are relative (norm / optimum - 1). central_level is gamma at the centre whose gains
    differ least from the printed ones in the largest entry;
    second_gain_difference is that smallest difference for the runner-up. Error poles are [real, imaginary] by
    decreasing modulus. Raises InvalidInputError if the shapes do not fit or the non-zero columns of the gains are not
    those of periodic sensors, InfeasibleError if the gains do not stabilise A_e.
    """
    state, output = as_matrix("A", A), as_matrix("C", C, columns=len(A))
    gains = gains_array(printed_gains, len(state))
    schedule = schedule_of(gains)
    B_d, D = _grid(len(state), len(output), positive_scalar("bound", bound))
    best, second = _least_excess(state, output, schedule, gains, B_d, D)
    point, runner_up = _nearest_centre(best, gains), _nearest_centre(second, gains)
    poles = np.linalg.eigvals(best.problem.error_system(point.gains).monodromy())
    return {
        "tried": len(B_d),
        "best_excess": best.excess,
        "second_excess": second.excess,
        "B_d": best.problem.plant.B_d.tolist(),
        "D": best.problem.plant.D.tolist(),
        "optimum": best.optimum,
        "norm_printed_gains": best.norm,
        "central_level": point.level,
        "largest_gain_difference": _difference(point, gains),
        "second_gain_difference": _difference(runner_up, gains),
        "gains_central": point.gains.tolist(),
        "error_poles_central": by_modulus(poles),
    }


def schedule_of(gains: Array) -> SensingSchedule:
    """The periodic schedule whose measured sensors are the non-zero columns of the gains (N, n, q).

    Raises InvalidInputError if there is none.
    """
    measured = np.any(gains != 0, axis=1)
    N = len(measured)
    counts = measured.sum(axis=0)
    if np.all(counts > 0) and np.all(N % counts == 0):
        schedule = SensingSchedule(
            tuple(int(N // count) for count in counts), tuple(int(np.argmax(column)) for column in measured.T)
        )
        if schedule.period == N and np.array_equal(schedule.mask, measured):
            return schedule
    raise InvalidInputError(
        "the non-zero columns of printed_gains are not those of periodic sensors; instants with a gain, by sensor: "
        f"{[np.flatnonzero(column).tolist() for column in measured.T]} of {N}"
    )


def _grid(n: int, q: int, bound: float) -> tuple[Array, Array]:
    """All pairs of B_d (m, n) and diagonal of D (m, q); of +-B_d, which have the same gains, one."""
    count = int(np.floor(bound / STEP + 1e-9))
    values = STEP * np.arange(-count, count + 1)
    directions = [b for b in itertools.product(values, repeat=n) if b > (0.0,) * n]
    noises = [(1.0, *ratios) for ratios in itertools.product(RATIOS, repeat=q - 1)]
    pairs = list(itertools.product(directions, noises))
    if len(pairs) < 2:
        raise InvalidInputError(f"bound must be at least {STEP} for a grid of two candidates or more, got {bound}")
    return np.array([b for b, _ in pairs]), np.array([d for _, d in pairs])


def _least_excess(
    A: Array, C: Array, schedule: SensingSchedule, gains: Array, B_d: Array, D: Array
) -> tuple[_Candidate, _Candidate]:
    """The two candidates with the smallest excess.

    A candidate is dropped without its exact optimum if a level below the attained norm by more than a cut is
    achievable. The cut grows until it is above the second excess found, so no candidate below that was dropped.
    """
    attained = _attained(A, C, schedule, gains, B_d, D)
    cut = FIRST_CUT
    while True:
        kept = np.flatnonzero(~_achievable(A, C, schedule, B_d, D, attained / (1 + cut)))
        found = []
        for i in kept:
            plant = MultiratePlant(A=A, B_d=B_d[i][:, None], C=C, D=np.diag(D[i]))
            problem = MultirateProblem(plant, schedule)
            norm, smallest = l2_gain(problem.error_system(gains)).value, optimum(problem).value
            found.append(_Candidate(norm / smallest - 1, smallest, norm, problem))
        found.sort(key=lambda candidate: candidate.excess)
        if len(found) > 1 and found[1].excess <= cut:
            return found[0], found[1]
        cut *= 4


def _attained(A: Array, C: Array, schedule: SensingSchedule, gains: Array, B_d: Array, D: Array) -> Array:
    """Lower bounds (m,) of the norms of the printed gains: largest singular values at ANGLES, for B_d (m, n), D (m, q).

    The error system is that of unit disturbances of every state and sensor, its inputs combined for each candidate.
    """
    n, N = len(A), schedule.period
    unit = MultirateProblem(MultiratePlant(A=A, B_d=np.eye(n), C=C, D=np.eye(len(C))), schedule)
    system = unit.error_system(gains)
    radius = system.spectral_radius()
    if radius >= 1:
        raise InfeasibleError(
            f"printed_gains do not stabilise A_e of this A and C (multiplier of modulus {radius:.6g}); check both"
        )
    blocks = []
    for rows, stage in zip(unit.measured_rows(), system.stages, strict=True):
        # Inputs of a stage: one per state, then one per sensor; without measurement, no sensor noise.
        block = np.zeros((len(B_d), stage.B.shape[1], 1 + len(rows)))
        block[:, :n, 0] = B_d
        for place, sensor in enumerate(rows, start=1):
            block[:, n + sensor, place] = D[:, sensor]
        blocks.append(block)
    lifted = system.lift()
    first = np.cumsum([0, *(block.shape[1] for block in blocks)])
    level = np.zeros(len(B_d))
    for angle in ANGLES:
        response = frequency_response(lifted, angle)
        parts = [response[:, first[k] : first[k + 1]] @ blocks[k] for k in range(N)]
        level = np.maximum(level, np.linalg.norm(np.concatenate(parts, axis=2), ord=2, axis=(1, 2)))
    return level


def _achievable(A: Array, C: Array, schedule: SensingSchedule, B_d: Array, D: Array, level: Array) -> Flags:
    """Whether a stabilising X_k >= 0 with X_k < level^2 I was found (W = I), per candidate; False may be in doubt."""
    H = B_d[:, :, None] * B_d[:, None, :]
    identity = np.eye(len(A))
    maps = []
    for measured in schedule.mask:
        information = np.einsum("qi,mq,qj->mij", C, measured / D**2, C)
        maps.append(RiccatiMap(np.broadcast_to(A, H.shape), information - identity / level[:, None, None] ** 2, H))
    good = np.ones(len(B_d), dtype=bool)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        total = maps[0]
        for step in [*maps[1:], *([None] * DOUBLINGS)]:
            parts = compose(total, step or total)
            # Where the recursion escapes it is replaced by the zero map, and the level counts as not achieved.
            good &= np.all([np.abs(part).max(axis=(1, 2)) < ESCAPE for part in parts], axis=0)
            total = RiccatiMap(*(np.where(good[:, None, None], part, 0.0) for part in parts))
        good &= np.abs(total.A).max(axis=(1, 2)) < SETTLED
        X = total.H
        for step in maps:
            spectrum = np.linalg.eigvalsh(X)
            good &= (spectrum[:, 0] > -SETTLED * spectrum[:, -1]) & (spectrum[:, -1] < level**2)
            X = step.A @ np.linalg.solve(identity + X @ step.G, X) @ A.T + H
    return np.asarray(good & (np.abs(X - total.H).max(axis=(1, 2)) < SETTLED * level**2))


def _nearest_centre(candidate: _Candidate, gains: Array) -> CentralPoint:
    """The point of the central path whose gains are nearest to the printed ones in the largest entry."""
    points = central_path(candidate.problem, gains, gap=PATH_END * candidate.optimum**2, factor=PATH_FACTOR)
    return min(points, key=lambda point: _difference(point, gains))


def _difference(point: CentralPoint, gains: Array) -> float:
    return float(np.max(np.abs(point.gains - gains)))

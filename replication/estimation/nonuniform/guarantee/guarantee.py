"""The guaranteed level of a given filter: common Lyapunov function, then one that knows more and more coming
periods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy

from replication.errors import InvalidInputError, SolverError
from replication.estimation.conic.clarabel import ALMOST
from replication.estimation.conic.solvers import SolverReport
from replication.estimation.nonuniform.filters import Estimator, error_system, gramian, periodic_gain
from replication.estimation.nonuniform.guarantee.certificate import Certificate, certify
from replication.estimation.nonuniform.guarantee.context_tree import ContextTree
from replication.estimation.nonuniform.guarantee.path_lyapunov import (
    ROUGH,
    Cells,
    ErrorSystem,
    PathSolution,
    Samples,
    solve,
)
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.validation import Array, positive_integer, positive_scalar

GROWTH = 0.1
"""Share of the leaves, those with the largest energy flux, that know one period more in the next round."""
LOOSE = 1e-3
"""Relative distance of the certified level from that of the samples above which samples are added."""
REGULAR = 1e-6
"""Added to the Gramian of the error in the units of each state, for states that w hardly reaches."""
ROUNDS = 3
"""Times that the common Lyapunov function is solved for, each time in the coordinates of the last."""
ROUNDINGS = (0.0, 8.0)
"""Excess over rounding that the solver is asked for: none, and where that proves nothing, some, which costs level."""
EXCHANGES = 3
"""Times that the last tree is solved again with more samples."""


@dataclass(frozen=True)
class Guarantee:
    """A level proved for every sampling sequence in [h_l, h_u].

    level: upper bound of the gain; leaves, depth: size of the context tree, most periods ahead; history: the best level
    proved with at most so many leaves; cells, tree, P, system: the certificate, which `certify` checks again; ended:
    why the tree grew no further.
    """

    level: float
    leaves: int
    depth: int
    history: tuple[tuple[int, float], ...]
    cells: Cells
    tree: ContextTree
    P: Array
    system: ErrorSystem
    report: SolverReport
    ended: str


def guaranteed_level(
    plant: SampledPlant,
    filter_: Estimator,
    periods: PeriodRange,
    *,
    max_leaves: int = 128,
    cuts: Sequence[float] | None = None,
    per_duration: bool = False,
) -> Guarantee:
    """Upper bound of the gain ||e|| / ||w|| over every sequence of periods in the range, continuum included.

    cuts: inner edges of the cells (seconds), by default the middle of the range; max_leaves: 1 gives the common
    Lyapunov function. per_duration weighs both squared norms by the interval lengths. Raises InvalidInputError if the
    cuts do not increase inside the range or the filter does not fit, InfeasibleError if A_f is not Schur stable (the
    gain is then infinite), SolverError if no certificate is found.
    """
    limit = positive_integer("max_leaves", max_leaves)
    edges = _edges(periods, cuts)
    filter_.require_settling(plant)
    natural = _natural(plant, filter_, periods.middle, per_duration)
    system, best = _common(natural, periods)
    history = [(1, best.level)]
    # With one cell there is nothing to tell apart.
    if len(edges) == 2 or limit < len(edges) - 1:
        return best
    samples, tree = Samples(Cells(edges)), ContextTree.one_step(len(edges) - 1)
    ended, exchanges = "", 0
    while not ended:
        seen = samples
        try:
            solution, samples, proof = _solve_until_proved(system, samples, tree, exchanges)
        except SolverError as error:
            # What was proved so far stands: a certificate does not depend on the next one.
            ended = str(error)
            break
        if proof.level < best.level:
            best = _guarantee(system, samples.cells, tree, solution, proof, ())
        history.append((len(tree.leaves), best.level))
        count = max(1, int(GROWTH * len(tree.leaves)))
        longer = tree.split([tree.leaves[i] for i in np.argsort(-solution.flux, kind="stable")[:count]])
        if len(longer.leaves) <= limit:
            tree = longer
        elif exchanges == 0 and samples is not seen:
            # Samples that were found missing are kept, so that only the last tree is solved more than once.
            exchanges = EXCHANGES
        else:
            ended = f"more than {limit} leaves would be needed"
    return replace(best, history=tuple(history), ended=ended)


def _edges(periods: PeriodRange, cuts: Sequence[float] | None) -> tuple[float, ...]:
    """The ends of the range with the inner edges of its cells between them."""
    if cuts is None:
        cuts = (periods.middle,) if periods.h_l < periods.h_u else ()
    edges = (periods.h_l, *(positive_scalar("an entry of `cuts`", cut, unit="s") for cut in cuts), periods.h_u)
    if len(edges) > 2 and not all(a < b for a, b in pairwise(edges)):
        raise InvalidInputError(
            f"`cuts` must increase strictly inside ({periods.h_l:.6g}, {periods.h_u:.6g}) s, got {tuple(cuts)}"
        )
    return edges


def _common(natural: ErrorSystem, periods: PeriodRange) -> tuple[ErrorSystem, Guarantee]:
    """The common Lyapunov function, and the error system in the coordinates and units in which it is the identity."""
    tree = ContextTree.one_step(1)
    for roundings in ROUNDINGS:
        system, samples, best = replace(natural, roundings=roundings), Samples(Cells((periods.h_l, periods.h_u))), None
        # Each solution gives the coordinates of the next, which is more accurate where the plant's are badly scaled.
        # A solver that ends early has then done enough, and what is proved does not depend on its word.
        for _ in range(ROUNDS):
            solution, samples, proof = _solve_until_proved(system, samples, tree, accept=ROUGH)
            seen = system.level * float(np.sqrt(solution.delta))
            if np.isfinite(proof.level):
                best = _guarantee(system, samples.cells, tree, solution, proof, ((1, proof.level),))
            if solution.delta <= 0 or np.linalg.eigvalsh(solution.P[0])[0] <= 0:
                break
            root = np.linalg.cholesky(solution.P[0]).T
            system = replace(system, T=root @ system.T / np.sqrt(solution.delta), level=seen)
        if best is not None:
            return best.system, best
    raise SolverError(
        f"no common Lyapunov function was certified: the one found keeps the level {seen:.6g} at "
        f"{len(samples.of(0, (0,)))} periods, not for certain at all others; narrow the range of sampling periods"
    )


def _natural(plant: SampledPlant, filter_: Estimator, h: float, per_duration: bool) -> ErrorSystem:
    """The error system with its Gramian at period h about the identity, e in units of its own gain there.

    The units of w, y, z and of the states then matter neither to the solver nor to the hulls.
    """
    balanced = balancing(plant)
    plant, filter_ = plant.in_coordinates(balanced), filter_.in_coordinates(balanced)
    stage = error_system(plant, filter_, h, per_duration=per_duration)
    reached = gramian(stage.A, stage.B)
    # Each state in its own unit first, so that the small number added means the same to all of them.
    size = np.sqrt(np.diag(reached))
    units = np.where(size > 0, size, np.max(size))
    scaled = reached / np.outer(units, units) + REGULAR * np.eye(len(units))
    # The filter's states are measured so too, since the certificate pays for the condition of T.
    own = np.exp2(np.round(np.log2(units[plant.order :])))
    filter_ = filter_.in_units(own)
    T = np.linalg.inv(np.linalg.cholesky(scaled)) / units
    T[:, plant.order :] *= own
    level = periodic_gain(plant, filter_, [h], per_duration=per_duration).upper
    original = np.concatenate([1 / np.diag(balanced), own])
    return ErrorSystem(plant, filter_, T, level if level > 0 else 1.0, per_duration, original)


def balancing(plant: SampledPlant) -> Array:
    """Units of the states (powers of two, which change no digit) in which A, B, C, L are balanced and |B| is |A|."""
    A, B = plant.A, plant.B
    n, m = B.shape
    outputs = np.vstack([plant.C, plant.L])
    whole = np.block(
        [
            [A, B, np.zeros((n, len(outputs)))],
            [np.zeros((m, n + m + len(outputs)))],
            [outputs, np.zeros((len(outputs), m + len(outputs)))],
        ]
    )
    _, (units, _) = scipy.linalg.matrix_balance(whole, permute=False, separate=True)
    units = units[:n]
    rate = np.linalg.norm(A / units[:, None] * units)
    ratio = np.linalg.norm(B / units[:, None]) / rate if rate > 0 else 1.0
    return np.diag(1 / (units * np.exp2(np.round(np.log2(ratio)))))


def _solve_until_proved(
    system: ErrorSystem,
    samples: Samples,
    tree: ContextTree,
    exchanges: int = EXCHANGES,
    accept: tuple[str, ...] = ALMOST,
) -> tuple[PathSolution, Samples, Certificate]:
    """Solve, certify, and add to each transition that asks for too much the period where, until the certificate is as
    good as the samples, or `exchanges` times."""
    for attempt in range(exchanges + 1):
        solution = solve(system, samples, tree, accept=accept)
        target = system.level * float(np.sqrt(solution.delta)) * (1 + LOOSE)
        proof = certify(system, samples.cells, tree, solution.P, target)
        missed = {}
        for (_, letter, following), need, h in zip(tree.transitions(), proof.needs, proof.periods, strict=True):
            word = tree.leaves[following]
            if system.level * np.sqrt(need) > target and h not in samples.of(letter, word):
                missed[letter, word] = float(h)
        samples = samples.with_added(missed) if missed else samples
        if proof.level <= target or not missed or attempt == exchanges:
            break
    return solution, samples, proof


def _guarantee(
    system: ErrorSystem,
    cells: Cells,
    tree: ContextTree,
    solution: PathSolution,
    proof: Certificate,
    history: tuple[tuple[int, float], ...],
) -> Guarantee:
    depth = max(len(leaf) for leaf in tree.leaves)
    leaves = len(tree.leaves)
    ended = "one Lyapunov function was asked for"
    return Guarantee(proof.level, leaves, depth, history, cells, tree, solution.P, system, solution.report, ended)

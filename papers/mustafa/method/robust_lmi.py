"""The robust LMI (13), reconstructed: the text omits it, so it is derived here from (7), with one multiplier per cell.

Cell i has the nominal period h_i; xi = Delta(theta) eta with ||Delta(theta)|| <= delta_i on the cell. With the storage
of Theorem 3, V+ - V + |e|^2 - gamma^2 |w|^2 + lambda_i (delta_i^2 |eta|^2 - |xi|^2) < 0 becomes, by the congruence of
the paper, an LMI in blocks (Z, Y | e | eta | Z, Y | xi | w), linear in all variables and in lambda_i > 0.
Asking both channels for the same gamma, as the text says, would force gamma >= alpha; the free multiplier does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from papers.mustafa.method.stability import logarithmic_norm, small_gain_alpha
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.conic.program import (
    ALMOST,
    Indices,
    Inequalities,
    SolverReport,
    program_under,
    solve_clarabel,
)
from replication.estimation.nonuniform.filters import Filter
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import (
    LmiVariables,
    combine,
    lmi10,
    normalise,
    recover,
    variable_basis,
)
from replication.estimation.validation import Array, positive_integer


@dataclass(frozen=True)
class RobustLmiDesign:
    """level: guaranteed for every sequence in the range; alphas: alpha_i of the cells; radius: their delta_i."""

    level: float
    filter: Filter
    alphas: tuple[float, ...]
    radius: float
    report: SolverReport


def modal_transform(A: Array) -> Array:
    """T such that T A T^-1 is real block diagonal and normal; raises InvalidInputError if A is not diagonalisable."""
    values, vectors = np.linalg.eig(A)
    if np.linalg.cond(vectors) > 1e8:
        raise InvalidInputError("A is not diagonalisable (condition of its eigenvectors above 1e8); use modal=False")
    _, real_vectors = scipy.linalg.cdf2rdf(values.astype(complex), vectors.astype(complex))
    return np.asarray(np.linalg.inv(real_vectors))


def delta_radius(A: Array, half_width: float) -> float:
    """Bound of ||Delta(theta)|| for |theta| <= half_width from Lemma 3: (e^{mu t} - 1) / mu for both signs of theta."""
    bounds = []
    for mu in (logarithmic_norm(A), logarithmic_norm(-A)):
        bounds.append(half_width if abs(mu * half_width) < 1e-12 else float(np.expm1(mu * half_width)) / mu)
    return max(bounds)


def robust_lmi_design(plant: SampledPlant, periods: PeriodRange, cells: int, *, modal: bool = True) -> RobustLmiDesign:
    """Minimise gamma subject to (13) on `cells` equal cells; Delta is measured in modal coordinates if `modal`.

    Raises InfeasibleError if alpha_i delta_i >= 1 on a cell, before any solver is called.
    """
    count = positive_integer("cells", cells)
    width = (periods.h_u - periods.h_l) / count
    centres = [periods.h_l + width * (i + 0.5) for i in range(count)]
    measured = plant.in_coordinates(modal_transform(plant.A)) if modal else plant
    radius = delta_radius(measured.A, width / 2)
    alphas = [small_gain_alpha(measured, h) for h in centres]
    for h, alpha in zip(centres, alphas, strict=True):
        if alpha * radius >= 1:
            raise InfeasibleError(
                f"the cell around h = {h:.6g} s has alpha * delta = {alpha * radius:.4g} >= 1, so (13) has no "
                "solution; use more cells"
            )
    normalised = normalise(plant, periods.middle)
    frame = (modal_transform(plant.A) if modal else np.eye(plant.order)) @ np.linalg.inv(normalised.T)
    group, unknowns = _inequalities(normalised.plant, frame, centres, radius)
    cost = np.zeros(unknowns + count)
    cost[0] = 1.0
    solution = solve_clarabel(program_under(cost, group), accept=ALMOST)
    v = combine(variable_basis(normalised.plant), solution.multipliers[:unknowns])
    level = normalised.scale * float(np.sqrt(v.delta))
    return RobustLmiDesign(level, normalised.restore(recover(v)), tuple(alphas), radius, solution.report)


def lmi13(
    plant: SampledPlant, frame: Array, Phi: Array, Gamma: Array, radius: float, v: LmiVariables, multiplier: Array
) -> Array:
    """The matrix of (13) for one cell, order 6n + s + m. `frame` (n, n): Delta is measured in coordinates frame @ x.

    `v` and `multiplier` may be stacks.
    """
    n, s, m = plant.order, len(plant.L), plant.B.shape[1]
    base = lmi10(plant, Phi, Gamma, v)
    total = 6 * n + s + m
    matrix = np.zeros((*base.shape[:-2], total, total))
    # Positions of the blocks of (10) among those of (13): eta comes after e, xi after the second (Z, Y).
    eta = np.arange(2 * n + s, 3 * n + s)
    xi = np.arange(5 * n + s, 6 * n + s)
    kept = np.setdiff1d(np.arange(total), np.concatenate([eta, xi]))
    matrix[..., kept[:, None], kept] = base
    scale = np.asarray(multiplier)[..., None, None]
    matrix[..., eta[:, None], eta] = matrix[..., xi[:, None], xi] = -scale * np.eye(n)
    drift = frame @ np.hstack([plant.A @ Phi, plant.A @ Phi, plant.A @ Gamma + plant.B])
    seen = np.concatenate([np.arange(3 * n + s, 5 * n + s), np.arange(6 * n + s, total)])
    _put(matrix, eta, seen, scale * radius * drift)
    _put(matrix, np.arange(2 * n), xi, np.concatenate([v.Z, v.Y], axis=-2) @ np.linalg.inv(frame))
    return matrix


def _put(matrix: Array, rows: Indices, columns: Indices, block: Array) -> None:
    """Write an off-diagonal block and its transpose."""
    matrix[..., rows[:, None], columns] = block
    matrix[..., columns[:, None], rows] = np.swapaxes(block, -1, -2)


def _inequalities(
    plant: SampledPlant, frame: Array, centres: Sequence[float], radius: float
) -> tuple[Inequalities, int]:
    """-(13) >= 0 for every cell; the unknowns are those of (10) and then the multipliers."""
    basis = variable_basis(plant)
    unknowns = len(basis.delta) - 1
    extended = LmiVariables(**{name: np.concatenate([x, np.zeros_like(x[:1])]) for name, x in vars(basis).items()})
    multiplier = np.append(np.zeros(unknowns + 1), 1.0)
    stacks = np.array([-lmi13(plant, frame, *plant.discretise(h), radius, extended, multiplier) for h in centres])
    constant = stacks[:, 0]
    variables = np.array([[*range(unknowns), unknowns + i] for i in range(len(centres))])
    return Inequalities(constant, stacks[:, 1:] - constant[:, None], variables), unknowns

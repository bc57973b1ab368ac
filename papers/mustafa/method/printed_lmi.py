"""Theorem 3 as printed, through cvxpy: (10) block by block beside the paper; a second transcription, a second
modeller."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from replication.estimation.conic.program import minimise_modelled
from replication.estimation.nonuniform.plant import SampledPlant, as_periods
from replication.estimation.nonuniform.robust import FilterDesign, LmiSolution, LmiVariables, normalise, with_filter

ACCEPTED = ("optimal", "optimal_inaccurate")


def printed_design(plant: SampledPlant, periods: Sequence[float]) -> FilterDesign:
    """Minimise delta = gamma^2 subject to (10) at all `periods` (s); the filter by (11). Status in the report.

    Raises InvalidInputError for periods that are not positive, InfeasibleError or SolverError by the solver's status.
    """
    import cvxpy  # slow to load

    grid = as_periods("periods", periods).tolist()
    normalised = normalise(plant, float(np.mean(grid)))
    p = normalised.plant
    n, m, r, s = p.order, p.B.shape[1], len(p.C), len(p.L)
    Z, Y = (cvxpy.Variable((n, n), symmetric=True) for _ in range(2))
    F, G, Q = cvxpy.Variable((n, r)), cvxpy.Variable((s, n)), cvxpy.Variable((n, n))
    delta = cvxpy.Variable((1, 1))
    matrices = []
    for h in grid:
        Phi, Gamma = p.discretise(h)
        o_s, o_m = np.zeros((n, s)), np.zeros((n, m))
        a, b = Y @ Phi + F @ p.C + Q, Y @ Phi + F @ p.C
        c = Y @ Gamma + F @ p.D
        rows = [
            [-Z, -Z, o_s, Z @ Phi, Z @ Phi, Z @ Gamma],
            [-Z, -Y, o_s, a, b, c],
            [o_s.T, o_s.T, -np.eye(s), p.L - G, p.L, np.zeros((s, m))],
            [Phi.T @ Z, a.T, (p.L - G).T, -Z, -Z, o_m],
            [Phi.T @ Z, b.T, p.L.T, -Z, -Y, o_m],
            [Gamma.T @ Z, c.T, np.zeros((m, s)), o_m.T, o_m.T, -cvxpy.kron(np.eye(m), delta)],
        ]
        matrices.append(-cvxpy.bmat(rows))
    report, constraints = minimise_modelled(delta[0, 0], matrices, ACCEPTED)
    values = {name: np.asarray(x.value) for name, x in zip("ZYFGQ", (Z, Y, F, G, Q), strict=True)}
    v = LmiVariables(**values, delta=np.asarray(delta.value[0, 0]))
    level = normalised.scale * float(np.sqrt(max(float(delta.value[0, 0]), 0.0)))
    weights = tuple(float(np.trace(constraint.dual_value)) for constraint in constraints)
    return with_filter(normalised, LmiSolution(level, v, tuple(grid), weights, report))

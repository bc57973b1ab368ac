"""Steps of the proofs of Secs. II and III on random data, and the slips in their statements."""

from typing import Any

import numpy as np

from papers.okajima2023.experiments.designs import INACCURATE, Json, Matrix, build
from papers.okajima2023.method.lmi import lmi_analysis, theorem1_matrix, theorem2_matrix
from replication.estimation.linear.periodic import simulate
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array


def identities(trials: int, seed: int) -> Json:
    """Largest relative residuals over random problems.

    error_system: observer (15) beside plant (2), (13), against eq. (16). dissipation: the quadratic form of (20)
    against the left-hand side of (23). schur: (30) with Y = P L, reduced by its first block, against (20).
    """
    rng = np.random.default_rng(seed)
    error_system, dissipation, schur = np.array([_one_trial(rng) for _ in range(trials)]).max(axis=0).tolist()
    return {"trials": trials, "error_system": error_system, "dissipation": dissipation, "schur": schur}


def _one_trial(rng: np.random.Generator) -> tuple[float, float, float]:
    n, q, m = (int(rng.integers(low, high)) for low, high in ((2, 5), (1, 4), (1, 3)))
    plant = MultiratePlant(
        A=rng.normal(size=(n, n)),
        B_d=rng.normal(size=(n, m)),
        B_u=rng.normal(size=(n, 2)),
        C=rng.normal(size=(q, n)),
        D=np.diag(rng.uniform(0.5, 2.0, q)),
        W=rng.normal(size=(2, n)),
    )
    periods = tuple(int(N) for N in rng.integers(1, 4, q))
    problem = MultirateProblem(plant, SensingSchedule(periods, tuple(int(rng.integers(N)) for N in periods)))
    N = problem.schedule.period
    L, roots = rng.normal(size=(N, n, q)), rng.normal(size=(N, n, n))
    P, gamma_squared = roots @ roots.transpose(0, 2, 1) + np.eye(n), float(rng.uniform(1, 9))
    error_system, dissipation, schur = _error_system_residual(problem, L, rng), 0.0, 0.0
    for k, stage in enumerate(problem.error_system(L).stages):
        theta = np.block(theorem1_matrix(problem, L, list(P), k, gamma_squared))
        size, xi = float(np.linalg.norm(theta)), rng.normal(size=len(theta))
        e, noise = xi[:n], xi[n:]
        following, z = stage.A @ e + stage.B @ noise, stage.C @ e
        left = e @ P[k - 1] @ e - following @ P[k] @ following + gamma_squared * noise @ noise - z @ z
        dissipation = max(dissipation, abs(float(xi @ theta @ xi - left)) / float(size * (xi @ xi)))
        hat = np.block(theorem2_matrix(problem, list(P), list(P @ L), k, gamma_squared))
        reduced = hat[n:, n:] - hat[n:, :n] @ np.linalg.solve(hat[:n, :n], hat[:n, n:])
        schur = max(schur, float(np.linalg.norm(reduced - theta) / size))
    return error_system, dissipation, schur


def _error_system_residual(problem: MultirateProblem, L: Array, rng: np.random.Generator) -> float:
    """Plant and observer in their own loops over two periods, against the error system, relative."""
    plant, steps = problem.plant, 2 * problem.schedule.period
    d, w, u = (rng.normal(size=(steps, s)) for s in (plant.B_d.shape[1], plant.sensors, 2))
    x, observed, errors = np.zeros(plant.order), np.zeros(plant.order), []
    for k in range(steps):
        S = problem.schedule.selection(k)
        y, gain = S @ plant.C @ x + S @ plant.D @ w[k], L[k % problem.schedule.period] @ S
        errors.append(plant.W @ (x - observed))
        x = plant.A @ x + plant.B_u @ u[k] + plant.B_d @ d[k]
        observed = (plant.A - gain @ plant.C) @ observed + plant.B_u @ u[k] + gain @ y
    expected = simulate(problem.error_system(L), np.hstack([d, w]))
    return float(np.abs(np.array(errors) - expected).max() / np.abs(expected).max())


def summation(
    plant: dict[str, Matrix], gains: list[Matrix], slack: float, draws: int, last: int, seed: int, **sensing: list[int]
) -> Json:
    """The steps (26)-(28) of the proof of Theorem 1, for given gains under random noise d⁎(k), k = 0 ... last.

    sensing: periods, offsets and sensors. slack: by how much the level exceeds the smallest one of Theorem 1, relative,
    which leaves an epsilon > 0 in (22).
    Returns the level, that epsilon, and over all draws, relative to the energy of d⁎: the largest distance of the sum
    of xi' Theta_k xi from the left-hand side of (26), and the least excess of the left-hand side over the right-hand
    side in (26) and (27); and the largest ratio of l2 norms beside the bound in (28).
    """
    problem, L = build(plant, **sensing), np.array(gains)
    analysis = lmi_analysis(problem, L, accept=INACCURATE)
    level, N, P = (1 + slack) * analysis.level, problem.schedule.period, list(analysis.P)
    theta = [np.block(theorem1_matrix(problem, L, P, k, level**2)) for k in range(N)]
    epsilon = float(min(np.linalg.eigvalsh(matrix)[0] for matrix in theta))
    rng, stages, n = np.random.default_rng(seed), problem.error_system(L).stages, problem.plant.order
    rows = []
    for _ in range(draws):
        e, summed, size, energy, output = np.zeros(n), 0.0, 0.0, 0.0, 0.0
        for k in range(last + 1):
            stage, matrix = stages[k % N], theta[k % N]
            noise = rng.normal(size=(stage.B.shape[1],))
            xi, z = np.concatenate([e, noise]), stage.C @ e
            summed, size = summed + float(xi @ matrix @ xi), size + float(xi @ xi)
            energy, output = energy + float(noise @ noise), output + float(z @ z)
            e = np.asarray(stage.A @ e + stage.B @ noise)
        stored = e @ P[last % N] @ e
        left = -stored + level**2 * energy - output
        steps = abs(left - summed), left - epsilon * size, (level**2 - epsilon) * energy - output - stored, output
        rows.append(np.array(steps) / energy)
    residuals, excess_26, excess_27, ratios = np.array(rows).T
    return {
        "level": level,
        "epsilon": epsilon,
        "sum_residual": float(residuals.max()),
        "excess_26": float(excess_26.min()),
        "excess_27": float(excess_27.min()),
        "largest_ratio": float(np.sqrt(ratios.max())),
        "bound_28": float(np.sqrt(max(level**2 - epsilon, 0.0))),
        "draws": draws,
        "solvers": [analysis.report.to_dict()],
    }


def product_orders(plant: dict[str, Matrix], periods: list[int], offsets: list[int], gains: list[Matrix]) -> Json:
    """Spectra of A_e0 ... A_e5 multiplied in the three ways that the product sign may mean.

    descending: A_e5 ... A_e0, the way the error runs; shifted: A_e6 ... A_e1, as printed; ascending: A_e0 ... A_e5.
    """
    problem = build(plant, periods, offsets, list(range(len(plant["C"]))))
    factors = [stage.A for stage in problem.error_system(np.array(gains)).stages]

    def spectrum(matrices: list[Any]) -> list[float]:
        product = np.eye(problem.plant.order)
        for matrix in matrices:
            product = matrix @ product
        return sorted(np.abs(np.linalg.eigvals(product)).tolist(), reverse=True)

    return {
        "descending": spectrum(factors),
        "shifted": spectrum([*factors[1:], factors[0]]),
        "ascending": spectrum(factors[::-1]),
    }


def observability(plant: dict[str, Matrix]) -> Json:
    """Smallest singular value of the observability matrix of (C, A) relative to the largest."""
    A, C = np.array(plant["A"]), np.array(plant["C"])
    values = np.linalg.svd(np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(len(A))]), compute_uv=False)
    return {"margin": float(values[len(A) - 1] / values[0])}

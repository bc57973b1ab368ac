"""On random data: steps of the proofs of Secs. II and III with the slips in their statements; simulations of Sec. IV.

The simulations are the draws of Figs. 2-8, the distribution of g_sim, eq. (34), and the worst disturbance.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from papers.okajima2023.experiments.designs import INACCURATE, Json, Matrix, build
from papers.okajima2023.method.lmi import lmi_analysis, theorem1_matrix, theorem2_matrix
from replication.estimation.linear.norms import l2_gain, white_noise_variance, worst_case_response
from replication.estimation.linear.periodic import PeriodicSystem, simulate
from replication.estimation.multirate.optimum import optimal_design
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


DENOMINATORS = ("d", "d, simulated without w", "w", "d, w when measured", "d, w of sensors used", "d, all w")
"""What eq. (34) may mean: the first is the print, the second takes the sensors as noiseless, the others count w."""
PERCENTILES = (0.0, 2.5, 50.0, 97.5, 100.0)


def response(plant: dict[str, Matrix], cases: dict[str, Json], seed: int, **noise: Any) -> Json:
    """Estimation errors e(k), k = 0 ... last, of several observers under the same noise, as `_noise` takes it.

    cases: periods, offsets, sensors, and gains unless the central optimal ones are meant. The noise is that of all
    sensors of `plant`, so the observers see the same draw. One seeded draw: the published figures are another.
    """
    d, w = _noise(np.random.default_rng(seed), 1, plant, **noise)
    errors = {
        name: simulate(_system(plant, case), np.hstack([d[0], w[0][:, case["sensors"]]])).tolist()
        for name, case in cases.items()
    }
    return {"errors": errors}


def draws(plant: dict[str, Matrix], cases: dict[str, Json], seeds: int, seed: int, **noise: Any) -> Json:
    """g_sim of eq. (34) over `seeds` independent draws, for all observers.

    Returns per case the ratios under all readings of the denominator, the error energies, and the effect of the tail
    that the sums leave out.
    """
    d, w = _noise(np.random.default_rng(seed), seeds, plant, **noise)
    records: Json = {}
    for name, case in cases.items():
        system = _system(plant, case)
        error, final = _error_energy(system, np.concatenate([d, w[:, :, case["sensors"]]], axis=2))
        ratios = {reading: np.sqrt(error / energy) for reading, energy in _energies(d, w, case).items()}
        noiseless, _ = _error_energy(system, np.concatenate([d, 0 * w[:, :, case["sensors"]]], axis=2))
        ratios["d, simulated without w"] = np.sqrt(noiseless / (d**2).sum(axis=(1, 2)))
        # After the noise ends the error decays about this fast.
        decay = system.spectral_radius() ** (2 / system.period)
        records[name] = {
            "ratios": {reading: values.tolist() for reading, values in ratios.items()},
            "errors": error.tolist(),
            "largest_final_error": float(np.sqrt(final.max())),
            "largest_tail_effect": float(np.max(np.sqrt(1 + final / (1 - decay) / error) - 1)),
            "smallest_ratio_to_level": float(np.min(l2_gain(system).value / ratios["d, all w"])),
        }
    return records


def timing_draws(plant: dict[str, Matrix], cases: dict[str, Json], seeds: int, seed: int, **noise: Any) -> Json:
    """Error energies of several observers under common noise, over `seeds` independent draws.

    Returns how often each has the least energy; how often each has less than each other one; and the
    expected size of the error in the long run, the root of its variance per unit variance of the noise.
    """
    d, w = _noise(np.random.default_rng(seed), seeds, plant, **noise)
    systems = {name: _system(plant, case) for name, case in cases.items()}
    energies = {
        name: _error_energy(system, np.concatenate([d, w[:, :, cases[name]["sensors"]]], axis=2))[0]
        for name, system in systems.items()
    }
    least = np.argmin(list(energies.values()), axis=0)
    return {
        "seeds": seeds,
        "least": {name: float(np.mean(least == i)) for i, name in enumerate(cases)},
        "smaller": _smaller(energies),
        "long_run": {name: float(np.sqrt(white_noise_variance(system))) for name, system in systems.items()},
    }


def distribution(drawn: Json, printed: dict[str, float]) -> Json:
    """What `draws` say.

    Returns per case and reading percentiles and the two-sided probability of a draw at least as extreme as the printed
    one; the largest effect of the tail; how often each case has a smaller error energy than each other one, and how
    often, by reading, a smaller ratio.
    """
    ratios = {what: {name: np.array(case["ratios"][what]) for name, case in drawn.items()} for what in DENOMINATORS}
    errors = {name: np.array(case["errors"]) for name, case in drawn.items()}

    def summary(values: Array, printed: float) -> Json:
        percentiles = zip(map(str, PERCENTILES), np.percentile(values, PERCENTILES).tolist(), strict=True)
        return {"percentiles": dict(percentiles), "probability": tail_probability(values, printed)}

    return {
        "seeds": len(next(iter(errors.values()))),
        "cases": {
            name: {
                "readings": {reading: summary(rows[name], printed[name]) for reading, rows in ratios.items()},
                **{
                    what: case[what]
                    for what in ("largest_final_error", "largest_tail_effect", "smallest_ratio_to_level")
                },
            }
            for name, case in drawn.items()
        },
        "smaller_energy": _smaller(errors),
        "smaller_ratio": {reading: _smaller(rows) for reading, rows in ratios.items()},
    }


def _smaller(values: Mapping[str, Array]) -> dict[str, dict[str, float]]:
    """In which share of the draws each case has less than each other one."""
    return {
        name: {rival: float(np.mean(sizes < values[rival])) for rival in values if rival != name}
        for name, sizes in values.items()
    }


def tail_probability(draws: Array, printed: float) -> float:
    """Two-sided probability of a draw at least as extreme as `printed`, with the printed one counted as a draw."""
    below = (1 + int(np.sum(draws <= printed))) / (1 + len(draws))
    above = (1 + int(np.sum(draws >= printed))) / (1 + len(draws))
    return float(min(1.0, 2 * min(below, above)))


def worst_disturbance(plant: dict[str, Matrix], case: Json, horizon: int, seed: int) -> Json:
    """The disturbance that hurts an observer most over a horizon, beside a random one of the same energy."""
    system = _system(plant, case)
    worst = worst_case_response(system, horizon)
    random = np.random.default_rng(seed).normal(size=worst.inputs.shape)
    random *= np.linalg.norm(worst.inputs) / np.linalg.norm(random)
    answer = simulate(system, random)
    return {
        "norm": l2_gain(system).value,
        "worst_ratio": worst.ratio,
        "random_ratio": float(np.linalg.norm(answer) / np.linalg.norm(random)),
        "worst_error": np.linalg.norm(worst.outputs, axis=1).tolist(),
        "random_error": np.linalg.norm(answer, axis=1).tolist(),
    }


def _system(plant: dict[str, Matrix], case: Json) -> PeriodicSystem:
    """The error system of one observer, with the gains of the case or the central optimal ones."""
    problem = build(plant, case["periods"], case["offsets"], case["sensors"])
    return problem.error_system(np.array(case["gains"]) if "gains" in case else optimal_design(problem).gains)


def _noise(
    rng: np.random.Generator, draws: int, plant: dict[str, Matrix], sigma: float, noisy: int, last: int
) -> tuple[Array, Array]:
    """d (draws, instants, disturbances) and w (draws, instants, sensors), normal, zero after k = noisy."""
    d = rng.normal(0.0, sigma, (draws, last + 1, np.shape(plant["B_d"])[1]))
    w = rng.normal(0.0, sigma, (draws, last + 1, len(plant["C"])))
    d[:, noisy + 1 :] = 0.0
    w[:, noisy + 1 :] = 0.0
    return d, w


def _energies(d: Array, w: Array, case: Json) -> dict[str, Array]:
    """Squared denominators of eq. (34) by reading, one per draw."""
    process, sensor, sensors = (d**2).sum(axis=(1, 2)), (w**2).sum(axis=1), case["sensors"]
    due = zip(sensors, case["periods"], case["offsets"], strict=True)
    when = sum((w[:, theta::N, sensor_index] ** 2).sum(axis=1) for sensor_index, N, theta in due)
    return {
        "d": process,
        "w": sensor.sum(axis=1),
        "d, w when measured": process + when,
        "d, w of sensors used": process + sensor[:, sensors].sum(axis=1),
        "d, all w": process + sensor.sum(axis=1),
    }


def _error_energy(system: PeriodicSystem, inputs: Array) -> tuple[Array, Array]:
    """Energy of e(0) ... e(last), and of e(last + 1), for all draws at once."""
    e = np.zeros((len(inputs), system.order))
    total = np.zeros(len(inputs))
    for k in range(inputs.shape[1]):
        total += (e**2).sum(axis=1)
        stage = system.stages[k % system.period]
        e = e @ stage.A.T + inputs[:, k] @ stage.B.T
    return total, (e**2).sum(axis=1)

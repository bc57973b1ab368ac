"""Simulations of Sec. IV: the draws of Figs. 2-8, the distribution of g_sim, eq. (34), and the worst disturbance."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from papers.okajima2023.experiments.designs import Json, Matrix, build
from replication.estimation.linear.norms import l2_gain, white_noise_variance, worst_case_response
from replication.estimation.linear.periodic import PeriodicSystem, simulate
from replication.estimation.multirate.optimum import optimal_design
from replication.estimation.validation import Array

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

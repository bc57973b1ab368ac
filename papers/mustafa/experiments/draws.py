"""Figures 2 and 3 over many draws of the sampling periods."""

from typing import Any

import numpy as np

from papers.mustafa.experiments.levels import Json, Matrices, problem, subject
from replication.estimation.nonuniform.filters import Filter
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.worst_case import error_ratio
from replication.estimation.validation import Array

HELD = 25
"""Samples for which a period is held under the last law."""
LAWS = {
    "uniform": "independent and uniform",
    "at the ends": "independent, and each one of both ends with equal probability",
    "held": f"uniform, and each draw is held for {HELD} samples",
}
"""Laws of the sampling periods in words; the text states none."""


def draws(seeds: int, seed: int, **setting: Any) -> Json:
    """||e|| / ||w|| of the printed filter for the disturbance of the text over `seeds` sequences of uniform random
    periods, the band of their errors, and the first of them; setting: what `_setting` takes."""
    system, span, filter_, w = _setting(**setting)
    steps = len(w)
    sequences = np.random.default_rng(seed).uniform(span.h_l, span.h_u, (seeds, steps))
    errors = filter_.errors(system, sequences, w)[..., 0]
    return {
        "k": list(range(steps)),
        "w": w[:, 0].tolist(),
        "e": errors[0, :steps].tolist(),
        "periods": sequences[0].tolist(),
        "band_low": errors.min(axis=0)[:steps].tolist(),
        "band_high": errors.max(axis=0)[:steps].tolist(),
        "ratios": [error_ratio(system, h, w, e[:, None]) for h, e in zip(sequences, errors, strict=True)],
    }


def laws(seeds: int, seed: int, **setting: Any) -> Json:
    """||e|| / ||w|| of the printed filter for `seeds` sequences under each law, and ||z|| / ||w||, which the error has
    with no filter; setting: what `_setting` takes."""
    system, span, filter_, w = _setting(**setting)
    # One simulation gives both: the error of the estimate, and that of the estimate zero.
    both = SampledPlant(system.A, system.B, system.C, system.D, np.vstack([system.L, system.L]))
    beside = Filter(filter_.A, filter_.B, np.vstack([filter_.C, 0 * filter_.C]))
    rng = np.random.default_rng(seed)
    ratios: Json = {}
    for law in LAWS:
        sequences = np.array([_sequence(law, span, len(w), rng) for _ in range(seeds)])
        halves = np.split(beside.errors(both, sequences, w), 2, axis=-1)
        ratios[law] = {
            name: [error_ratio(system, h, w, e) for h, e in zip(sequences, errors, strict=True)]
            for name, errors in zip(("filter", "none"), halves, strict=True)
        }
    return ratios


def _setting(
    plant: Matrices, periods: list[float], printed: Matrices, steps: int, size: float, decay: float, frequency: float
) -> tuple[SampledPlant, PeriodRange, Filter, Array]:
    """Plant, range, printed filter, and w_k = size exp(-decay k) sin(frequency pi k) as a column."""
    system, span = problem(plant, periods)
    k = np.arange(steps)
    w = np.asarray((size * np.exp(-decay * k) * np.sin(frequency * np.pi * k))[:, None])
    return system, span, subject(system, span, printed), w


def _sequence(law: str, span: PeriodRange, steps: int, rng: np.random.Generator) -> Array:
    if law == "at the ends":
        return rng.choice([span.h_l, span.h_u], steps)
    if law == "held":
        return np.repeat(rng.uniform(span.h_l, span.h_u, -(-steps // HELD)), HELD)[:steps]
    return rng.uniform(span.h_l, span.h_u, steps)

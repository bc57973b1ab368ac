"""Cost of a delay observer for random plants of twenty histories, n·K = 20: least gain and gains at a level above it.

    python benchmarks/bench_delay_observer.py

CPU seconds of one thread; the distance to the optimum is that of the Riccati equation of the collocated plant.
"""

from __future__ import annotations

import time

import numpy as np

from replication.estimation.delay.cone import DegreeRule
from replication.estimation.delay.gains import observer_gains
from replication.estimation.delay.least_gain import minimum_gain
from replication.estimation.delay.lmi import riccati_gain
from replication.estimation.delay.models import chebyshev_model
from replication.estimation.delay.synthesis import certificate_at
from replication.estimation.delay.system import DelaySystem, delay_system

CASES = ((2, 10, 2), (4, 5, 2), (10, 2, 1))
"""States, delays, moments of each history."""
ABOVE = 1.05
ORDER = 6


def plant(states: int, delays: int) -> DelaySystem:
    """A seeded plant with damped states, delays up to about two seconds, and two measurements (one if n = 2)."""
    rng = np.random.default_rng(1)
    late = 0.4 / (delays * np.sqrt(states))
    return delay_system(
        rng.standard_normal((states, states)) / np.sqrt(states) - 0.8 * np.eye(states),
        [late * rng.standard_normal((states, states)) for _ in range(delays)],
        np.cumsum(rng.uniform(0.1, 0.3, delays)).tolist(),
        np.eye(states),
        rng.standard_normal((1, states)),
        rng.standard_normal((2 if states > 2 else 1, states)),
    )


def main() -> None:
    """Print one line per case."""
    print("| n | K | moments | least gain [s] | observer [s] | γ | above the optimum |")
    print("|--:|--:|--:|--:|--:|--:|--:|")
    for states, delays, moments in CASES:
        system = plant(states, delays)
        start = time.process_time()
        least = minimum_gain(system, moments, DegreeRule.BESSEL)
        middle = time.process_time()
        observer_gains(certificate_at(system, ABOVE * least.gamma, moments, DegreeRule.BESSEL))
        end = time.process_time()
        excess = least.gamma / riccati_gain(chebyshev_model(system, ORDER)) - 1.0
        seconds = f"{middle - start:.1f} | {end - middle:.1f}"
        print(f"| {states} | {delays} | {moments} | {seconds} | {least.gamma:.6f} | {excess:.1e} |", flush=True)


if __name__ == "__main__":
    main()

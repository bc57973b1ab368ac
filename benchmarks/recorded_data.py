"""Coverage of the 95 % intervals of `fit` over many simulated logs, and its time beside that of one `replay`.

`python benchmarks/recorded_data.py [LOGS]` prints both; each log has a seed of its own.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from replication.errors import ReplicationError
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.nonuniform.stamped.transition import Transition
from replication.estimation.recorded import fit, replay

A, C = np.array([[0.0, 1], [-1, -1]]), np.eye(2)
TRUE = NoisyPlant(A, C, Q=np.diag([0, 0.5]), R=[0.04, 0.01], sensors=["x", "v"])
BIAS, ROWS, STEP = 0.3, 600, 0.1


def log(seed: int) -> dict[str, np.ndarray]:
    """x at each third row, with a bias; v at each row."""
    rng = np.random.default_rng(seed)
    Phi, _, spread = Transition.of(TRUE.A, TRUE.B_u, TRUE.Q).at(STEP)
    root, x = np.linalg.cholesky(spread), rng.standard_normal(2)
    rows = np.empty((ROWS, 2))
    for k in range(ROWS):
        rows[k] = x + rng.standard_normal(2) * np.sqrt(np.diag(TRUE.R)) + [BIAS, 0]
        x = Phi @ x + root @ rng.standard_normal(2)
        if k % 3:
            rows[k, 0] = np.nan
    return {"t": STEP * np.arange(ROWS), "x": rows[:, 0], "v": rows[:, 1]}


def main(logs: int) -> None:
    """Print coverage by parameter, refusals, and the ratio of the seconds."""
    guess = NoisyPlant(A, C, Q=np.diag([0.0, 2]), R=[0.2, 0.05], sensors=["x", "v"])
    truth = np.array([0.5, 0.04, 0.01, BIAS])
    hits: list[np.ndarray] = []
    names: tuple[str, ...] = ()
    refused, spent, once = 0, 0.0, 0.0
    for seed in range(logs):
        data, began = log(seed), time.process_time()
        replay(StampedKalman(guess), data)
        between = time.process_time()
        try:
            best = fit(guess, data, biases=("x",))
        except ReplicationError as error:
            refused += 1
            print(f"seed {seed}: {error}")
            continue
        once, spent = once + between - began, spent + time.process_time() - between
        names = best.names
        hits.append((best.intervals[:, 0] <= truth) & (truth <= best.intervals[:, 1]))
    for name, share in zip(names, np.mean(hits, axis=0), strict=True):
        print(f"{name}: {100 * share:.1f} % of {len(hits)} intervals hold the truth")
    print(f"{refused} refused; fit takes {spent / once:.1f} times the seconds of a replay")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)

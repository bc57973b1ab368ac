"""Coverage of the 95 % intervals of `fit` over many simulated logs of each form, and what it costs.

`python benchmarks/recorded_data.py [LOGS [FORM]]` prints both; each log has a seed of its own. Beside the coverage of a
bias stands that of the same logs with all variances known, where it is exact but for the chance of the draw.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from replication.errors import ReplicationError
from replication.estimation.multirate import MultiratePlant, design
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.nonuniform.stamped.kalman import Transition
from replication.estimation.recorded import fit, replay

A, C = np.array([[0.0, 1], [-1, -1]]), np.eye(2)
TRUE = NoisyPlant(A, C, Q=np.diag([0, 0.5]), R=[0.04, 0.01], sensors=["x", "v"])
BIAS, LATE, ROWS, STEP, SLOW = 0.3, 0.13, 600, 0.1, 3

Log = dict[str, np.ndarray]


def stamped(seed: int, late: float = 0.0) -> Log:
    """x at each third row, with a bias, taken `late` before; v at each row."""
    rng = np.random.default_rng(seed)
    taken = STEP * np.arange(ROWS)
    order = np.unique(np.concatenate([taken, taken[::SLOW] - late]))
    Phi, _, spread = Transition.of(TRUE.A, TRUE.B_u, TRUE.Q).over(np.diff(order))
    states = [rng.standard_normal(2)]
    for step, root in zip(Phi, np.linalg.cholesky(spread), strict=True):
        states.append(step @ states[-1] + root @ rng.standard_normal(2))
    at, noise = np.array(states), rng.standard_normal((ROWS, 2)) * np.sqrt(np.diag(TRUE.R))
    x = np.full(ROWS, np.nan)
    x[::SLOW] = at[np.searchsorted(order, taken[::SLOW] - late), 0] + noise[::SLOW, 0] + BIAS
    return {"t": taken, "x": x, "v": at[np.searchsorted(order, taken), 1] + noise[:, 1]}


HELD = MultiratePlant(A=[[1, 0.1], [-0.1, 0.9]], B_d=[[0], [0.2]], C=np.eye(2), D=np.diag([0.2, 0.1]), dt=STEP)


def multirate(seed: int) -> Log:
    """x at each third instant and two instants late, with a bias; v at each."""
    rng = np.random.default_rng(seed)
    x, rows = rng.standard_normal(2), np.empty((ROWS, 2))
    for k in range(ROWS):
        rows[k] = x + HELD.D @ rng.standard_normal(2) + [BIAS, 0]
        x = HELD.A @ x + HELD.B_d @ rng.standard_normal(1)
    late = np.full(ROWS, np.nan)
    late[2::SLOW] = rows[:-2:SLOW, 0]
    return {"t": STEP * np.arange(ROWS), "y[0]": late, "y[1]": rows[:, 1]}


GUESS = replace(TRUE, Q=np.diag([0.0, 2]), R=[0.2, 0.05])
WRONG = design(replace(HELD, B_d=2 * HELD.B_d, D=2 * HELD.D), periods=(SLOW, 1), goal="h2", latency=(2, 0))


@dataclass(frozen=True)
class Case:
    """A form with its guess, its logs and the truth."""

    title: str
    log: Callable[[int], Log]
    guess: Any
    given: dict[str, Any]
    truth: tuple[float, ...]


CASES = (
    Case("time stamps", stamped, GUESS, {"biases": ("x",)}, (0.5, 0.04, 0.01, BIAS)),
    Case("late", lambda seed: stamped(seed, LATE), GUESS, {"latencies": {"x": 0.05}, "biases": ("x",)},
         (0.5, 0.04, 0.01, BIAS, LATE)),
    Case("multi-rate", multirate, WRONG, {"biases": ("y[0]",)}, (0.25, 0.04, 0.01, BIAS)),
)  # fmt: skip


def coverage(case: Case, logs: int) -> None:
    """Print it by parameter, and the refusals."""
    hits: list[np.ndarray] = []
    known: list[bool] = []
    names: tuple[str, ...] = ()
    for seed in range(logs):
        data = case.log(seed)
        try:
            best = fit(case.guess, data, **case.given)
        except ReplicationError as error:
            print(f"{case.title}, seed {seed}: {error}")
            continue
        names, (low, high) = best.names, best.intervals.T
        hits.append((low <= case.truth) & (case.truth <= high))
        if case.title == "time stamps":
            low, high = fit(TRUE, data, fixed=names[:3], **case.given).intervals[0]
            known.append(bool(low <= BIAS <= high))
    for name, share in zip(names, np.mean(hits, axis=0), strict=True):
        print(f"{case.title}, {name}: {100 * share:.1f} % of {len(hits)} intervals hold the truth")
    if known:
        print(f"{case.title}, bias[x] with known variances: {100 * np.mean(known):.1f} % of {len(known)}")


def cost() -> None:
    """Seconds of the running filter, a replay and a fit: 4 states, 2 sensors, 5,000 samples, 6 unknowns."""
    springs = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-4, 2, -1, 0], [2, -3, 0, -0.5]])
    plant = NoisyPlant(springs, np.eye(2, 4), Q=[0.01, 0.02, 1, 2], R=[0.01, 0.04], sensors=["a", "b"])
    rng, rows, step = np.random.default_rng(0), [], 0.05
    Phi, _, Q = Transition.of(plant.A, plant.B_u, plant.Q).at(step)
    root, x = np.linalg.cholesky(Q), rng.standard_normal(4)
    for _ in range(5000):
        rows.append(plant.C @ x + np.sqrt(np.diag(plant.R)) * rng.standard_normal(2))
        x = Phi @ x + root @ rng.standard_normal(4)
    data = {"t": step * np.arange(5000), **dict(zip("ab", np.array(rows).T, strict=True))}
    guess = replace(plant, Q=3 * plant.Q, R=plant.R / 2)
    spent, made, observer, y = [], [], StampedKalman(guess), np.array(rows)

    def running() -> np.ndarray:
        return np.array([observer.step(sample, t=t) for t, sample in zip(data["t"], y, strict=True)])

    for work in (running, lambda: replay(StampedKalman(guess), data), lambda: fit(guess, data)):
        began = time.process_time()
        made.append(work())
        spent.append(time.process_time() - began)
    apart = np.abs(made[0] - made[1].estimates).max()
    print(
        f"a replay takes {spent[1] / spent[0]:.2f} times the seconds of the running filter, and differs by {apart:.0e}"
    )
    print(f"a fit of {len(made[2].names)} unknowns takes {spent[2] / spent[1]:.1f} times the seconds of a replay")


def main(logs: int, title: str = "") -> None:
    """Print all, or one form."""
    cost()
    for case in CASES:
        if title in ("", case.title):
            coverage(case, logs)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500, *sys.argv[2:3])

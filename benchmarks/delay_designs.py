"""Delay designs for 1,000 random plants that come first in practice, against closed forms and a shift register.

    python -m benchmarks.delay_designs --plants 1000   measure, a line of JSON each, into delay_designs.jsonl
    python -m benchmarks.delay_designs --table         write delay_designs.md from that file

Integrators, double integrators, biases, slow and fast modes, oscillators, averages, two delays, recycles, each in units
over twelve decades. Late sensors have a closed form: the Riccati equation of the filter without delay, then the one of
a prediction, in whose time the sensors that are still missing count for nothing. The others are compared with the
Kalman filter of a chain of samples. A run that was stopped goes on where it ended.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from benchmarks.clock import append, markdown, processor_seconds, rows_of
from replication.errors import ReplicationError
from replication.estimation.delay import DelayPlant, design, limit
from replication.estimation.validation import Array

ROOT = Path(__file__).parent
RECORD, TABLE = ROOT / "delay_designs.jsonl", ROOT / "delay_designs.md"
AXIS = 1e-9
"""Relative distance from the imaginary axis that counts as on it: there is no solution then."""
SEED, EACH = 32, 10
"""Seed of the plants; every which one has an H-infinity and a mixed design too."""
CLOSED, REGISTER = 1e-4, 2e-3
"""Relative difference that counts as one: from a closed form, and from a chain of samples beyond its own error."""
STEPS, SAMPLES, DIGITS, FINER = 60, 64, 1e-9, 1.05
"""Of a prediction; of the chain in a delay; relative width of a level, and step of the search for it."""


@dataclass(frozen=True)
class Case:
    """A plant in units of its own: x' = A x + A_late x(t - tau) + B d, z = Cz x, y_i = C_i x(t - tau_i) + sigma_i n_i.

    `mean`: the one sensor gives the average over the delay instead.
    """

    family: str
    A: Array
    B: Array
    Cz: Array
    C: Array
    sigma: Array
    late: tuple[float, ...]
    recycle: Array | None = None
    mean: bool = False

    def plant(self, time: float, states: Array, w: float, z: float, y: Array) -> DelayPlant:
        """In other units: numbers of time are `time` times as large, of states `states` times, and so on."""
        n, q, r = len(self.A), len(self.C), self.B.shape[1]
        delays = sorted({delay for delay in self.late if delay > 0.0})
        left = states[:, None] / time
        seen = y[:, None] * self.C / states
        b = np.hstack([left * self.B, np.zeros((n, q))]) / w
        d21 = np.hstack([np.zeros((q, r)), np.diag(self.sigma * y)]) / w
        now = np.array([[delay == 0.0] for delay in self.late])
        terms: dict[str, Any] = {"d21": d21}
        if self.mean:
            terms["c2_spread"] = [seen]
        else:
            terms["c2_delayed"] = [seen * np.array([[late == delay] for late in self.late]) for delay in delays]
        if self.recycle is not None:
            terms["a"] = [left * self.recycle / states]
        return DelayPlant(
            left * self.A / states, tuple(time * tau for tau in delays), b, z * self.Cz / states, seen * now, **terms
        )


def drawn(rng: np.random.Generator) -> tuple[Case, DelayPlant, float, float]:
    """A case, its plant in random units, and by how much these multiply level and rms error."""
    case = FAMILIES[int(rng.integers(len(FAMILIES)))](rng)
    time, w, z = (float(10.0 ** rng.uniform(-6, 6)) for _ in range(3))
    states, y = 10.0 ** rng.uniform(-6, 6, len(case.A)), 10.0 ** rng.uniform(-6, 6, len(case.C))
    return case, case.plant(time, states, w, z, y), z / w, z / w / np.sqrt(time)


def _power(rng: np.random.Generator, low: float, high: float) -> float:
    return float(10.0 ** rng.uniform(low, high))


def _chain(rng: np.random.Generator, order: int, leak: float = 0.0) -> tuple[Array, Array, Array]:
    """Integrators in a row, the last one driven; they leak at a rate."""
    drive = np.zeros((order, 1))
    drive[-1] = 1.0
    return np.diag(np.ones(order - 1), 1) - leak * np.eye(order), drive, np.eye(1, order)


def integrator(rng: np.random.Generator) -> Case:
    """Poles at zero; seen late."""
    order = int(rng.integers(1, 4))
    A, B, C = _chain(rng, order)
    # The bandwidth of the filter in delays: (1 / sigma)^(1 / order).
    return Case("integrators", A, B, C, C, np.array([_power(rng, -1, 2) ** order]), (1.0,))


def slow(rng: np.random.Generator) -> Case:
    """Time constants up to 10^6 delays."""
    order = int(rng.integers(1, 3))
    A, B, C = _chain(rng, order, _power(rng, -6, -1))
    return Case("slow modes", A, B, C, C, np.array([_power(rng, -1, 2) ** order]), (1.0,))


def fast(rng: np.random.Generator) -> Case:
    """A mode faster than the delay in front of a slow one."""
    quick = _power(rng, 0, 1.5)
    A = np.array([[-_power(rng, -6, 0), 1.0], [0.0, -quick]])
    C = np.array([[1.0, 0.0]])
    return Case("fast and slow modes", A, np.array([[0.0], [quick]]), C, C, np.array([_power(rng, -1, 1)]), (1.0,))


def bias(rng: np.random.Generator) -> Case:
    """Position, speed and a bias of the acceleration, or an angle and the bias of its gyro; random walks or slow."""
    drift, size = (0.0 if rng.random() < 0.5 else _power(rng, -6, -1)), _power(rng, -4, 0)
    if rng.random() < 0.5:
        A = np.array([[0.0, 1.0], [0.0, -drift]])
        B = np.diag([_power(rng, -2, 0), size])
    else:
        A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -drift]])
        B = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, size]])
    C = np.eye(1, len(A))
    return Case("biases", A, B, C, C, np.array([_power(rng, -1, 2)]), (1.0,))


def oscillator(rng: np.random.Generator) -> Case:
    """Undamped or hardly damped."""
    rate, damping = _power(rng, -3, 0.7), 0.0 if rng.random() < 0.5 else _power(rng, -6, -1)
    A = np.array([[0.0, rate], [-rate, -2.0 * damping * rate]])
    C = np.array([[1.0, 0.0]])
    return Case("oscillators", A, np.array([[0.0], [1.0]]), C, C, np.array([_power(rng, -1, 1)]), (1.0,))


def two_delays(rng: np.random.Generator) -> Case:
    """Two sensors, the second one later, the first one perhaps at once."""
    order = int(rng.integers(1, 3))
    A, B, C = _chain(rng, order, 0.0 if rng.random() < 0.5 else _power(rng, -4, 0))
    sigma = np.array([_power(rng, -1, 1) ** order for _ in range(2)])
    first = 0.0 if rng.random() < 0.3 else float(rng.uniform(0.1, 0.8))
    return Case("two delays", A, B, C, np.vstack([C, C]), sigma, (first, 1.0))


def average(rng: np.random.Generator) -> Case:
    """The sensor gives the mean over the delay."""
    order = int(rng.integers(1, 3))
    A, B, C = _chain(rng, order, 0.0 if rng.random() < 0.5 else _power(rng, -5, 0))
    return Case("averages", A, B, C, C, np.array([_power(rng, -0.5, 1) ** order]), (1.0,), mean=True)


def recycle(rng: np.random.Generator) -> Case:
    """A state that comes back after the delay, some integrate; seen at once or late."""
    rate = _power(rng, -3, 0)
    A, back = np.array([[-rate]]), np.array([[rate * (1.0 if rng.random() < 0.3 else rng.uniform(-0.9, 0.9))]])
    one = np.eye(1)
    sigma = np.array([_power(rng, -0.5, 1)])
    return Case("recycles", A, one, one, one, sigma, (1.0,), recycle=back)


FAMILIES: tuple[Callable[[np.random.Generator], Case], ...] = (
    integrator, slow, fast, bias, oscillator, two_delays, average, recycle
)  # fmt: skip


def closed_rms(case: Case) -> float:
    """The Kalman filter of all sensors up to the latest delay, then predictions with those that are still in."""
    A, Q, Cz, C = _in_kalman_units(case)
    P = _are(A, _seen(C, case.sigma), Q)
    if P is None:
        raise np.linalg.LinAlgError("no filter")
    for length, kept in _stages(case):
        P = _moved(A, _seen(C, case.sigma, kept), Q, P, length)[-1]
    return float(np.sqrt(np.trace(Cz @ P @ Cz.T)))


def closed_level(case: Case) -> float:
    """The least level at which the same equations, each with + P Cz'Cz P / level^2, have a solution that is bounded."""
    A, Q, Cz, C = _in_kalman_units(case)

    def holds(level: float) -> bool:
        less = Cz.T @ Cz / level**2
        P = _are(A, _seen(C, case.sigma) - less, Q)
        if P is None or np.linalg.eigvalsh(P)[0] < -1e-9 * np.abs(P).max():
            return False
        for length, kept in _stages(case):
            for moved in _moved(A, _seen(C, case.sigma, kept) - less, Q, P, length):
                if not np.linalg.eigvalsh(moved)[0] >= -1e-9 * np.abs(moved).max():
                    return False
                P = moved
        return True

    # From above: far below the least level another solution may pass for the one that is wanted.
    high = 1e3 * float(np.sqrt(np.trace(Cz @ Cz.T)))
    while not holds(high):
        high *= 2.0
    while holds(high / FINER):
        high /= FINER
    low = high / FINER
    while high - low > DIGITS * high:
        middle = (low + high) / 2.0
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def register_rms(case: Case, samples: int) -> float:
    """The Kalman filter of a chain of `samples` per delay: exact steps of the plant without recycle, means of y.

    The recycle and the average take their integrals by the trapezoidal rule; two chains tell the error.
    """
    n, h = len(case.A), 1.0 / samples
    joint = np.zeros((2 * n, 2 * n))
    joint[:n, :n], joint[:n, n:] = case.A, np.eye(n)
    step = scipy.linalg.expm(joint * h)
    F, push = step[:n, :n], step[:n, n:]
    noise = scipy.linalg.expm(np.block([[-case.A, case.B @ case.B.T], [np.zeros((n, n)), case.A.T]]) * h)
    Q = F @ noise[:n, n:]
    size = n * (samples + 1)
    drift, process = np.zeros((size, size)), np.zeros((size, size))
    drift[:n, :n] = F
    if case.recycle is not None:
        drift[:n, -n:] += push @ case.recycle / 2.0
        drift[:n, -2 * n : -n] += push @ case.recycle / 2.0
    drift[n:, :-n] = np.eye(size - n)
    process[:n, :n] = (Q + Q.T) / 2.0
    weights = np.zeros(samples + 1)
    if case.mean:
        weights[:] = h
        weights[[0, -1]] = h / 2.0
    else:
        weights[-1] = 1.0
    H = np.kron(weights[None, :], case.C)
    P = scipy.linalg.solve_discrete_are(drift.T, H.T, process + 1e-300 * np.eye(size), np.diag(case.sigma**2) / h)
    # Half a sample later on the average than the information in y: the mean of both errors.
    gain = np.linalg.solve(H @ P @ H.T + np.diag(case.sigma**2) / h, H @ P).T
    after = P - gain @ H @ P
    both = [np.trace(case.Cz @ part[:n, :n] @ case.Cz.T) for part in (P, after)]
    return float(np.sqrt(np.mean(both)))


def _stages(case: Case) -> list[tuple[float, Any]]:
    """Lengths of the predictions, and which sensors are still in."""
    late = np.array(case.late)
    cuts = sorted({0.0, *case.late}, reverse=True)
    return [(cut - following, late < cut) for cut, following in pairwise(cuts)]


def _in_kalman_units(case: Case) -> tuple[Array, Array, Array, Array]:
    """A, B B', Cz, C where the filter of all sensors has variances of one."""
    P = _are(case.A, _seen(case.C, case.sigma), case.B @ case.B.T)
    scale = np.ones(len(case.A)) if P is None else 1.0 / np.sqrt(np.diag(P))
    B = scale[:, None] * case.B
    return scale[:, None] * case.A / scale, B @ B.T, case.Cz / scale, case.C / scale


def _seen(C: Array, sigma: Array, kept: Any = slice(None)) -> Array:
    return np.asarray(C[kept].T @ (C[kept] / sigma[kept, None] ** 2))


def _are(A: Array, G: Array, Q: Array) -> Array | None:
    """The stabilising solution of A P + P A' - P G P + Q = 0."""
    n, matrix = len(A), np.block([[A.T, -G], [-Q, -A]])
    roots = np.linalg.eigvals(matrix)
    if np.any(np.abs(roots.real) <= AXIS * np.abs(roots)):
        return None
    _, vectors, stable = scipy.linalg.schur(matrix, sort="lhp")
    if stable != n:
        return None
    P = vectors[n:, :n] @ np.linalg.inv(vectors[:n, :n])
    return np.asarray((P + P.T) / 2.0)


def _moved(A: Array, G: Array, Q: Array, P: Array, length: float) -> list[Array]:
    """The solution of P' = A P + P A' - P G P + Q after each of STEPS steps."""
    n, moved = len(A), []
    step = scipy.linalg.expm(np.block([[-A.T, G], [Q, A]]) * (length / STEPS))
    for _ in range(STEPS):
        both = step @ np.vstack([np.eye(n), P])
        P = both[n:] @ np.linalg.inv(both[:n])
        P = (P + P.T) / 2.0
        moved.append(P)
    return moved


def measured(index: int, *, hinf: bool) -> dict[str, Any]:
    """One plant: what the library says, beside what is known otherwise, in the units of the case."""
    case, plant, level_unit, rms_unit = drawn(np.random.default_rng([SEED, index]))
    start = processor_seconds()
    row: dict[str, Any] = {"index": index, "family": case.family, "errors": []}
    if case.mean or case.recycle is not None:
        row["register"] = [register_rms(case, SAMPLES // 2), register_rms(case, SAMPLES)]
    else:
        row["closed level"], row["closed rms"] = closed_level(case), closed_rms(case)

    def attempt(what: str, compute: Callable[[], dict[str, Any]]) -> None:
        begin = processor_seconds()
        try:
            row.update(compute())
        except ReplicationError as error:
            row["errors"].append(f"{what}: {type(error).__name__}: {error}")
        except Exception as error:  # noqa: BLE001 - the bar is that there is none of these
            row["errors"].append(f"{what}: CRASH {type(error).__name__}: {error}")
        else:
            row[f"{what} seconds"] = processor_seconds() - begin

    def levels() -> dict[str, Any]:
        least = limit(plant)
        return {"limit": least.level / level_unit, "settled": least.moving <= 1e-3 * least.level}

    def designed(goal: str) -> dict[str, Any]:
        result = design(plant, goal=goal)
        gain, rms = result.value / level_unit, float(result.fact("rms error of z").value) / rms_unit
        if goal == "mixed":
            return {"mixed": (gain, rms)}
        if goal == "hinf":
            proved = float(result.fact("least level").value) / level_unit
            exact = result.bracket.lower / level_unit
            return {"proved": gain, "hinf rms": rms, "least proved": proved, "exact": exact}
        least_rms = result.fact("least rms error of any observer").value
        return {
            "rms": rms,
            "least rms": least_rms if isinstance(least_rms, str) else least_rms / rms_unit,
            "gain": gain,
        }

    attempt("limit", levels)
    for goal in ("h2", "hinf", "mixed")[: 3 if hinf else 1]:
        attempt(goal, partial(designed, goal))
    row["seconds"] = processor_seconds() - start
    return row


def faults(row: dict[str, Any]) -> list[str]:
    """What of a row is wrong: a crash, a number off, a least one that is not."""
    wrong = [error for error in row["errors"] if "CRASH" in error or "LinAlg" in error]
    for name, form in (("limit", "closed level"), ("rms", "closed rms"), ("least rms", "closed rms")):
        value, known = row.get(name), row.get(form)
        if known is None or not isinstance(value, float) or (name == "limit" and not row["settled"]):
            continue
        if abs(value / known - 1.0) > CLOSED:
            wrong.append(f"{name} {value:.6g}, closed form {known:.6g}")
    if "register" in row and "rms" in row:
        coarse, fine = row["register"]
        if abs(row["rms"] / fine - 1.0) > REGISTER + 2.0 * abs(coarse / fine - 1.0):
            wrong.append(f"rms {row['rms']:.6g}, chain of samples {fine:.6g} ({coarse:.6g} with half of them)")
    least = row.get("limit") if row.get("settled") else None
    for name in ("proved", "least proved", "gain"):
        if least is not None and name in row and least > row[name] * (1.0 + CLOSED):
            wrong.append(f"limit {least:.6g} above {name} {row[name]:.6g}")
    if {"mixed", "exact", "gain"} <= row.keys():
        for what, value, ends in zip(
            ("gain", "rms"), row["mixed"], ((row["proved"], row["gain"]), (row["hinf rms"], row["rms"])), strict=True
        ):
            if not value <= max(ends) * (1.0 + CLOSED):
                wrong.append(f"{what} of mixed {value:.6g}, of the pure designs {ends[0]:.6g} and {ends[1]:.6g}")
    if isinstance(row.get("least rms"), float) and row["least rms"] > row["rms"] * (1.0 + CLOSED):
        wrong.append(f"least rms {row['least rms']:.6g} above rms {row['rms']:.6g}")
    return wrong


def table(rows: list[dict[str, Any]]) -> str:
    """What was measured, family by family, and each plant that is wrong or refused."""

    def cells(family: str) -> list[str]:
        part = [row for row in rows if row["family"] == family]
        refused = {
            what: str(sum(any(error.startswith(what) for error in row["errors"]) for row in part))
            for what in ("limit", "h2", "hinf")
        }
        known = [str(sum(row.get("settled") is kind for row in part)) for kind in (True, False)]
        done = {what: str(sum(what in row for row in part)) for what in ("rms", "proved")}
        limits, wrong = ", ".join([*known, refused["limit"]]), sum(bool(faults(row)) for row in part)
        h2, hinf = f"{done['rms']}, {refused['h2']}", f"{done['proved']}, {refused['hinf']}"
        return [family, str(len(part)), limits, h2, hinf, str(wrong)]

    head = "family", "plants", "limit: known, open, refused", "h2: known, refused", "hinf: proved, refused", "wrong"
    lines = [
        "# Delay designs for plants that come first",
        "",
        f"{len(rows)} plants, seed {SEED}; written by `python -m benchmarks.delay_designs --table`.",
        "",
        *markdown(head, map(cells, sorted({row["family"] for row in rows}))),
    ]
    for title, of in (("Wrong", faults), ("Refused, with the cause", lambda row: row["errors"])):
        lines += ["", f"## {title}", ""]
        told = [f"- {row['index']} ({row['family']}): {what}" for row in rows for what in of(row)]
        lines += told or ["None."]
    seconds = [row["seconds"] for row in rows]
    lines += ["", f"Processor time of a plant: median {np.median(seconds):.2g} s, most {max(seconds):.2g} s."]
    if ratios := [row["mixed seconds"] / row["h2 seconds"] for row in rows if {"mixed", "rms"} <= row.keys()]:
        times = f"median {np.median(ratios):.2g}, most {max(ratios):.2g}"
        lines += [f"Of {len(ratios)} mixed designs, in times of that of h2: {times}."]
    known = sum("closed rms" in row for row in rows)
    lines += [f"{known} plants have a closed form; numbers may differ from it by {CLOSED:.0e}.", ""]
    return "\n".join(lines)


def recorded() -> list[dict[str, Any]]:
    """The rows of the file, by index."""
    return sorted(rows_of(RECORD), key=lambda row: row["index"])


def main() -> None:
    """Measure or tabulate."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--plants", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    done = {row["index"] for row in recorded()}
    for index in range(options.first, options.plants):
        if index not in done:
            append(RECORD, measured(index, hinf=index % EACH == 0))
    if options.table:
        TABLE.write_text(table(recorded()))


if __name__ == "__main__":
    main()

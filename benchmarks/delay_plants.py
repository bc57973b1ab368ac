"""Levels and cost of observers for delay plants with noise: public examples, limits of causality, random plants.

    python -m benchmarks.delay_plants --random 100     measure, a line of JSON each, into benchmarks/delay_plants.jsonl
    python -m benchmarks.delay_plants --tables         write the tables of docs/methods/delay-noise.md from that file

A run that was stopped goes on where it ended. Seconds are those of the processor.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.clock import append, markdown, processor_seconds, rows_of
from replication.errors import ReplicationError
from replication.estimation.delay import DelayPlant, delay_system, exact_gain, limit, minimum_gain
from replication.estimation.delay.general.cone import line_form
from replication.estimation.delay.general.synthesis import degree_of, least_level, observer_at
from replication.estimation.delay.sos.certificate import certificate_at
from replication.estimation.delay.sos.cone import DegreeRule
from replication.estimation.delay.sos.observer import error_system, injection
from replication.estimation.delay.sos.operators import evaluate, observer_gains
from replication.estimation.delay.spectrum import grid
from replication.ownplant.files import read_plant

ROOT = Path(__file__).parents[1]
RECORD, PAGE = ROOT / "benchmarks" / "delay_plants.jsonl", ROOT / "docs" / "methods" / "delay-noise.md"
EXAMPLES = (("late", "1.808", 5), ("echo", "1.0448", 8))
"""Plant files of docs/examples, levels published in comments of PIETOOLS' library of delay examples, degrees."""
LATE = (0.1, 0.3, 1.0, 3.0)
NOISES = (0.001, 0.01, 0.1)
SIZES = ((2, 1, 1), (2, 2, 1), (4, 2, 1), (4, 2, 3), (6, 2, 1), (10, 1, 1), (10, 2, 1), (20, 1, 1))
"""States, delays and measurements of the plants whose cost is measured."""
DEGREE, MARGIN, ROWS, WIDTH = 6, 0.05, 46, 1e-3
"""Of the random plants: degree, margin, most rows of the storage, relative width of the exact gain."""


def random_plant(rng: np.random.Generator) -> DelayPlant:
    """One to four states, one to three delays, noise; some unstable, some with late outputs, noise or averages."""
    n, delays = int(rng.integers(1, 5)), np.cumsum(rng.uniform(0.1, 0.6, int(rng.integers(1, 4))))
    p, q = int(rng.integers(1, 3)), min(int(rng.integers(1, 3)), n)
    r = q + int(rng.integers(1, 3))

    def sometimes(share: float, size: float, *shape: int) -> Any:
        return rng.normal(size=shape) * size * (rng.random() < share)

    late = rng.random() < 0.5
    noise = np.hstack([np.zeros((q, r - q)), rng.uniform(0.2, 1.0, q) * np.eye(q)])
    drive = np.hstack([rng.normal(size=(n, r - q)), sometimes(0.3, 0.3, n, q)])
    return DelayPlant(
        a0=rng.normal(size=(n, n)) / np.sqrt(n) - rng.uniform(-0.3, 1.5) * np.eye(n),
        delays=tuple(delays),
        b=drive,
        c10=rng.normal(size=(p, n)),
        c2=sometimes(0.5 if late else 1.0, 1.0, q, n),
        a=tuple(rng.normal(size=(n, 1)) @ rng.normal(size=(1, n)) / n for _ in delays),
        b_delayed=tuple(sometimes(0.15, 0.3, n, r) for _ in delays),
        c2_delayed=tuple(sometimes(0.5 * late, 1.0, q, n) for _ in delays),
        d11=sometimes(0.2, 0.3, p, r),
        d21=noise,
        d21_delayed=tuple(sometimes(0.15, 0.3, q, r) for _ in delays),
        a_spread=tuple(sometimes(0.1, 0.3, int(rng.integers(1, 4)), n, n) for _ in delays),
    )


def late_sensor(delay: float) -> DelayPlant:
    """An integrator whose noisy position arrives late: no observer knows what happened since."""
    return DelayPlant([[0.0]], (delay,), [[1.0, 0.0]], [[1.0]], [[0.0]], c2_delayed=([[1.0]],), d21=[[0.0, 1.0]])  # type: ignore[arg-type]


def cart() -> DelayPlant:
    """A cart whose brake acts late: the speed is wanted, the position is measured, without noise."""
    late = [[[0.0, 0.0], [0.0, -0.5]]]
    return delay_system([[0.0, 1.0], [0.0, -0.1]], late, [0.4], np.diag([0.05, 1.0]), [[0.0, 1.0]], [[1.0, 0.0]])


def noisy(system: DelayPlant, noise: float) -> DelayPlant:
    """The same with noise of its own on each measurement."""
    q, free = system.measurements, np.zeros((system.states, system.measurements))
    silent = np.zeros((q, system.inputs))
    b, d21 = np.hstack([system.b, free]), np.hstack([silent, noise * np.eye(q)])
    return DelayPlant(system.a0, system.delays, b, system.c10, system.c2, system.a, system.c1, d21=d21)


def sized_plant(states: int, delays: int, measurements: int) -> DelayPlant:
    """A stable random plant of a size, all of whose states act with all delays."""
    rng = np.random.default_rng([states, delays, measurements])
    n, q = states, measurements
    return DelayPlant(
        a0=rng.normal(size=(n, n)) / n - np.eye(n),
        delays=tuple(np.sort(rng.uniform(0.2, 1.5, delays))),
        b=np.hstack([rng.normal(size=(n, 2)), np.zeros((n, q))]),
        c10=rng.normal(size=(1, n)),
        c2=rng.normal(size=(q, n)),
        a=tuple(rng.normal(size=(n, n)) / n / 2.0 for _ in range(delays)),
        d21=np.hstack([np.zeros((q, 2)), np.eye(q)]),
    )


def seconds(call: Callable[[], Any]) -> tuple[Any, float]:
    """What it returns, and the seconds of the processor that it took."""
    start = processor_seconds()
    return call(), processor_seconds() - start


def measured(plant: DelayPlant, degree: int, margin: float) -> dict[str, Any]:
    """Levels, exact gain and seconds of one plant; what failed by its message."""
    row: dict[str, Any] = {"n": plant.states, "K": plant.delay_count, "q": plant.measurements, "degree": degree}
    try:
        exact, row["limit seconds"] = seconds(lambda: limit(plant))
        row |= {"limit": exact.level, "moving": exact.moving, "smoother": exact.smoother}
    except ReplicationError as error:
        row["refused"] = f"{type(error).__name__}: {error}"
        return row
    try:
        least, row["least seconds"] = seconds(lambda: least_level(plant, degree))
        row["least"] = least.level
        target = least.level * (1.0 + margin)
        (proof, observer), row["observer seconds"] = seconds(lambda: observer_at(plant, target, degree, least.scaling))
        row["proved"] = proof.level
        gain, row["gain seconds"] = seconds(lambda: exact_gain(observer, WIDTH))
        row |= {"gain": gain.lower, "gain above": gain.upper}
    except ReplicationError as error:
        row["open"] = f"{type(error).__name__}: {error}"
    return row


def noise_gain(system: DelayPlant, noise: float, order: int = 24) -> dict[str, Any]:
    """The gain, with noise, of the observer designed without; and the least level of observers that know of it."""
    least = minimum_gain(system, 3, DegreeRule.BESSEL)
    operators = observer_gains(certificate_at(system, least.gamma * (1.0 + MARGIN), 3, DegreeRule.BESSEL))
    net = grid(order)
    values, error = evaluate(operators, net.points), error_system(system, operators, order)
    inject, eye, worst = injection(values, net), np.eye(len(error.A)), 0.0
    for omega in np.concatenate([[0.0], np.logspace(-2, 4, 400)]):
        ages = np.exp(1j * omega * net.points[None, :] * np.array(system.delays)[:, None]).ravel()
        seen = noise * (inject @ np.kron(ages[:, None], np.eye(system.measurements)))
        answer = error.C @ np.linalg.solve(1j * omega * eye - error.A, np.hstack([error.B, seen]))
        worst = max(worst, float(np.linalg.norm(answer, 2)))
    found = measured(noisy(system, noise), DEGREE, MARGIN)
    return {"noise": noise, "without noise": least.gamma, "ignored": worst, **found}


def tasks(count: int) -> dict[str, Callable[[], dict[str, Any]]]:
    """What is measured, by name."""
    found: dict[str, Callable[[], dict[str, Any]]] = {}
    for name, _, degree in EXAMPLES:
        plant = DelayPlant(**{key.lower(): value for key, value in _file(name).items()})
        found[f"example {name}"] = lambda plant=plant, degree=degree: measured(plant, degree, 0.01)
    for delay in LATE:
        found[f"late {delay}"] = lambda delay=delay: {"delay": delay, **measured(late_sensor(delay), DEGREE, MARGIN)}
    for noise in NOISES:
        found[f"noise {noise}"] = lambda noise=noise: noise_gain(cart(), noise)
    for size in SIZES:
        plant = sized_plant(*size)
        found[f"size {size}"] = lambda plant=plant: measured(plant, degree_of(plant), MARGIN)
    seed, taken = 0, 0
    while taken < count:
        plant = random_plant(np.random.default_rng(seed))
        form = line_form(plant)
        if plant.states + DEGREE * form.width <= ROWS:
            found[f"random {seed}"] = lambda plant=plant: measured(plant, DEGREE, MARGIN)
            taken += 1
        seed += 1
    return found


def _file(name: str) -> Any:
    return read_plant(ROOT / "docs" / "examples" / f"{name}.toml", "delay").values


def recorded() -> dict[str, dict[str, Any]]:
    """What was measured so far."""
    return {row.pop("name"): row for row in rows_of(RECORD)}


def above(row: dict[str, Any]) -> str:
    """By how much the least level exceeds that of any observer."""
    return f"{row['least'] / row['limit'] - 1:.1e}"


def total(row: dict[str, Any]) -> str:
    """Seconds of all that was computed."""
    return f"{sum(value for name, value in row.items() if name.endswith('seconds')):.1f}"


COLUMNS: dict[str, dict[str, str | Callable[[dict[str, Any]], str]]] = {
    "examples": {
        "published": "published", "degree": "degree", "least level": "{least:.6f}",
        "least of any observer": "{limit:.6f}", "no estimator below": "{smoother:.6f}", "excess": above,
        "CPU (s)": total,
    },
    "late": {
        "delay (s)": "delay", "least level": "{least:.4f}", "least of any observer": "{limit:.4f}",
        "no estimator below": "{smoother:.4f}",
    },
    "noise": {
        "noise": "noise", "level promised without noise": "{without noise:.4f}",
        "gain of that observer with noise": "{ignored:.4g}", "least level with noise": "{least:.4f}",
    },
    "size": {
        "states": "n", "delays": "K", "measurements": "q", "degree": "degree", "excess": above,
        "least level, CPU (s)": "{least seconds:.1f}", "all, CPU (s)": total,
    },
}  # fmt: skip
"""Of each table of the page: the key of a number, how it is written, or what is made of a row."""


def tables(rows: dict[str, dict[str, Any]]) -> dict[str, str]:
    """The tables of the page as Markdown, by the name of their place."""
    kinds = {kind: [row for name, row in rows.items() if name.startswith(kind)] for kind in (*COLUMNS, "random")}
    kinds["examples"] = [{"published": level, **rows[f"example {name}"]} for name, level, _ in EXAMPLES]

    def cell(row: dict[str, Any], column: str | Callable[[dict[str, Any]], str]) -> str:
        if not isinstance(column, str):
            return column(row)
        return column.format_map(row) if "{" in column else str(row[column])

    made = {
        kind: markdown(
            list(columns), [[cell(row, column) for column in columns.values()] for row in kinds[kind]], " ---: "
        )
        for kind, columns in COLUMNS.items()
    }
    return {kind: "\n".join(lines) for kind, lines in {**made, "random": _random(kinds["random"])}.items()}


def _random(rows: list[dict[str, Any]]) -> list[str]:
    """The statistics of the random plants."""
    done = [row for row in rows if "gain" in row]
    excess = np.array([row["least"] / row["limit"] - 1.0 for row in done])
    facts = {
        "plants": len(rows),
        "refused with a reason": sum("refused" in row for row in rows),
        "exact gain left open": sum("open" in row for row in rows),
        "excess over the exact level, median": f"{np.median(excess):.1e}",
        "excess at most": f"{excess.max():.1e}",
        "levels below the exact one by 1e-5 or more": int(np.sum(excess < -1e-5)),
        "exact gains above the proved level": sum(row["gain"] > row["proved"] for row in done),
    }
    return ["| | |", "| --- | ---: |", *(f"| {what} | {value} |" for what, value in facts.items())]


def main() -> None:
    """Measure what is missing, or write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--random", type=int, default=100, metavar="N", help="how many random plants")
    parser.add_argument("--tables", action="store_true", help="write the tables, measure nothing")
    chosen = parser.parse_args()
    if not chosen.tables:
        known = recorded()
        for name, task in tasks(chosen.random).items():
            if name not in known:
                append(RECORD, {"name": name, **task()})
        return
    text = PAGE.read_text()
    for place, table in tables(recorded()).items():
        begin, end = f"<!-- {place}: begin -->", f"<!-- {place}: end -->"
        head, _, rest = text.partition(begin)
        text = f"{head}{begin}\n\n{table}\n\n{end}{rest.partition(end)[2]}"
    PAGE.write_text(text)


if __name__ == "__main__":
    main()

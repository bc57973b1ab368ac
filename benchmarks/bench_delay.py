"""Cost of the observer synthesis for Example 4 of the delay paper, cell by cell of its Table I.

    python benchmarks/bench_delay.py                 cells with n·K up to 10, beside the plain cvxpy formulation
    python benchmarks/bench_delay.py --largest 25    more cells
    python benchmarks/bench_delay.py --full bessel   every cell by the small cone, with n = K = 10 that is not published
    python benchmarks/bench_delay.py --full total    every published cell by the full cone (hours on a small machine)

`--full` runs each cell in a process of its own and appends what it measured to delay_full.jsonl, so that it can be
stopped and taken up again; it then writes delay_full.md from that file. Remove a line of the file to repeat its cell.
The small cone gives a certificate that is rewritten as one of the full cone of degree 1 and checked on its equalities.
Seconds are those of assembly and solver together; the published seconds are of another machine.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import cvxpy

from papers.peet2019 import data, scaling
from papers.peet2019.claims.cost import FROM_PRODUCT, exponent, published
from replication.estimation.delay import DegreeRule
from replication.estimation.delay.sdp import Program

HERE = Path(__file__).parent
MEASURED = HERE / "delay_full.jsonl"
TABLE = HERE / "delay_full.md"
CONES = {
    DegreeRule.BESSEL.value: "The small cone, one moment: a certificate, with its residual in the full program",
    DegreeRule.TOTAL.value: "The full cone of degree 1",
}
PLAIN_LARGEST = 6
"""Beyond this product the plain formulation takes minutes and gigabytes."""
SECONDS_LIMIT = 7200.0
BYTES_LIMIT = 10 * 10**9


@dataclass(frozen=True)
class Cell:
    """One run of a cell: seconds by the clock and of the processor, peak memory [GB], and what came out.

    cone: the rule of the cone, total or bessel; residual: of a certificate of the small cone, in the full program.
    A run that failed or was stopped has no equalities, CPU seconds, peak and γ. load is the machine's load average
    when the run ended: with more load than processors, only CPU seconds compare.
    """

    cone: str
    states: int
    delays: int
    equalities: int | None
    seconds: float
    cpu_seconds: float | None
    peak: float | None
    gamma: float | None
    outcome: str
    threads: int
    load: float
    processors: int
    machine: str
    date: str
    residual: float | None


def plain_seconds(task: Program) -> float:
    """Seconds of the same program written with cvxpy variables and solved by its default route through Clarabel."""
    level = cvxpy.Variable(task.linear, nonneg=True)
    blocks = [cvxpy.Variable((size, size), PSD=True) for size in task.blocks]
    vector = cvxpy.hstack([level, *(cvxpy.vec(block, order="C") for block in blocks)])
    problem = cvxpy.Problem(cvxpy.Minimize(task.c @ vector), [task.a @ vector == task.b])
    start = time.perf_counter()
    problem.solve(solver=cvxpy.CLARABEL)
    return time.perf_counter() - start


def measured(cone: str, states: int, delays: int, threads: int) -> Cell:
    """Solve one cell in this process. Raises what the solver raises."""
    wall, cpu = time.perf_counter(), time.process_time()
    small = cone == DegreeRule.BESSEL
    level = scaling.SMALL_LEVEL if small else scaling.level_of(states, delays)
    if small:
        found = scaling.small_cone_cost(states, delays, scaling.SMALL_LEVEL, threads)
    else:
        found = scaling.cost(states, delays, level, threads)
    seconds, cpu_seconds = time.perf_counter() - wall, time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    verb = "minimised" if level is None else "certified"
    outcome = f"{verb}, {found['solver']['status']}, {found['solver']['iterations']} iterations"
    return Cell(
        cone=cone,
        states=states,
        delays=delays,
        equalities=found["equalities"],
        seconds=seconds,
        cpu_seconds=cpu_seconds,
        peak=peak,
        gamma=found["gamma"],
        outcome=outcome,
        residual=found["full"]["residual"] if small else None,
        **_conditions(threads),
    )


def _conditions(threads: int) -> dict[str, Any]:
    """Under what a run was measured."""
    return {
        "threads": threads,
        "load": os.getloadavg()[0],
        "processors": os.cpu_count() or 1,
        "machine": _machine(),
        "date": datetime.now(UTC).date().isoformat(),
    }


def _machine() -> str:
    """Name of the processor."""
    for line in Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []:
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def isolated(cone: str, states: int, delays: int, threads: int) -> Cell:
    """One cell in a process of its own with bounded time and memory; a cell that fails is recorded as failed."""
    command = [sys.executable, __file__, "--cell", cone, str(states), str(delays), "--threads", str(threads)]
    start = time.perf_counter()
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS_LIMIT, check=False)
    except subprocess.TimeoutExpired:
        failure = f"stopped after {SECONDS_LIMIT:.0f} s"
    else:
        if answer.returncode == 0:
            return Cell(**json.loads(answer.stdout.splitlines()[-1]))
        said = (answer.stderr.strip() or "no message").splitlines()[-1]
        failure = f"failed with exit code {answer.returncode}: {said}"
    return Cell(
        cone=cone,
        states=states,
        delays=delays,
        equalities=None,
        seconds=time.perf_counter() - start,
        cpu_seconds=None,
        peak=None,
        gamma=None,
        outcome=failure,
        residual=None,
        **_conditions(threads),
    )


def recorded() -> list[Cell]:
    """The cells measured so far, in the order of their product."""
    lines = MEASURED.read_text().splitlines() if MEASURED.exists() else []
    return sorted((Cell(**json.loads(line)) for line in lines), key=lambda c: (c.states * c.delays, c.states))


def solved(cells: list[Cell]) -> list[Cell]:
    """The cells that came to an end and are large enough for the exponent."""
    return [cell for cell in cells if cell.gamma is not None and cell.states * cell.delays >= FROM_PRODUCT]


def _text(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def table(cells: list[Cell]) -> str:
    """The measured cells as a Markdown table."""
    lines = [
        "| n | K | equalities | clock [s] | CPU [s] | printed [s] | peak [GB] | γ | residual | outcome | CPUs | load |",
        "|--:|--:|--:|--:|--:|--:|--:|--:|--:|:--|--:|--:|",
    ]
    for c in cells:
        fields = (
            *(str(c.states), str(c.delays), _text(c.equalities, "d"), f"{c.seconds:.2f}", _text(c.cpu_seconds, ".2f")),
            *(data.seconds(c.states, c.delays), _text(c.peak, ".2f"), _text(c.gamma, ".2e"), _text(c.residual, ".0e")),
            *(c.outcome, str(c.threads), f"{c.load:.1f}"),
        )
        lines.append(f"| {' | '.join(fields)} |")
    return "\n".join(lines) + "\n"


def growth(cells: list[Cell]) -> str:
    """The exponents of growth in n·K, in our seconds and in the published ones of the same cells."""
    chosen = [cell for cell in solved(cells) if data.seconds(cell.states, cell.delays) != "N/A"]
    if len({c.states * c.delays for c in chosen}) < 2:
        return f"No exponent of growth: fewer than two products n·K ≥ {FROM_PRODUCT} are solved.\n"
    cpu = exponent([(c.states * c.delays, c.cpu_seconds) for c in chosen if c.cpu_seconds is not None])
    clock = exponent([(c.states * c.delays, c.seconds) for c in chosen])
    printed = exponent([(c.states * c.delays, float(data.seconds(c.states, c.delays))) for c in chosen])
    return (
        f"Exponent of growth in n·K over the {len(chosen)} solved cells with n·K ≥ {FROM_PRODUCT}: {cpu:.2f} in CPU"
        f" seconds, {clock:.2f} by the clock; {printed:.2f} in the published seconds of the same cells.\n"
    )


def total_seconds(cells: list[Cell]) -> str:
    """CPU seconds of all published cells together."""
    chosen = [
        cell for cell in cells if cell.cpu_seconds is not None and data.seconds(cell.states, cell.delays) != "N/A"
    ]
    used = sum(cell.cpu_seconds or 0.0 for cell in chosen)
    return f"{len(chosen)} of {len(published())} published cells, {used:.0f} CPU seconds together.\n"


def page(cells: list[Cell]) -> str:
    """The committed page: for each cone the table, the sum and the growth."""
    machines = sorted({f"{c.machine}, {c.processors} processors, {c.date}" for c in cells})
    lines = [
        "# Example 4 of the delay paper, measured\n",
        "Written by `benchmarks/bench_delay.py --full` from `delay_full.jsonl`. CPU seconds are those of all",
        "threads; where the load exceeds the number of processors, the clock also measures other work.\n",
        f"Machine: {'; '.join(machines)}.\n",
    ]
    for cone, title in CONES.items():
        chosen = [cell for cell in cells if cell.cone == cone]
        lines += [f"## {title}\n", table(chosen), total_seconds(chosen), growth(chosen)]
    return "\n".join(lines)


def published_cells(largest: int) -> list[tuple[int, int]]:
    """Cells (n, K) of Table I up to a product, smallest product first."""
    cells = [(n, k) for k in data.DELAY_COUNTS for n in data.STATES if n * k <= largest]
    return sorted(cells, key=lambda cell: (cell[0] * cell[1], cell[0]))


def cells_of(cone: str) -> list[tuple[int, int]]:
    """The cells (n, K) to measure; the small cone also takes the one that the paper leaves out."""
    cells = published_cells(int(data.LARGEST_PRODUCT))
    return [*cells, (data.STATES[-1], data.DELAY_COUNTS[-1])] if cone == DegreeRule.BESSEL else cells


def run_full(cone: str, threads: int) -> None:
    """Measure every cell that is not in the file yet, one after the other, and write the table."""
    done = {(cell.cone, cell.states, cell.delays) for cell in recorded()}
    for states, delays in cells_of(cone):
        if (cone, states, delays) not in done:
            cell = isolated(cone, states, delays, threads)
            with MEASURED.open("a") as file:
                file.write(json.dumps(asdict(cell)) + "\n")
            TABLE.write_text(page(recorded()))
            print(f"n = {states}, K = {delays}: {cell.seconds:.2f} s, {cell.outcome}", flush=True)
    TABLE.write_text(page(recorded()))


def run_small(largest: int, threads: int) -> None:
    """Measure the small cells beside the plain formulation, and print them."""
    cells = []
    for n, k in published_cells(largest):
        cell = measured(DegreeRule.TOTAL.value, n, k, threads)
        cells.append(cell)
        small = n * k <= PLAIN_LARGEST and scaling.level_of(n, k) is None
        plain = f", plain cvxpy {plain_seconds(scaling.cost_program(n, k, None)):.2f} s" if small else ""
        print(f"n = {n}, K = {k}: {cell.seconds:.2f} s{plain}", flush=True)
    print(table(cells))
    print(growth(cells))


def main() -> None:
    """Choose what to measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=10, help="largest product n·K")
    parser.add_argument("--full", choices=CONES, help="every cell by one of the cones, resumable")
    parser.add_argument("--cell", nargs=3, metavar=("CONE", "n", "K"), help="one cell, printed as JSON")
    parser.add_argument("--threads", type=int, default=1, help="threads of SDPA")
    chosen = parser.parse_args()
    if chosen.cell:
        resource.setrlimit(resource.RLIMIT_DATA, (BYTES_LIMIT, BYTES_LIMIT))
        cone, states, delays = chosen.cell
        print(json.dumps(asdict(measured(cone, int(states), int(delays), chosen.threads))))
    elif chosen.full:
        run_full(chosen.full, chosen.threads)
    else:
        run_small(chosen.largest, chosen.threads)


if __name__ == "__main__":
    main()

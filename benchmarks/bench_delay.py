"""Cost of the observer synthesis for Example 4 of the delay paper, cell by cell of its Table I.

    python benchmarks/bench_delay.py --full bessel               every cell by the small cone, n = K = 10 included
    python benchmarks/bench_delay.py --full total                every published cell by the full cone (hours)
    python benchmarks/bench_delay.py --full plain --largest 10   the same program through cvxpy and Clarabel
    python benchmarks/bench_delay.py --seconds                   CPU seconds of assembly and solver apart, of all tables

Each cell runs in a process of its own, and what was measured is appended to papers/peet2019/full_run.jsonl, so that a
run can be stopped and taken up again; delay_full.md is written from that file. Remove a line of it to repeat its cell.
The small cone gives a certificate that is rewritten as one of the full cone of degree 1 and checked on its equalities.
Seconds are those of assembly and solver together; the published seconds are of another machine.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import cvxpy

from benchmarks.clock import append, machine, markdown, processor_seconds
from papers.peet2019.claims.cost import FROM_PRODUCT, exponent
from papers.peet2019.experiments import scaling
from papers.peet2019.method import lmi_gain, pade_model
from papers.peet2019.printed import DATA, DEGREES, DELAY_COUNTS, EXAMPLES, STATES, published
from papers.peet2019.printed import seconds as printed_seconds
from replication.estimation.conic.program import Program, Solution
from replication.estimation.conic.sdpa import solve_sdpa
from replication.estimation.delay import DegreeRule, DelayPlant, delay_system
from replication.estimation.delay.sos.certificate import STATED_GAP, solved
from replication.estimation.delay.sos.synthesis import assemble, program, reduced
from replication.estimation.delay.units import natural_units

PLAIN = "plain"
"""The full cone of degree 1, written with cvxpy and given to Clarabel: the straightforward way."""
TABLE = Path(__file__).parent / "delay_full.md"
CONES = {
    DegreeRule.BESSEL.value: "The small cone, one moment: a certificate, with its residual in the full program",
    DegreeRule.TOTAL.value: "The full cone of degree 1",
    PLAIN: "The full cone of degree 1, written with cvxpy for Clarabel",
}
SECONDS_LIMIT = 7200.0
BYTES_LIMIT = 10 * 10**9


@dataclass(frozen=True)
class Cell:
    """One run of a cell: seconds by the clock and of the processor, peak memory [GB], and what came out.

    cone: the rule of the cone, total or bessel, or PLAIN; residual: of a certificate of the small cone, in the full
    program. A run that failed or was stopped has no equalities, CPU seconds, peak and γ. load is the machine's load
    average when the run ended: with more load than processors, only CPU seconds compare.
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

    @property
    def product(self) -> int:
        """States times delays."""
        return self.states * self.delays


@dataclass(frozen=True)
class Timed:
    """One cell: CPU seconds of assembly, and of the solver if it was run, on one thread.

    cell: ex1.d1 .. ex3.pade, or n1k1 .. of Table I (full cone of degree 1). For Padé the solver's seconds hold what
    cvxpy takes to translate the program. load: of the machine when it ended.
    """

    cell: str
    assembly: float
    solver: float | None
    machine: str
    date: str
    load: float


def recorded() -> list[Cell]:
    """The cells of the full run measured so far, in the order of their product."""
    cells = [Cell(**line) for line in scaling.recorded(scaling.FULL_RUN)]
    return sorted(cells, key=lambda cell: (cell.product, cell.states))


def solve_plain(task: Program) -> dict[str, Any]:
    """The same program written with cvxpy variables and solved by its default route through Clarabel."""
    level = cvxpy.Variable(task.linear, nonneg=True)
    blocks = [cvxpy.Variable((size, size), PSD=True) for size in task.blocks]
    vector = cvxpy.hstack([level, *(cvxpy.vec(block, order="C") for block in blocks)])
    problem = cvxpy.Problem(cvxpy.Minimize(task.c @ vector), [task.a @ vector == task.b])
    problem.solve(solver=cvxpy.CLARABEL)
    solver = {"status": problem.status, "iterations": problem.solver_stats.num_iters}
    return {"gamma": float(level.value[0]), "equalities": task.a.shape[0], "solver": solver}


def measured(cone: str, states: int, delays: int, threads: int) -> Cell:
    """Solve one cell in this process. Raises what the solver raises."""
    wall, cpu = time.perf_counter(), processor_seconds()
    level = scaling.level_of(states, delays)
    if cone == PLAIN:
        level = None
        found = solve_plain(scaling.cost_program(states, delays, level))
    elif cone == DegreeRule.BESSEL:
        level = scaling.SMALL_LEVEL
        found = scaling.small_cone_cost(states, delays, level, threads)
    else:
        found = scaling.cost(states, delays, level, threads)
    seconds, cpu_seconds = time.perf_counter() - wall, processor_seconds() - cpu
    peak = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)) / 1e6
    verb = "minimised" if level is None else "certified"
    return cell_of(
        (cone, states, delays),
        threads,
        seconds,
        f"{verb}, {found['solver']['status']}, {found['solver']['iterations']} iterations",
        equalities=found["equalities"],
        cpu_seconds=cpu_seconds,
        peak=peak,
        gamma=found["gamma"],
        residual=found["full"]["residual"] if "full" in found else None,
    )


def cell_of(place: tuple[str, int, int], threads: int, seconds: float, outcome: str, **found: float | None) -> Cell:
    """A cell of this run, with the conditions under which it was measured; what was not found is None."""
    conditions = threads, os.getloadavg()[0], os.cpu_count() or 1, machine(), datetime.now(UTC).date().isoformat()
    equalities, cpu, peak, gamma = map(found.get, ("equalities", "cpu_seconds", "peak", "gamma"))
    return Cell(*place, equalities, seconds, cpu, peak, gamma, outcome, *conditions, found.get("residual"))


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
    return cell_of((cone, states, delays), threads, time.perf_counter() - start, failure)


def _text(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def table(cells: list[Cell]) -> str:
    """The measured cells as a Markdown table."""
    head = "n", "K", "equalities", "clock [s]", "CPU [s]", "printed [s]", "peak [GB]", "γ", "residual", "outcome"
    rows = [
        (str(c.states), str(c.delays), _text(c.equalities, "d"), f"{c.seconds:.2f}", _text(c.cpu_seconds, ".2f"),
         printed_seconds(c.states, c.delays), _text(c.peak, ".2f"), _text(c.gamma, ".2e"), _text(c.residual, ".0e"),
         c.outcome, str(c.threads), f"{c.load:.1f}")
        for c in cells
    ]  # fmt: skip
    rule = "|".join(":--" if name == "outcome" else "--:" for name in (*head, "CPUs", "load"))
    return "\n".join(markdown((*head, "CPUs", "load"), rows, rule)) + "\n"


def growth(cells: list[Cell]) -> str:
    """The exponents of growth in n·K, in our seconds and in the published ones of the same cells."""
    chosen = [cell for cell in _published(cells) if cell.gamma is not None and cell.product >= FROM_PRODUCT]
    if len({cell.product for cell in chosen}) < 2:
        return f"No exponent of growth: fewer than two products n·K ≥ {FROM_PRODUCT} are solved.\n"
    cpu = exponent([(c.product, c.cpu_seconds) for c in chosen if c.cpu_seconds is not None])
    clock = exponent([(c.product, c.seconds) for c in chosen])
    printed = exponent([(c.product, float(printed_seconds(c.states, c.delays))) for c in chosen])
    return (
        f"Exponent of growth in n·K over the {len(chosen)} solved cells with n·K ≥ {FROM_PRODUCT}: {cpu:.2f} in CPU"
        f" seconds, {clock:.2f} by the clock; {printed:.2f} in the published seconds of the same cells.\n"
    )


def total_seconds(cells: list[Cell]) -> str:
    """CPU seconds of all published cells together."""
    chosen = [cell for cell in _published(cells) if cell.cpu_seconds is not None]
    used = sum(cell.cpu_seconds or 0.0 for cell in chosen)
    return f"{len(chosen)} of {len(published())} published cells, {used:.0f} CPU seconds together.\n"


def _published(cells: list[Cell]) -> list[Cell]:
    return [cell for cell in cells if printed_seconds(cell.states, cell.delays) != "N/A"]


def comparison(cells: list[Cell]) -> str:
    """CPU seconds of the three ways for the cells that the plain one was tried on, and how many times faster."""
    spent = {(cell.cone, cell.states, cell.delays): cell.cpu_seconds for cell in cells}
    head, rows = ["n", "K", "plain CPU [s]"], []
    for title in ("full", "small"):
        head += [f"{title} cone CPU [s]", "times faster"]
    for cell in (cell for cell in cells if cell.cone == PLAIN):
        fields = [str(cell.states), str(cell.delays), _text(cell.cpu_seconds, ".2f")]
        for cone in (DegreeRule.TOTAL, DegreeRule.BESSEL):
            seconds = spent.get((cone.value, cell.states, cell.delays))
            ratio = cell.cpu_seconds / seconds if cell.cpu_seconds and seconds else None
            fields += [_text(seconds, ".2f"), _text(ratio, ".3g")]
        rows.append(fields)
    return "\n".join(markdown(head, rows, "--:")) + "\n"


def page(cells: list[Cell]) -> str:
    """The committed page: for each cone the table, the sum and the growth."""
    machines = sorted({f"{c.machine}, {c.processors} processors, {c.date}" for c in cells})
    lines = [
        "# Example 4 of the delay paper, measured\n",
        "Written by `benchmarks/bench_delay.py --full` from `papers/peet2019/full_run.jsonl`. CPU seconds are those of",
        "all threads; where the load exceeds the number of processors, the clock also measures other work.\n",
        "A certified γ is a level asked for, below the printed bound of .001; a minimised one is where the solver",
        "stopped on its way to the infimum, zero. The residual is what a certificate of the small cone misses of the",
        "equalities of the full one. Sums and exponents are over cells with a printed time, so without n = K = 10.\n",
        f"Machine: {'; '.join(machines)}.\n",
    ]
    for cone, title in CONES.items():
        chosen = [cell for cell in cells if cell.cone == cone]
        lines += [f"## {title}\n", table(chosen), total_seconds(chosen), growth(chosen)]
    lines += ["## Against the straightforward formulation\n", comparison(cells)]
    return "\n".join(lines)


def cells_of(cone: str, largest: int) -> list[tuple[int, int]]:
    """The cells (n, K) of Table I up to a product, smallest first; the small cone also takes the one left out there."""
    cells = [(n, k) for k in DELAY_COUNTS for n in STATES if n * k <= largest]
    chosen = [(n, k) for n, k in cells if cone == DegreeRule.BESSEL or printed_seconds(n, k) != "N/A"]
    return sorted(chosen, key=lambda cell: (cell[0] * cell[1], cell[0]))


def run_full(cone: str, largest: int, threads: int) -> None:
    """Measure every cell that is not in the file yet, one after the other, and write the table."""
    done = {(cell.cone, cell.states, cell.delays) for cell in recorded()}
    for states, delays in cells_of(cone, largest):
        if (cone, states, delays) not in done:
            cell = isolated(cone, states, delays, threads)
            append(scaling.FULL_RUN, asdict(cell))
            TABLE.write_text(page(recorded()), encoding="utf-8")
            print(f"n = {states}, K = {delays}: {cell.seconds:.2f} s, {cell.outcome}", flush=True)
    TABLE.write_text(page(recorded()), encoding="utf-8")


SOLVED_UP_TO = 15
"""Largest n·K of Table I whose full cone is solved again here; larger cells are in the record of the full run."""


def timed(cell: str, build: Callable[[], Any], solve: Callable[[Any], Any] | None) -> Timed:
    """Build a program, then solve it, each under the processor's clock."""
    start = time.process_time()
    task = build()
    built = time.process_time()
    if solve is not None:
        solve(task)
    return Timed(
        cell=cell,
        assembly=built - start,
        solver=None if solve is None else time.process_time() - built,
        machine=machine(),
        date=datetime.now(UTC).date().isoformat(),
        load=os.getloadavg()[0],
    )


def timed_cells() -> list[Timed]:
    """Every published cell: Theorem 3 by the rule of each variable to d and LMI (3), then Table I."""
    found = []
    for name, plant in EXAMPLES.items():
        system = delay_system(**plant)
        for degree in DEGREES:
            found.append(timed(f"ex{name}.d{degree}", partial(_theorem_3, system, degree), _least))
        found.append(timed(f"ex{name}.pade", partial(pade_model, system, DATA["pade-order"]), lmi_gain))
    for n, k, _ in published():
        level = scaling.level_of(n, k)
        solve = partial(_example_4, level is None) if n * k <= SOLVED_UP_TO else None
        found.append(timed(f"n{n}k{k}", partial(scaling.cost_program, n, k, level), solve))
    return found


def _theorem_3(system: DelayPlant, degree: int) -> Program:
    return program(reduced(assemble(natural_units(system).plant(system), degree)), 0.0)


def _least(task: Program) -> Solution:
    return solved(task, STATED_GAP)


def _example_4(minimised: bool, task: Program) -> Solution:
    return solve_sdpa(task, scaling.ROUGH if minimised else scaling.CERTIFY)


def run_seconds() -> None:
    """Time every cell anew, and write the record."""
    first = delay_system(**EXAMPLES["1"])
    _least(_theorem_3(first, 1))  # loads what is loaded once, so that nothing is while the clock runs
    lmi_gain(pade_model(first, 2))
    scaling.SECONDS.write_text("".join(f"{json.dumps(asdict(cell))}\n" for cell in timed_cells()), encoding="utf-8")


def main() -> None:
    """Choose what to measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    chosen = parser.add_mutually_exclusive_group(required=True)
    chosen.add_argument("--full", choices=CONES, help="every cell by one of the cones, resumable")
    chosen.add_argument("--seconds", action="store_true", help="assembly and solver apart, into seconds.jsonl")
    chosen.add_argument("--cell", nargs=3, metavar=("CONE", "n", "K"), help="one cell, printed as JSON")
    parser.add_argument("--largest", type=int, default=STATES[-1] * DELAY_COUNTS[-1], help="largest n·K")
    parser.add_argument("--threads", type=int, default=1, help="threads of SDPA")
    asked = parser.parse_args()
    if asked.cell:
        resource.setrlimit(resource.RLIMIT_DATA, (BYTES_LIMIT, BYTES_LIMIT))
        cone, states, delays = asked.cell
        print(json.dumps(asdict(measured(cone, int(states), int(delays), asked.threads))))
    elif asked.seconds:
        run_seconds()
    else:
        run_full(asked.full, asked.largest, asked.threads)


if __name__ == "__main__":
    main()

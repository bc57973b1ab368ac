"""CPU seconds of assembly and of the solver apart, cell by cell of the published tables of the delay paper.

`python -m benchmarks.delay_seconds` measures them and writes papers/peet2019/seconds.jsonl.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from dataclasses import asdict
from datetime import UTC, datetime
from functools import partial
from typing import Any

from benchmarks.clock import machine
from papers.peet2019.experiments import scaling
from papers.peet2019.experiments.measured import SECONDS, Timed
from papers.peet2019.method import lmi_gain, pade_model
from papers.peet2019.printed import DATA, DEGREES, EXAMPLES, published
from replication.estimation.conic.program import Program, Solution
from replication.estimation.conic.sdpa import solve_sdpa
from replication.estimation.delay.plant import DelayPlant, delay_system
from replication.estimation.delay.sos.certificate import STATED_GAP, solved
from replication.estimation.delay.sos.synthesis import assemble, program, reduced
from replication.estimation.delay.units import natural_units

SOLVED_UP_TO = 15
"""Largest n·K of Table I whose full cone is solved again here; larger cells are in the record of the full run."""


def measure(cell: str, build: Callable[[], Any], solve: Callable[[Any], Any] | None) -> Timed:
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


def all_cells() -> list[Timed]:
    """Every published cell: Theorem 3 by the rule of each variable to d and LMI (3), then Table I."""
    found = []
    for name, plant in EXAMPLES.items():
        system = delay_system(**plant)
        for degree in DEGREES:
            found.append(measure(f"ex{name}.d{degree}", partial(_theorem_3, system, degree), _least))
        found.append(measure(f"ex{name}.pade", partial(pade_model, system, DATA["pade-order"]), lmi_gain))
    for n, k, _ in published():
        level = scaling.level_of(n, k)
        solve = partial(_example_4, level is None) if n * k <= SOLVED_UP_TO else None
        found.append(measure(f"n{n}k{k}", partial(scaling.cost_program, n, k, level), solve))
    return found


def _theorem_3(system: DelayPlant, degree: int) -> Program:
    return program(reduced(assemble(natural_units(system).plant(system), degree)), 0.0)


def _least(task: Program) -> Solution:
    return solved(task, STATED_GAP)


def _example_4(minimised: bool, task: Program) -> Solution:
    return solve_sdpa(task, scaling.ROUGH if minimised else scaling.CERTIFY)


if __name__ == "__main__":
    first = delay_system(**EXAMPLES["1"])
    _least(_theorem_3(first, 1))  # loads what is loaded once, so that nothing is while the clock runs
    lmi_gain(pade_model(first, 2))
    SECONDS.write_text("".join(f"{json.dumps(asdict(cell))}\n" for cell in all_cells()), encoding="utf-8")

"""What Example 4 and the tables cost, cell by cell: measured once, kept with the paper with its machine."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

RECORD = Path(__file__).parents[1] / "full_run.jsonl"
PLAIN = "plain"
"""The full cone of degree 1, written with cvxpy and given to Clarabel: the straightforward way."""


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


def recorded() -> list[Cell]:
    """The cells measured so far, in the order of their product."""
    lines = RECORD.read_text(encoding="utf-8").splitlines() if RECORD.exists() else []
    return sorted((Cell(**json.loads(line)) for line in lines), key=lambda cell: (cell.product, cell.states))


def cells(cells: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The record as the result of an experiment: its numbers enter the report the way all others do."""
    return {"cells": list(cells)}


SECONDS = Path(__file__).parents[1] / "seconds.jsonl"
"""CPU seconds of assembly and solver apart, as once measured by `benchmarks/bench_delay.py --seconds`."""


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


def recorded_seconds() -> list[Timed]:
    """The cells measured so far."""
    lines = SECONDS.read_text(encoding="utf-8").splitlines() if SECONDS.exists() else []
    return [Timed(**json.loads(line)) for line in lines]


def timed(cells: list[dict[str, Any]]) -> dict[str, Any]:
    """The record as the result of an experiment, by cell."""
    return {cell["cell"]: cell for cell in cells}

"""Computations behind Example 4 and Table I: the cost of Theorem 3 against n·K; functions that return JSON values."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from replication.estimation.conic.program import Program, Solution
from replication.estimation.conic.sdpa import SdpaOptions, solve_sdpa
from replication.estimation.delay.plant import DelayPlant, delay_system
from replication.estimation.delay.sos import cone as bessel
from replication.estimation.delay.sos import synthesis
from replication.estimation.delay.sos.cone import Blocks, DegreeRule, FormSpace, cone_blocks
from replication.estimation.delay.spectrum import rightmost_roots
from replication.estimation.delay.units import transformed
from replication.estimation.validation import Array

Json = dict[str, Any]

ROUGH = SdpaOptions(tolerance=1e-7, scale=1e2, gap=1.0, residual=1e-5)
"""For Example 4: the infimum of γ is zero, known and not attained, so that a gap says nothing; any small γ serves."""
CERTIFY = SdpaOptions(tolerance=1e-10, gap_asked=1.0, scale=1e4, gap=1.0, residual=1e-6)
"""For Example 4 at a given level: any feasible point serves, and a start larger than it takes fewest iterations."""
SMALL_CONE = replace(CERTIFY, scale=1e3, step=0.95)
"""For the small cone, whose points are smaller."""
TINY = 1e-9
"""Entries below this are rounding, where those of the matrix are of size one."""
SMALL_LEVEL = 9e-4
"""Below the printed bound .001."""


def level_of(states: int, delays: int) -> float | None:
    """The level to certify, or None to minimise γ: with one delay and many states SDPA cannot follow γ to zero."""
    return SMALL_LEVEL if delays == 1 and states >= 5 else None


def example_4(states: int, delays: int, *, jordan: float) -> DelayPlant:
    """Example 4 with a Jordan block of eigenvalue `jordan`, in the coordinates x_2, .., x_n, y.

    γ does not depend on the coordinates; these keep the matrices, and with them the program, sparse.
    """
    block = jordan * np.eye(states) + np.diag(np.ones(states - 1), 1)
    ones = np.ones((states, 1))
    times = [(i + 1) / delays for i in range(delays)]
    printed = delay_system(np.zeros((states, states)), [-block / delays] * delays, times, ones, ones.T, ones.T)
    return transformed(printed, np.vstack([np.eye(states)[1:], ones.T]))


def cost_program(states: int, delays: int, level: float | None) -> Program:
    """The program of Example 4 at degree 1: minimise γ, or find a certificate of `level`."""
    return synthesis.program(synthesis.assemble(example_4(states, delays, jordan=1.0), 1, DegreeRule.TOTAL), 0.0, level)


def cost(states: int, delays: int, level: float | None, threads: int = 1) -> Json:
    """Example 4 at degree 1: least γ, or a certificate of `level`; the size of the program and what the solver said."""
    task = cost_program(states, delays, level)
    return _solved(task, level, replace(ROUGH if level is None else CERTIFY, threads=threads))[0]


def _solved(task: Program, level: float | None, options: SdpaOptions) -> tuple[Json, Solution]:
    solution = solve_sdpa(task, options)
    record = {
        "gamma": float(solution.linear[0]) if level is None else level,
        "equalities": task.a.shape[0],
        "solver": solution.report.to_dict(),
    }
    return record, solution


def small_cone_cost(states: int, delays: int, level: float, threads: int = 1) -> Json:
    """A certificate of `level` for Example 4 from the small cone with one moment, checked as one of degree 1.

    The solution is written in the matrices of `cost_program`; what it misses there is measured, without a solver.
    """
    small = synthesis.assemble(example_4(states, delays, jordan=1.0), 1, DegreeRule.BESSEL)
    record, solution = _solved(synthesis.program(small, 0.0, level), level, replace(SMALL_CONE, threads=threads))
    spaces = (synthesis.state_space(small.system, small.count), synthesis.derivative_space(small.system, small.count))
    first = 1 + 2 * small.system.delay_count
    parts = zip((solution.blocks[:first], solution.blocks[first:]), spaces, strict=True)
    target = cone_blocks(1, DegreeRule.TOTAL)
    matrices = [matrix for part, space in parts for matrix in lifted(part, space, target)]
    full = cost_program(states, delays, level)
    residual = np.abs(full.a @ np.concatenate([matrix.ravel() for matrix in matrices]) - full.b).max()
    record["full"] = {
        "equalities": full.a.shape[0],
        "residual": float(residual / (1.0 + np.abs(full.b).max())),
        "least_eigenvalue": min(float(np.linalg.eigvalsh(matrix)[0]) for matrix in matrices),
    }
    return record


def lifted(blocks: Sequence[Array], space: FormSpace, target: Blocks) -> tuple[Array, Array]:
    """The two matrices M_g of Corollary 2 that give the same form; positive semidefinite if the blocks are.

    `target`: a plain and a weighted block with the member (0, 0) in Z_2 and degree >= 1. Of each history there is one
    moment.
    """
    plain, weighted = target
    width, z2 = space.functions, space.points + (plain.degree + 1) * space.functions
    inner, outer = plain.kernel_basis()
    function = np.arange(width)
    constant = z2 + int(np.flatnonzero((inner == 0) & (outer == 0))[0]) * width + function
    functionals = np.zeros((space.points + width, plain.size(space)))
    functionals[: space.points, : space.points] = np.eye(space.points)
    beyond, risen = np.zeros((2, width, plain.size(space)))  # φ - μ_0, and (1+η)φ
    functionals[space.points + function, constant] = 1.0
    beyond[function, constant] = -1.0
    beyond[function, space.points + function] = 1.0
    for a, coefficient in enumerate(bessel.RAMP):
        risen[function, space.points + a * width + function] = coefficient
    diagonals = (blocks[1 + i * space.delays : 1 + (i + 1) * space.delays] for i in range(2))
    rest = [scipy.linalg.block_diag(*parts) if len(parts) else np.zeros((width, width)) for parts in diagonals]
    first = functionals.T @ blocks[0] @ functionals + beyond.T @ rest[0] @ beyond + risen.T @ rest[1] @ risen
    second = np.zeros((weighted.size(space), weighted.size(space)))
    second[space.points : space.points + width, space.points : space.points + width] = rest[1]  # 1+η = (1+η)² - η(1+η)
    return first, second


def sizes(states: list[int], delays: list[int]) -> Json:
    """Equalities of the program of Example 4 for every cell of Table I; nothing is solved."""
    cells = [(n, k, cost_program(n, k, None).a.shape[0]) for k in delays for n in states]
    return {"cells": [{"states": n, "delays": k, "equalities": count} for n, k, count in cells]}


def example_4_roots(states: list[int], delays: list[int], eigenvalues: list[float]) -> Json:
    """For each eigenvalue of the Jordan block: the rightmost roots over all numbers of delays, and of zero the growth.

    n states have the roots of one, n times. As a multiple root is found to the n-th root of rounding only, they are
    found with one state. growth: with eigenvalue zero all n roots are zero, and some free motion grows like t to this
    power: the index of the nilpotent J less one, over all numbers of states, the least first.
    """
    extremes: Json = {}
    for eigenvalue in eigenvalues:
        roots = [float(rightmost_roots(example_4(1, k, jordan=eigenvalue), 1)[0].real) for k in delays]
        extremes[f"{eigenvalue:g}"] = {"largest": max(roots), "smallest": min(roots)}
    return {"roots": extremes, "growth": [_nilpotency(example_4(n, 1, jordan=0.0).a[0]) - 1 for n in states]}


def _nilpotency(matrix: np.ndarray[Any, np.dtype[np.float64]]) -> int:
    """The least power of a nilpotent matrix that vanishes."""
    power, index = matrix, 1
    while np.abs(power).max() > TINY:
        power, index = power @ matrix, index + 1
    return index


# What cells cost: measured once by `benchmarks/bench_delay.py`, which says what each field is; kept with the paper.


FULL_RUN, SECONDS = (Path(__file__).parents[1] / name for name in ("full_run.jsonl", "seconds.jsonl"))
"""Each run of a cell of Table I; CPU seconds of assembly and solver apart."""


def recorded(file: Path) -> list[Json]:
    """What has been measured so far, a line a run."""
    return [json.loads(line) for line in file.read_text("utf-8").splitlines()] if file.exists() else []


def cells(cells: list[Json]) -> Json:
    """The record as the result of an experiment, by product: its numbers enter the report the way all others do."""
    return {"cells": sorted(cells, key=lambda cell: (cell["states"] * cell["delays"], cell["states"]))}


def timed(cells: list[Json]) -> Json:
    """The record as the result of an experiment, by cell."""
    return {cell["cell"]: cell for cell in cells}

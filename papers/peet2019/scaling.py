"""Computations behind Example 4 and Table I: the cost of Theorem 3 against n·K; functions that return JSON values."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from replication.estimation.conic.program import Program, Solution
from replication.estimation.conic.sdpa import SdpaOptions, solve_sdpa
from replication.estimation.delay.sos import bessel, lie, synthesis
from replication.estimation.delay.sos.cone import DegreeRule, cone_blocks
from replication.estimation.delay.spectrum import rightmost_roots
from replication.estimation.delay.system import DelaySystem, delay_system, transformed
from replication.estimation.validation import Array

Json = dict[str, Any]

ROUGH = SdpaOptions(tolerance=1e-7, scale=1e2, gap=1.0, residual=1e-5)
"""For Example 4: the infimum of γ is zero, known and not attained, so that a gap says nothing; any small γ serves."""
CERTIFY = SdpaOptions(tolerance=1e-5, scale=1e4, gap=1e-2, residual=1e-6)
"""For Example 4 at a given level: any feasible point serves, and a start larger than it takes fewest iterations."""
SMALL_LEVEL = 9e-4
"""Below the printed bound .001."""


def level_of(states: int, delays: int) -> float | None:
    """The level to certify, or None to minimise γ: with one delay and many states SDPA cannot follow γ to zero."""
    return SMALL_LEVEL if delays == 1 and states >= 5 else None


def example_4(states: int, delays: int, *, jordan: float) -> DelaySystem:
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
    solution = solve_sdpa(task, replace(ROUGH if level is None else CERTIFY, threads=threads))
    return {
        "gamma": float(solution.linear[0]) if level is None else level,
        "equalities": task.a.shape[0],
        "blocks": list(task.blocks),
        "solver": solution.report.to_dict(),
    }


def small_cone_cost(states: int, delays: int, level: float, threads: int = 1) -> Json:
    """A certificate of `level` for Example 4 from the small cone with one moment, checked as one of degree 1.

    The solution is written in the matrices of `cost_program`; what it misses there is measured, without a solver.
    """
    small = synthesis.assemble(example_4(states, delays, jordan=1.0), 1, DegreeRule.BESSEL)
    task = synthesis.program(small, 0.0, level)
    solution = solve_sdpa(task, replace(CERTIFY, threads=threads))
    matrices = _in_degree_one(small, solution)
    full = cost_program(states, delays, level)
    residual = np.abs(full.a @ np.concatenate([matrix.ravel() for matrix in matrices]) - full.b).max()
    return {
        "gamma": level,
        "equalities": task.a.shape[0],
        "blocks": list(task.blocks),
        "solver": solution.report.to_dict(),
        "full": {
            "equalities": full.a.shape[0],
            "residual": float(residual / (1.0 + np.abs(full.b).max())),
            "least_eigenvalue": min(float(np.linalg.eigvalsh(matrix)[0]) for matrix in matrices),
        },
    }


def _in_degree_one(small: synthesis.Assembly, solution: Solution) -> list[Array]:
    """The matrices of both cones at degree 1, total rule, from a solution in the small cone."""
    spaces = (lie.state_space(small.system, small.count), lie.derivative_space(small.system, small.count))
    first = 1 + 2 * small.system.delay_count
    parts = (solution.blocks[:first], solution.blocks[first:])
    target = cone_blocks(1, DegreeRule.TOTAL)
    return [
        matrix for part, space in zip(parts, spaces, strict=True) for matrix in bessel.lifted(part, space, 1, target)
    ]


def sizes(states: list[int], delays: list[int]) -> Json:
    """Equalities of the program of Example 4 for every cell of Table I; nothing is solved."""
    cells = []
    for k in delays:
        for n in states:
            task = cost_program(n, k, None)
            cells.append({"states": n, "delays": k, "equalities": task.a.shape[0]})
    return {"cells": cells}


def example_4_roots(states: list[int], delays: list[int]) -> Json:
    """Rightmost root for a Jordan block of eigenvalue 1 and of eigenvalue 0, over all cells."""
    found: Json = {}
    for name, eigenvalue in (("one", 1.0), ("zero", 0.0)):
        roots = []
        for k in delays:
            for n in states:
                # A multiple root is found to the n-th root of rounding only; eigenvalues 0 are known in closed form.
                size = 1 if eigenvalue else n
                if eigenvalue:
                    roots.append(float(rightmost_roots(example_4(size, k, jordan=eigenvalue), 1)[0].real))
                else:
                    roots.append(0.0)
        found[name] = {"largest": max(roots), "smallest": min(roots)}
    return found

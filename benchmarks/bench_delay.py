"""Cost of the observer synthesis for Example 4 of the delay paper, cell by cell of its Table I.

    python benchmarks/bench_delay.py                 cells with n·K up to 10, beside the plain cvxpy formulation
    python benchmarks/bench_delay.py --largest 25    more cells
    python benchmarks/bench_delay.py --full          every published cell, up to n·K = 50 (hours on a small machine)

Seconds are those of the solver call alone, as in the paper; the published seconds are of another machine.
"""

from __future__ import annotations

import argparse
import math
import resource
import time

import cvxpy
import numpy as np

from papers.peet2019 import data
from papers.peet2019.experiments import ROUGH, example_4
from replication.errors import ReplicationError
from replication.estimation.delay import DegreeRule, synthesis
from replication.estimation.delay.sdp import Program, SdpaOptions, solve_sdpa

PLAIN_LARGEST = 6
"""Beyond this product the plain formulation takes minutes and gigabytes."""


def plain_seconds(task: Program) -> float:
    """Seconds of the same program written with cvxpy variables and solved by its default route through Clarabel."""
    level = cvxpy.Variable(task.linear, nonneg=True)
    blocks = [cvxpy.Variable((size, size), PSD=True) for size in task.blocks]
    vector = cvxpy.hstack([level, *(cvxpy.vec(block, order="C") for block in blocks)])
    problem = cvxpy.Problem(cvxpy.Minimize(task.c @ vector), [task.a @ vector == task.b])
    start = time.perf_counter()
    problem.solve(solver=cvxpy.CLARABEL)
    return time.perf_counter() - start


def exponent(points: list[tuple[int, float]]) -> float:
    """Slope of log(seconds) against log(n·K), least squares."""
    return float(np.polyfit([math.log(p) for p, _ in points], [math.log(s) for _, s in points], 1)[0])


def main() -> None:
    """Print one line per cell and the exponents of growth."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=10, help="largest product n·K")
    parser.add_argument("--full", action="store_true", help="every published cell")
    parser.add_argument("--threads", type=int, default=1, help="threads of SDPA; set OMP_NUM_THREADS alike")
    chosen = parser.parse_args()
    largest = int(data.LARGEST_PRODUCT) if chosen.full else chosen.largest
    cells = [(n * k, n, k) for k in data.DELAY_COUNTS for n in data.STATES if n * k <= largest]
    options = SdpaOptions(ROUGH.tolerance, ROUGH.scale, gap=ROUGH.gap, residual=ROUGH.residual, threads=chosen.threads)
    print("  n   K  equalities  assembly [s]  SDPA [s]  cvxpy [s]  published [s]  peak [GB]  γ or failure")
    ours: list[tuple[int, float]] = []
    for product, n, k in sorted(cells):
        start = time.perf_counter()
        assembly = synthesis.assemble(example_4(n, k, jordan=1.0), 1, DegreeRule.TOTAL)
        # With one delay and five or more states SDPA cannot follow γ to zero: a small level is certified instead.
        task = synthesis.program(assembly, 0.0, 9e-4 if k == 1 and n >= 5 else None)
        assembled = time.perf_counter() - start
        try:
            solution = solve_sdpa(task, options)
        except ReplicationError as error:
            seconds, outcome = math.nan, str(error)
        else:
            seconds = solution.seconds
            outcome = f"{float(solution.linear[0]):.2e}" if task.linear else "level certified"
            ours.append((product, seconds))
        plain = f"{plain_seconds(task):9.2f}" if product <= PLAIN_LARGEST and task.linear else "        -"
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        published = data.seconds(n, k)
        print(
            f"{n:3d} {k:3d} {task.a.shape[0]:11d} {assembled:13.2f} {seconds:9.2f}  {plain}"
            f" {published:>14} {peak:10.2f}  {outcome}",
            flush=True,
        )
    fitted = [(product, seconds) for product, seconds in ours if product >= 5]
    if len({product for product, _ in fitted}) > 1:
        print(f"exponent of growth in n·K, from n·K = 5 on: {exponent(fitted):.2f}")


if __name__ == "__main__":
    main()

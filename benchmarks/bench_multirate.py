"""Multi-rate designs: Theorem 2 through cvxpy and directly, the single cyclic inequality, and the Riccati route.

cvxpy solves with Clarabel, and with SCS where that is said.

Each benchmark notes the word with which its solver ended and how far its level is from the optimum: a solver that
stopped early is listed with that word, and one that failed with its error. Random plants are seeded by their order.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import scipy
from cvxpy.error import SolverError as Unsolved
from joblib import Parallel, delayed

from benchmarks.clock import median_times
from papers.okajima2023.method.lmi import (
    LmiDesign,
    lmi_design,
    matrix_30,
    minimise,
    reduced_lmi_design,
    theorem2_size,
)
from papers.okajima2023.printed import PLANT as PRINTED
from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic import program as solvers
from replication.estimation.linear.norms import l2_gain, white_noise_variance
from replication.estimation.multirate.optimum import kalman_design, optimal_design, optimum, search_timing
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule

PLANT = MultiratePlant(**{name: np.array(value) for name, value in PRINTED.items()})
SCHEDULES = ((2, 3), (4, 5), (5, 7), (8, 9))
ORDERS = (3, 6, 10, 15, 20)
RANDOM_SCHEDULE = (2, 3)
SEVERAL, ONCE, TURNS = 5, 1, 40
SCS, MOST_BY_SCS = "cvxpy, SCS", 10
"""The order up to which SCS is waited for."""

ACCEPT = ("Solved", "AlmostSolved", "optimal", "optimal_inaccurate")
Outcome = tuple[str, float | None]
"""The word with which the solver ended, and the level it gave."""


def outcome(design: Callable[..., Any]) -> Callable[[MultirateProblem], Outcome]:
    def run(problem: MultirateProblem) -> Outcome:
        try:
            found = design(problem, accept=ACCEPT)
        except (InfeasibleError, SolverError) as error:
            return type(error).__name__, None
        return found.report.status, found.level

    return run


def riccati(problem: MultirateProblem) -> Outcome:
    """Optimum and gains."""
    return "central", optimal_design(problem).level


def by_scs(problem: MultirateProblem) -> Outcome:
    """Theorem 2 by cvxpy and SCS, a first-order method, with its own tolerances."""

    def solved(program: Any) -> str:
        try:
            program.solve(solver="SCS")
        except Unsolved as error:
            raise SolverError(str(error)) from None
        return str(program.status)

    with patch.object(solvers, "solve_modelled", solved):
        return outcome(lmi_design)(problem)


def cyclic_lmi_design(problem: MultirateProblem, *, accept: tuple[str, ...]) -> LmiDesign:
    """The single inequality of the cyclic reformulation: eq. (30) at N = 1 for one state copy per phase, P and Y full.

    Turning the phases by the N-th roots of unity leaves the inequality as it is, so the mean over these turns solves it
    too: of P its diagonal blocks, of Y those from phase k to phase k + 1. Same optimum as Theorem 2, far more unknowns
    (`theorem2_size`).
    """
    import cvxpy

    plant, N, n, q = problem.plant, problem.schedule.period, problem.plant.order, problem.plant.sensors
    ahead, selected = np.roll(np.eye(N), 1, axis=0), [problem.schedule.selection(k) for k in range(N)]
    C, D = (scipy.linalg.block_diag(*(S @ matrix for S in selected)) for matrix in (plant.C, plant.D))
    cyclic = np.kron(ahead, plant.A), np.kron(ahead, plant.B_d), C, D, np.kron(np.eye(N), plant.W)
    P, Y = cvxpy.Variable((N * n, N * n), symmetric=True), cvxpy.Variable((N * n, N * q))
    level_squared = cvxpy.Variable()
    level, report = minimise(level_squared, [matrix_30(cyclic, P, P, Y, level_squared)], accept)
    # The blocks of phase k act on the state at phase k + 1.
    phases = [(slice(n * ((k + 1) % N), n * ((k + 1) % N) + n), slice(q * k, q * (k + 1))) for k in range(N)]
    P_k, Y_k = (np.array(blocks) for blocks in zip(*((P.value[i, i], Y.value[i, j]) for i, j in phases), strict=True))
    gains = np.linalg.solve(P_k, Y_k) * problem.schedule.mask[:, None, :]
    return LmiDesign(level, gains, P_k, report)


ROUTES: dict[str, Callable[[MultirateProblem], Outcome]] = {
    SCS: by_scs,
    "cvxpy": outcome(lmi_design),
    "Clarabel": outcome(reduced_lmi_design),
    "Riccati": riccati,
}


def random_problem(n: int, periods: tuple[int, ...] = RANDOM_SCHEDULE, noises: int = 1) -> MultirateProblem:
    rng = np.random.default_rng(n)
    A = rng.normal(size=(n, n))
    plant = MultiratePlant(
        A=0.95 * A / np.max(np.abs(np.linalg.eigvals(A))),
        B_d=rng.normal(size=(n, noises)),
        C=rng.normal(size=(len(periods), n)),
        D=np.eye(len(periods)),
    )
    return MultirateProblem(plant, SensingSchedule(periods))


def compare(
    benchmark: Any, problem: MultirateProblem, route: Callable[[MultirateProblem], Outcome], rounds: int
) -> None:
    def fresh() -> tuple[tuple[MultirateProblem], dict[str, Any]]:
        return (replace(problem),), {}  # which has not kept anything of a round before

    status, level = benchmark.pedantic(route, setup=fresh, rounds=rounds, warmup_rounds=int(rounds > 1))
    benchmark.extra_info.update(status=status)
    if level is not None and route is not riccati:
        benchmark.extra_info.update(excess=level / optimum(problem).value - 1)


@pytest.mark.parametrize("route", ROUTES)
@pytest.mark.parametrize("periods", SCHEDULES, ids=str)
def test_schedule(benchmark: Any, periods: tuple[int, int], route: str) -> None:
    problem = MultirateProblem(PLANT, SensingSchedule(periods))
    benchmark.group = "Multi-rate observer by schedule (N1, N2), the plant of the paper"
    benchmark.extra_info.update(row=str(periods), column=route, sizes={"N": problem.schedule.period})
    compare(benchmark, problem, ROUTES[route], ONCE if route == SCS else SEVERAL)


@pytest.mark.parametrize("route", ROUTES)
@pytest.mark.parametrize("n", ORDERS)
def test_order(benchmark: Any, n: int, route: str) -> None:
    if route == SCS and n > MOST_BY_SCS:
        pytest.skip("it takes minutes")
    problem = random_problem(n)
    benchmark.group = f"Multi-rate observer by order n, random plants, periods {RANDOM_SCHEDULE}"
    benchmark.extra_info.update(row=str(n), column=route, sizes={"n": n})
    compare(benchmark, problem, ROUTES[route], ONCE if route == SCS or (n > 10 and route != "Riccati") else SEVERAL)


@pytest.mark.parametrize("route", ["cyclic", "periodic"])
@pytest.mark.parametrize("periods", [(1, 2), (1, 3), (2, 3)], ids=str)
def test_cyclic(benchmark: Any, periods: tuple[int, int], route: str) -> None:
    problem = MultirateProblem(PLANT, SensingSchedule(periods))
    design = {"cyclic": cyclic_lmi_design, "periodic": lmi_design}[route]
    benchmark.group = "Single cyclic inequality against Theorem 2, both through cvxpy"
    benchmark.extra_info.update(row=str(periods), column=route, sizes={"N": problem.schedule.period})
    benchmark.extra_info.update(unknowns=theorem2_size(problem, route == "cyclic")[0])
    compare(benchmark, problem, outcome(design), SEVERAL)


@pytest.mark.parametrize(("periods", "most"), [((2, 3), 0.35), ((4, 5), 0.2)], ids=str)
def test_optimum_against_Clarabel(benchmark: Any, periods: tuple[int, int], most: float) -> None:
    """Optimum and gains at the sizes of the paper, in processor time, turn by turn."""
    problem = MultirateProblem(PLANT, SensingSchedule(periods))
    ours, direct = median_times(
        lambda: riccati(replace(problem)), lambda: ROUTES["Clarabel"](replace(problem)), rounds=TURNS
    )
    benchmark.pedantic(riccati, setup=lambda: ((replace(problem),), {}), rounds=TURNS)
    benchmark.extra_info.update(N=problem.schedule.period, of_Clarabel=ours / direct)
    assert ours <= most * direct


def test_all_timings_up_to_period_6_within_15_seconds(benchmark: Any) -> None:
    """The table of best timings for all (N1, N2) up to (6, 6), in two processes, which are started beforehand."""
    pairs = list(product(range(1, 7), repeat=2))
    with Parallel(n_jobs=2) as workers:
        workers(delayed(search_timing)(PLANT, (1, 1)) for _ in range(2))

        def table() -> list[float]:
            searches = workers(delayed(search_timing)(PLANT, pair) for pair in pairs)
            return [search.optima[search.best].value for search in searches]

        assert len(benchmark.pedantic(table, rounds=1)) == len(pairs)
    assert benchmark.stats.stats.max <= 15


def test_periods_8_and_9_with_all_checks_within_2_seconds(benchmark: Any) -> None:
    """Optimum, gains and their exact norm, the direct inequality and its norm, Kalman filter and its variance."""

    def check() -> tuple[str, float, float]:
        problem = MultirateProblem(PLANT, SensingSchedule((8, 9)))
        central, direct = optimal_design(problem), reduced_lmi_design(problem, accept=ACCEPT)
        achieved, also = (l2_gain(problem.error_system(design.gains)).value for design in (central, direct))
        white_noise_variance(problem.error_system(kalman_design(problem).gains))
        return direct.report.status, achieved / central.level - 1, also / central.level - 1

    status, achieved, also = benchmark.pedantic(check, rounds=3)
    benchmark.extra_info.update(status=status, gain_over_level=achieved, gain_of_direct_over_level=also)
    assert benchmark.stats.stats.median <= 2
    assert abs(achieved) <= 1e-7
    assert abs(also) <= 1e-7

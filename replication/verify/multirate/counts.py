"""What needs no witness: schedules, sizes, zeros of gains, ranks and products are counted or read off exactly; and the
identities of the multi-rate paper, by which the conditions of its Theorems 1 and 2 suffice.
"""

from collections.abc import Mapping
from functools import partial
from itertools import count
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, characteristic_polynomial, identity, product, take_rows
from replication.verify.algebra.symbolic import Symbolic, blocks, letters
from replication.verify.algebra.work import bits, spend_elimination
from replication.verify.kernel import decide, identical
from replication.verify.multirate.sensing import TIMES, monodromy, schedule, without_noise
from replication.verify.predicate import NO_READING, Says
from replication.verify.reading import as_written, integer, known_fields, matrices, matrix, sized, states
from replication.verify.statement import statement
from replication.verify.theorem import Found, require

Plant = Mapping[str, Any]
"""A plant as it stands in the certificate, of which each statement reads what it counts."""
scheduled = partial(statement, parameters=TIMES)
counted = partial(scheduled, plant=as_written)
"""Statements on a schedule, and on a plant with one."""
CYCLIC = ("one full P", "P in blocks")
"""Readings of the paper: how the P of its earlier design is made up, which changes no rows."""


@scheduled("multirate.selection", says="measured sensors")
def selection(periods: list[int], offsets: list[int]) -> Found:
    """With the periods {periods} and offsets {offsets} the sensors (counted from 0) measured at each instant are
    {measured}, and again from instant {period} on.

    The diagonals of S_0, S_1, .. of eq. (4), row by row.
    """
    measured = schedule(periods, offsets)
    entries = [fmpq(int(i in rows)) for rows in measured for i in range(len(periods))]
    words = {"measured": measured, "period": len(measured)}
    return Found(words=words, items=tuple((entry, entry) for entry in entries))


@scheduled("multirate.common-period", says="common period")
def common_period(periods: list[int], offsets: list[int]) -> Found:
    """The schedule of the periods {periods} and offsets {offsets} first repeats after {number} {instants}."""
    measured = schedule(periods, offsets)
    return _instants(next(k for k in count(1) if measured[k:] + measured[:k] == measured))


@scheduled("multirate.idle-instants", says="longest time unmeasured")
def idle_instants(periods: list[int], offsets: list[int]) -> Found:
    """With the periods {periods}, offsets {offsets} the longest time without a measurement is {number} {instants}."""
    measured = schedule(periods, offsets)
    runs, run = [0], 0
    for rows in measured + measured:
        run = 0 if rows else run + 1
        runs.append(run)
    return _instants(max(runs))


@scheduled("multirate.dual-rate", says="dual-rate schedule")
def dual_rate(periods: list[int], offsets: list[int]) -> Found:
    """{all_} sensors measure at instant 0 of {period}, and none at any other, with the periods {periods} and offsets
    {offsets}.
    """
    measured = schedule(periods, offsets)
    holds = measured == [list(range(len(periods))), *([] for _ in measured[1:])]
    return Found(words={"all_": "All" if holds else "It is not so that all", "period": len(measured)}, holds=holds)


@counted("multirate.variables", source="okajima2023", says="unknowns of Theorem 2")
def variables(plant: Plant, periods: list[int], offsets: list[int]) -> Found:
    """For {subject} with the periods {periods} and offsets {offsets} Theorem 2 has {number} unknown numbers.

    The unknowns of Theorem 2: entries of the symmetric P_k and of Y_k at every phase, and the level.
    """
    n, _, sensors, _ = _sizes(plant)
    require(len(periods) == sensors, "parameters.periods must have one for each sensor")
    at_each_phase = sum(range(n + 1)) + n * len(periods)
    return _count(len(schedule(periods, offsets)) * at_each_phase + 1)


@statement(
    "multirate.rows",
    source="okajima2023",
    plant=as_written,
    parameters=as_written,
    bound=None,
    says=Says(quantity="rows of Theorem 2", setting={}, readings=(NO_READING, *CYCLIC)),
)
def rows(plant: Plant, parameters: Any) -> Found:
    """For {subject} the matrix of Theorem 2 has {number} rows at each phase.

    The rows of the matrix (30) of one phase, from the sizes of its diagonal blocks; they depend on no schedule.
    """
    return _count(_rows(plant))


@counted(
    "multirate.cyclic-rows", source="okajima2023", says=Says(quantity="rows of the cyclic inequality", readings=CYCLIC)
)
def cyclic_rows(plant: Plant, periods: list[int], offsets: list[int]) -> Found:
    """For {subject} with the periods {periods} and offsets {offsets} the matrix of Theorem 2 for the cyclic
    reformulation, with {instants} times the states, disturbances and sensors, has {number} rows, whatever the blocks of
    its P.
    """
    instants = len(schedule(periods, offsets))
    require(len(periods) == _sizes(plant)[2], "parameters.periods must have one for each sensor")
    return _count(instants * _rows(plant), instants=instants)


@counted("multirate.unmeasured", says="unmeasured columns are zero")
def unmeasured(plant: Plant, periods: list[int], offsets: list[int]) -> Found:
    """The gains of {subject} are {zero} {others} columns of sensors that are not measured at that phase, with the
    periods {periods} and offsets {offsets}.
    """
    measured = schedule(periods, offsets)
    L = _gains(plant, len(periods), len(measured))
    others = [(k, i) for k, rows in enumerate(measured) for i in range(len(periods)) if i not in rows]
    wrong = [(k, i) for k, i in others if any(entry != 0 for entry in take_rows(L[k].transpose(), [i]).entries())]
    zero = f"not zero in {len(wrong)} of the" if wrong else "zero in all"
    return Found(words={"zero": zero, "others": len(others)}, holds=not wrong)


@statement(
    "multirate.observable", plant=as_written, parameters=as_written, says=Says(quantity="observability", setting={})
)
def observable(plant: Plant, parameters: Any) -> Found:
    """For {subject} the observability matrix of (C, A) has rank {rank}, of {n}."""
    A, C = _observed(plant)
    n, power, blocks = A.nrows(), identity(A.nrows()), []
    for _ in range(n):
        blocks.append([product(C, power)])
        power = product(power, A)
    whole = block(blocks)
    spend_elimination(whole.nrows(), n, bits(whole), "a rank")
    rank = whole.rank()
    return Found(words={"rank": rank, "n": n}, holds=rank == n)


@counted("multirate.product", says="same poles from the next instant")
def order_of_factors(plant: Plant, periods: list[int], offsets: list[int]) -> Found:
    """With the gains of {subject}, periods {periods} and offsets {offsets}, A_e as a product over one period, later
    factors to the left, has {shifted} characteristic polynomial from instant 1 as from instant 0; with the factors in
    the other order it has {reverse} one.
    """
    measured = schedule(periods, offsets)
    A, C = _observed(plant)
    require(C.nrows() == len(periods), "plant.C must have a row for each period")
    first, *others = without_noise(A, C, measured).error_system(_gains(plant, len(periods), len(measured)))
    orders = ([first, *others], [*others, first], [*reversed(others), first])
    poles, shifted, reverse = (characteristic_polynomial(monodromy(order)) for order in orders)
    words = {True: "the same", False: "another"}
    return Found(
        words={"shifted": words[poles == shifted], "reverse": words[poles == reverse]},
        holds=poles == shifted and poles != reverse,
    )


def _observed(plant: Plant) -> tuple[fmpq_mat, fmpq_mat]:
    """A and C of the plant."""
    A, C = known_fields(plant, "plant", "A", "C")
    A = states(A, "plant.A")
    return A, matrix(C, "plant.C", columns=A.nrows())


def _gains(plant: Plant, sensors: int, phases: int) -> list[fmpq_mat]:
    A, L = known_fields(plant, "plant", "A", "L")
    return matrices(L, "plant.L", states(A, "plant.A").nrows(), sensors, phases)


def _rows(plant: Plant) -> int:
    """Rows of the matrix (30): twice the states, the disturbances and the sensor noises."""
    n, disturbances, _, noises = _sizes(plant)
    return 2 * n + disturbances + noises


def _sizes(plant: Plant) -> tuple[int, int, int, int]:
    """The numbers of states, disturbances, sensors and sensor noises."""
    A, C = _observed(plant)
    B_d, D = known_fields(plant, "plant", "B_d", "D")
    disturbed, noisy = matrix(B_d, "plant.B_d", rows=A.nrows()), matrix(D, "plant.D", rows=C.nrows())
    return int(A.nrows()), int(disturbed.ncols()), int(C.nrows()), int(noisy.ncols())


def _instants(number: int) -> Found:
    return _count(number, instants="instant" if number == 1 else "instants")


def _count(number: int, **words: Any) -> Found:
    return Found(words={"number": number, **words}, lower=fmpq(number), upper=fmpq(number))


# Identities in letters for matrices: they hold for plants, signals and periods of any size. The two weights on the
# noises stand for gamma^2 I.


SIZES = dict.fromkeys(("states", "sensors", "disturbances", "inputs"), sized(integer, 1))
NAMES = ("A", "L", "S", "C", "D", "B_d", "W", "P", "Q", "G_d", "G_w", "e", "d", "w")
SYMMETRIC = ("P", "Q", "G_d", "G_w")


@statement("multirate.error-system", source="okajima2023", parameters=SIZES, holds=True, says="error system (16)")
def error_system(**sizes: int) -> Found:
    """The error of the observer (15) obeys eq. (16) for all entries of all matrices ({sizes})."""
    A, B_u, B_d, C, D, L, S, x, o, u, d, w = letters("A", "B_u", "B_d", "C", "D", "L", "S", *"xoudw")
    plant, measured = A @ x + B_u @ u + B_d @ d, S @ C @ x + S @ D @ w
    observer = A @ o + B_u @ u + L @ (measured - S @ C @ o)
    expected = (A - L @ S @ C) @ (x - o) + B_d @ d - L @ S @ D @ w
    decide(identical(plant - observer, expected, "eq. (16)"))
    return _counted(sizes)


@statement("multirate.dissipation", source="okajima2023", parameters=SIZES, holds=True, says="identity (23)")
def dissipation(**sizes: int) -> Found:
    """The quadratic form of the matrix (20) is the left-hand side of eq. (23) ({sizes})."""
    _require_loss()
    return _counted(sizes)


@statement("multirate.schur", source="okajima2023", parameters=SIZES, holds=True, says="Schur complement (32)")
def schur(**sizes: int) -> Found:
    """With Y = P L, the Schur complement of P in the matrix (30) is the matrix (20) ({sizes}).

    The blocks beside P are P F with F = [A_e, B_d, -L S D], so that the complement is the rest less F'P F.
    """
    _require_complement()
    return _counted(sizes)


def _counted(sizes: dict[str, int]) -> Found:
    """The sizes in words."""
    phrases = (f"{size} {name if size > 1 else name.removesuffix('s')}" for name, size in sizes.items())
    return Found(words={"sizes": ", ".join(phrases)})


@statement("multirate.theorem-1", source="okajima2023", holds=True, says="Theorem 1")
def theorem_1() -> None:
    """If P_k > 0 of period N make the matrix (20) positive definite at each instant, A_e is Schur and the l2 gain of
    the error system is below gamma, for every N and all sizes.

    The form (20) is the loss in (25), with Q for P_{k-1}. Without noise it says V_{k+1} < V_k for e != 0; as N instants
    have one factor below one, A_e is Schur. One eps > 0 serves all N instants, V_0 = 0 and V_{K+1} >= 0, so that the
    sum of (25) from 0 to K gives sum z'z <= (gamma^2 - eps) sum d_*'d_*.
    """
    _require_loss()


@statement("multirate.theorem-2", source="okajima2023", holds=True, says="Theorem 2")
def theorem_2() -> None:
    """If P_k > 0 and Y_k of period N make the matrix (30) positive definite at each instant, the gains P_k^-1 Y_k make
    A_e Schur and the l2 gain of the error system smaller than gamma, for every N and all sizes.

    With Y = P L the first row of (30) is P F, F = [A_e, B_d, -L S D], so that its Schur complement is the rest less
    F'P F, which is (20): Theorem 1 follows.
    """
    _require_complement()
    _require_loss()


def _require_loss() -> None:
    """The form (20) is the loss in (25), and so the left-hand side of (23)."""
    m, closed, theta = _conditions()
    e, d, w, P, before, W = (m[name] for name in ("e", "d", "w", "P", "Q", "W"))
    xi, following = blocks([[e], [d], [w]]), blocks([closed]) @ blocks([[e], [d], [w]])
    supply = d.T @ m["G_d"] @ d + w.T @ m["G_w"] @ w - (W @ e).T @ (W @ e)
    decide(identical(xi.T @ theta @ xi, e.T @ before @ e - following.T @ P @ following + supply, "eq. (25)"))


def _require_complement() -> None:
    """The Schur complement of P in (30) is (20)."""
    m, closed, theta = _conditions()
    A, L, S, C, D, B_d, W, P, before = (m[name] for name in ("A", "L", "S", "C", "D", "B_d", "W", "P", "Q"))
    Y, F, none = P @ L, blocks([closed]), W * 0
    decide(identical(blocks([[P @ A - Y @ S @ C, P @ B_d, -(Y @ S @ D)]]), P @ F, "the first row of (30)"))
    rest = blocks([[before - W.T @ W, none, none], [none, m["G_d"], none], [none, none, m["G_w"]]])
    decide(identical(rest - F.T @ P @ F, theta, "the Schur complement in (30)"))


def _conditions() -> tuple[dict[str, Symbolic], list[Symbolic], Symbolic]:
    """The letters, the blocks of F, and the matrix (20), block by block as printed."""
    m = dict(zip(NAMES, letters(*NAMES, symmetric=SYMMETRIC), strict=True))
    A, L, S, C, D, B_d, W, P, before = (m[name] for name in ("A", "L", "S", "C", "D", "B_d", "W", "P", "Q"))
    A_e, M = A - L @ S @ C, L @ S @ D
    theta = blocks(
        [
            [before - A_e.T @ P @ A_e - W.T @ W, -(A_e.T @ P @ B_d), A_e.T @ P @ M],
            [-(B_d.T @ P @ A_e), m["G_d"] - B_d.T @ P @ B_d, B_d.T @ P @ M],
            [M.T @ P @ A_e, M.T @ P @ B_d, m["G_w"] - M.T @ P @ M],
        ]
    )
    return m, [A_e, B_d, -M], theta

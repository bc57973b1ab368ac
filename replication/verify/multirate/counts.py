"""What can be counted or read off exactly: schedules, sizes of Theorem 2, zeros of gains, ranks, products."""

from collections.abc import Mapping
from functools import partial
from itertools import count
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, characteristic_polynomial, identity, product, take_rows
from replication.verify.algebra.work import bits, spend_elimination
from replication.verify.multirate.sensing import TIMES, monodromy, schedule, without_noise
from replication.verify.predicate import NO_READING, Says
from replication.verify.reading import as_written, known_fields, matrices, matrix, states
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

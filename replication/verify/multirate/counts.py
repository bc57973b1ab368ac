"""What can be counted or read off exactly: schedules, sizes of Theorem 2, zeros of gains, ranks, products."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import count
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, identity, require_order, take_rows
from replication.verify.multirate.bounds import monodromy
from replication.verify.multirate.sensing import schedule, without_noise
from replication.verify.reading import fields, integer, matrices, matrix, require_empty, sequence
from replication.verify.theorem import Theorem, require

Certificate = Mapping[str, Any]


def selection(certificate: Certificate) -> Theorem:
    """The diagonals of S_0, S_1, .. of eq. (4), row by row."""
    measured, sensors = _schedule(certificate)
    entries = [fmpq(int(i in rows)) for rows in measured for i in range(sensors)]
    return Theorem(
        sentence=f"The sensors measured at each instant are {measured}, and again from instant {len(measured)} on.",
        items=tuple((entry, entry) for entry in entries),
    )


def common_period(certificate: Certificate) -> Theorem:
    """The number of instants after which the schedule repeats, and no smaller one."""
    measured, _ = _schedule(certificate)
    rotations = (k for k in count(1) if measured[k:] + measured[:k] == measured)
    return _count(next(rotations), "The schedule repeats after {} instants.")


def idle_instants(certificate: Certificate) -> Theorem:
    """The longest run of instants without any measurement."""
    measured, _ = _schedule(certificate)
    runs, run = [0], 0
    for rows in measured + measured:
        run = 0 if rows else run + 1
        runs.append(run)
    return _count(max(runs), "The longest time without a measurement is {} instants.")


def dual_rate(certificate: Certificate) -> Theorem:
    """Whether all sensors measure at instant 0 and none at any other of the period."""
    measured, sensors = _schedule(certificate)
    holds = measured == [list(range(sensors)), *([] for _ in measured[1:])]
    words = f"ll sensors measure at instant 0 of {len(measured)}, and none at any other."
    return Theorem(sentence=f"A{words}" if holds else f"It is not so that a{words}", holds=holds)


def variables(certificate: Certificate) -> Theorem:
    """The unknowns of Theorem 2: entries of the symmetric P_k and of Y_k at every phase, and the level."""
    measured, sensors = _schedule(certificate)
    n = _states(certificate).nrows()
    at_each_phase = sum(range(n + 1)) + n * sensors
    return _count(len(measured) * at_each_phase + 1, "Theorem 2 has {} unknown numbers.")


def rows(certificate: Certificate) -> Theorem:
    """The rows of the matrix (30) of one phase, from the sizes of its diagonal blocks."""
    require_empty(certificate, "witness")
    A, C = _observed(certificate)
    n, q = A.nrows(), C.nrows()
    B_d = matrix(certificate["plant"]["B_d"], "plant.B_d", rows=n)
    D = matrix(certificate["plant"]["D"], "plant.D", rows=q)
    return _count(2 * n + B_d.ncols() + D.ncols(), "The matrix of Theorem 2 has {} rows at each phase.")


def unmeasured(certificate: Certificate) -> Theorem:
    """Whether the gains are zero in the columns of sensors that are not measured."""
    measured, sensors = _schedule(certificate)
    L = _gains(certificate, sensors, len(measured))
    others = [(k, i) for k, rows in enumerate(measured) for i in range(sensors) if i not in rows]
    wrong = [(k, i) for k, i in others if any(entry != 0 for entry in take_rows(L[k].transpose(), [i]).entries())]
    words = f"not zero in {len(wrong)} of the" if wrong else "zero in all"
    return Theorem(
        sentence=f"The gains are {words} {len(others)} columns of sensors that are not measured at that phase.",
        holds=not wrong,
    )


def observable(certificate: Certificate) -> Theorem:
    """Whether C, CA, .. CA^(n-1) stacked have rank n."""
    require_empty(certificate, "bound", "witness")
    A, C = _observed(certificate)
    n, power, blocks = A.nrows(), identity(A.nrows()), []
    for _ in range(n):
        blocks.append([C * power])
        power = power * A
    rank = block(blocks).rank()
    return Theorem(sentence=f"The observability matrix of (C, A) has rank {rank}, of {n}.", holds=rank == n)


def product(certificate: Certificate) -> Theorem:
    """Whether the poles of the product over one period do not depend on where it starts, but do on its order."""
    measured, sensors = _schedule(certificate)
    A, C = _observed(certificate)
    first, *others = without_noise(A, C, measured).error_system(_gains(certificate, sensors, len(measured)))
    orders = ([first, *others], [*others, first], [*reversed(others), first])
    poles, shifted, reverse = (monodromy(order).charpoly() for order in orders)
    words = {True: "the same", False: "another"}
    return Theorem(
        sentence=f"A_e as a product over one period, later factors to the left, has {words[poles == shifted]} "
        "characteristic polynomial from instant 1 as from instant 0; with the factors in the other order it has "
        f"{words[poles == reverse]} one.",
        holds=poles == shifted and poles != reverse,
    )


def _schedule(certificate: Certificate) -> tuple[list[list[int]], int]:
    """The sensors measured at each phase, and how many sensors there are; there is nothing to witness."""
    fields(certificate["witness"], "witness")
    fields(certificate["bound"], "bound")
    periods, _ = fields(certificate["parameters"], "parameters", "periods", "offsets")
    return schedule(certificate["parameters"]), len(sequence(periods, "parameters.periods", integer))


def _states(certificate: Certificate) -> fmpq_mat:
    """The square matrix A of the plant."""
    A = matrix(certificate["plant"]["A"], "plant.A")
    require(A.nrows() == A.ncols(), f"plant.A must be square, got {A.nrows()} x {A.ncols()}")
    require_order(A.nrows(), "plant.A")
    return A


def _observed(certificate: Certificate) -> tuple[fmpq_mat, fmpq_mat]:
    """A and C of the plant."""
    A = _states(certificate)
    return A, matrix(certificate["plant"]["C"], "plant.C", columns=A.nrows())


def _gains(certificate: Certificate, sensors: int, phases: int) -> list[fmpq_mat]:
    n = _states(certificate).nrows()
    return matrices(certificate["plant"]["L"], "plant.L", n, sensors, phases)


def _count(number: int, sentence: str) -> Theorem:
    return Theorem(sentence=sentence.format(number), lower=fmpq(number), upper=fmpq(number))


STATEMENTS: Mapping[str, Callable[[Certificate], Theorem]] = {
    "multirate.selection": selection,
    "multirate.common-period": common_period,
    "multirate.idle-instants": idle_instants,
    "multirate.dual-rate": dual_rate,
    "multirate.variables": variables,
    "multirate.rows": rows,
    "multirate.unmeasured": unmeasured,
    "multirate.observable": observable,
    "multirate.product": product,
}

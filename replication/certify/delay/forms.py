"""Exact quadratic forms of Theorem 3 as dictionaries of coefficients, for the rounding of Gram matrices.

Functionals u are numbered: the point variables, then int t^c f_k(t) dt at points + c * functions + k. A form maps
("pair", i, j), i <= j, to the coefficient of u_i u_j, and ("local", c, k, l), k <= l, to that of int t^c f_k f_l dt.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from flint import fmpq, fmpq_mat

from replication.certify import exact, rational
from replication.errors import InvalidInputError
from replication.estimation.delay.sos.cone import Blocks, ConeBlock
from replication.verify.algebra.linear import block, identity, take_rows

Key = tuple[Any, ...]
Form = dict[Key, fmpq]
Entry = tuple[int, int]

WEIGHTS: tuple[Mapping[int, int], ...] = ({0: 1}, {1: -1, 2: -1})
"""The weights 1 and -t(t+1), by powers."""


@dataclass(frozen=True)
class Basis:
    """zeta(t) = [u; t^a f(t); t^a int s^b f(s) ds], with the degree of a and the weight that a block of a cone has."""

    points: int
    functions: int
    block: ConeBlock

    @property
    def kernels(self) -> list[tuple[int, int]]:
        """The powers a and b of the moments."""
        return list(zip(*map(np.ndarray.tolist, self.block.kernel_basis()), strict=True))

    @property
    def size(self) -> int:
        """Number of entries."""
        return self.points + self.functions * self.block.members

    def members(self) -> list[tuple[int, int | None, int | None]]:
        """For each entry: the power of t, the functional it is a multiple of, and the function it is a multiple of."""
        powers = range(self.block.degree + 1)
        functions = range(self.functions)
        moments = [(a, self.points + b * self.functions + k, None) for a, b in self.kernels for k in functions]
        return [
            *((0, p, None) for p in range(self.points)),
            *((a, None, k) for a in powers for k in functions),
            *moments,
        ]

    def terms(self) -> Iterator[tuple[Entry, Key, fmpq]]:
        """Entry (i <= j) of the Gram matrix, monomial, and the coefficient with which it enters the form."""
        members = self.members()
        for i, (first, left, f) in enumerate(members):
            for j in range(i, len(members)):
                second, right, g = members[j]
                for shift, factor in WEIGHTS[self.block.weighted].items():
                    power, weight = first + second + shift, fmpq(factor * (1 if i == j else 2))
                    if f is not None and g is not None:
                        yield (i, j), ("local", power, min(f, g), max(f, g)), weight
                    elif left is not None and right is not None:
                        yield (i, j), pair(left, right), weight * fmpq((-1) ** power, power + 1)
                    else:
                        fixed, free = (left, g) if f is None else (right, f)
                        yield (i, j), pair(fixed, self.points + power * self.functions + free), weight  # type: ignore[operator, arg-type]


def bases(points: int, functions: int, blocks: Blocks) -> list[Basis]:
    """Of the matrices of a cone, under both weights."""
    return [Basis(points, functions, block) for block in blocks]


def pair(first: int, second: int) -> Key:
    """The key of u_first u_second."""
    return ("pair", min(first, second), max(first, second))


def add(form: dict[Any, fmpq], key: Any, value: fmpq) -> None:
    """Add to one coefficient."""
    form[key] = form.get(key, fmpq(0)) + value


def total(forms: Iterable[Form]) -> Form:
    """The sum of forms."""
    result: Form = {}
    for form in forms:
        for key, value in form.items():
            add(result, key, value)
    return result


def echelon(rows: Sequence[Mapping[int, fmpq]], width: int) -> tuple[fmpq_mat, list[int]]:
    """Reduced row echelon form of sparse rows of `width` columns, and the column of each pivot."""
    table = fmpq_mat(len(rows), width)
    for i, row in enumerate(rows):
        for column, amount in row.items():
            table[i, column] = amount
    reduced, rank = table.rref()
    return reduced, [next(k for k in range(width) if reduced[i, k] != 0) for i in range(rank)]


def form_of(basis: Basis, gram: fmpq_mat) -> Form:
    """int g zeta' M zeta."""
    form: Form = {}
    for (i, j), key, weight in basis.terms():
        add(form, key, weight * gram[i, j])
    return form


@dataclass(frozen=True)
class Dynamics:
    """e' = A0 e + late l - B w and f_k' = (1 / delay) df_k/dt with f(0) = e, f(-1) = l; z = C10 e + late_output l.

    The measured states are the last `measured`. Point variables of the derivative: (w, v, e, l).
    """

    A0: fmpq_mat
    late: fmpq_mat
    delays: tuple[fmpq, ...]
    B: fmpq_mat
    C10: fmpq_mat
    late_output: fmpq_mat
    measured: int

    @property
    def states(self) -> int:
        """Number n of states."""
        return int(self.A0.nrows())

    @property
    def functions(self) -> int:
        """Number of scalar histories."""
        return self.states * len(self.delays)

    @property
    def first(self) -> int:
        """Index of the first entry of e among the point variables of the derivative."""
        return int(self.B.ncols() + self.C10.nrows())

    @property
    def points(self) -> int:
        """Number of point variables of the derivative."""
        return self.first + self.states + self.functions


def change_of(plant: Mapping[str, Any]) -> fmpq_mat:
    """Rational coordinates in which the last states are the measurements: unit rows above C_2, the first that serve."""
    sensor = exact(plant["C2"])
    q, n = sensor.nrows(), sensor.ncols()
    if all(sensor[i, j] == 0 for i in range(q) for j in range(n - q)):
        return identity(n)
    for states in combinations(range(n), n - q):
        change = block([[take_rows(identity(n), states)], [sensor]])
        if change.det() != 0:
            return change
    raise InvalidInputError("the rows of C_2 are dependent; drop redundant measurements")


def dynamics_of(plant: Mapping[str, Any], change: fmpq_mat) -> Dynamics:
    """The plant in the coordinates `change`, in exact numbers."""
    back = change.inv()
    return Dynamics(
        A0=change * exact(plant["A0"]) * back,
        late=block([[change * exact(matrix) * back for matrix in plant["A"]]]),
        delays=tuple(rational(delay) for delay in plant["delays"]),
        B=change * exact(plant["B"]),
        C10=exact(plant["C10"]) * back,
        late_output=block([[exact(matrix) * back for matrix in plant["C1"]]]),
        measured=len(plant["C2"]),
    )


def rates(system: Dynamics, count: int) -> tuple[list[int], list[dict[int, fmpq]]]:
    """For each functional of V: its number among those of the derivative, and its rate as a combination of them."""
    n, width, e = system.states, system.functions, system.first
    late, base = e + n, system.points
    where = [*range(e, late), *range(base, base + count * width)]
    rate: list[dict[int, fmpq]] = []
    for i in range(n):
        row = {k: -system.B[i, k] for k in range(system.B.ncols())}
        row |= {e + k: system.A0[i, k] for k in range(n)}
        row |= {late + k: system.late[i, k] for k in range(width)}
        rate.append(row)
    for c in range(count):
        for k in range(width):
            speed = 1 / system.delays[k // n]
            row = {late + k: -speed * (-1) ** c}
            if c == 0:
                row[e + k % n] = speed
            else:
                row[base + (c - 1) * width + k] = -speed * c
            rate.append(row)
    return where, rate


def derivative(system: Dynamics, storage: Form) -> Form:
    """dV/dt as a form of the point variables (w, v, e, l) and the histories; V has e as its point variables."""
    n, width, e = system.states, system.functions, system.first
    count = 1 + max(((key[2] - n) // width for key in storage if key[0] == "pair"), default=-1)
    where, rate = rates(system, count)
    form: Form = {}
    for key, value in storage.items():
        if key[0] == "pair":
            _, i, j = key
            for fixed, moving in ((i, j), (j, i)):
                for target, weight in rate[moving].items():
                    add(form, pair(where[fixed], target), value * weight)
            continue
        _, c, k, m = key
        speed = value / system.delays[k // n]
        if c == 0:
            add(form, pair(e + k % n, e + m % n), speed)
        else:
            add(form, ("local", c - 1, k, m), -speed * c)
        add(form, pair(e + n + k, e + n + m), -speed * (-1) ** c)
    return form


def contribution(system: Dynamics, key: Key) -> Form:
    """What a coefficient of V adds to those of its derivative that Z cannot cancel; S may not couple two delays."""
    if key[0] == "local" and key[2] // system.states != key[3] // system.states:
        return {("coupling", *key): fmpq(1)}
    reached = derivative(system, {key: fmpq(1)})
    return {target: amount for target, amount in reached.items() if amount != 0 and not cancellable(system, target)}


def supply(system: Dynamics, gamma: fmpq) -> Form:
    """2 v'z - gamma (|w|^2 + |v|^2)."""
    r, p, n = system.B.ncols(), system.C10.nrows(), system.states
    form: Form = {pair(i, i): -gamma for i in range(r + p)}
    for i in range(p):
        for k in range(n):
            add(form, pair(r + i, system.first + k), 2 * system.C10[i, k])
        for k in range(system.functions):
            add(form, pair(r + i, system.first + n + k), 2 * system.late_output[i, k])
    return form


def cancellable(system: Dynamics, key: Key) -> bool:
    """Whether the free operator Z of Theorem 3 can cancel this coefficient of the derivative."""
    n, hidden, late = system.states, system.states - system.measured, system.first + system.states
    *_, i, j = key
    if key[0] == "local":
        return bool(i // n == j // n and (i % n >= hidden or j % n >= hidden))
    # Of an end value Z takes the measured ones only; of two, and of w and v, none.
    ends = [k for k in (i, j) if late <= k < system.points]
    if min(i, j) < system.first or len(ends) == 2:
        return False
    return any((k - system.first) % n >= hidden for k in ends or (i, j))

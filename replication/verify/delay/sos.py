"""Theorem 3 of Peet and Gu with rational Gram matrices: an observer with L2 gain below gamma exists.

The storage V and the dissipation N are sums of squares with positive definite Gram matrices; along the error of the
observer the identity dV/dt - gamma(|w|^2 + |v|^2) + 2 v'z + 2<e, Z C2 e> + N = 0 holds for a suitable operator Z. What
Z can cancel is left out of the comparison; everything else must match exactly. See docs/certificates.md.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeVar

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, identity, submatrix, zeros
from replication.verify.algebra.work import PLACE, spend
from replication.verify.delay.plant import DelayPlant, measured_last
from replication.verify.kernel import decide, definite, equal
from replication.verify.reading import Reader, matrix, record, sequence, sized, symmetric
from replication.verify.theorem import require

# Quadratic forms on R^m x L2[-1,0]^F with polynomial kernels, in exact numbers.
#
# A form is u'P u + 2 u' int Q(s)f(s) ds + int f(s)'S(s)f(s) ds + int int f(s)'R(s,t)f(t) ds dt, where u is a vector and
# f are F functions on [-1, 0]. Q, S and R are matrix polynomials: the matrix of each power, by exponent.


K = TypeVar("K")
Kernel = dict[tuple[int, int], fmpq_mat]
Polynomial = dict[int, fmpq_mat]


@dataclass(frozen=True)
class Form:
    """P (m, m) symmetric; Q[c] (m, F); S[c] (F, F) symmetric; R[a, b] (F, F) with R[b, a] the transpose of R[a, b]."""

    P: fmpq_mat
    Q: Polynomial
    S: Polynomial
    R: Kernel


def add_to(table: dict[K, fmpq_mat], key: K, term: fmpq_mat) -> None:
    """Add a term to the coefficient of a power."""
    table[key] = table[key] + term if key in table else term


def total(first: Form, second: Form) -> Form:
    """The sum of two forms."""
    return Form(first.P + second.P, _sum(first.Q, second.Q), _sum(first.S, second.S), _sum(first.R, second.R))


def _sum(first: Mapping[K, fmpq_mat], second: Mapping[K, fmpq_mat]) -> dict[K, fmpq_mat]:
    result = dict(first)
    for key, term in second.items():
        add_to(result, key, term)
    return result


UNIFORM: Mapping[int, int] = {0: 1}
"""The weight g(s) = 1, by powers."""
BUMP: Mapping[int, int] = {1: -1, 2: -1}
"""The weight g(s) = -s(s + 1), positive between -1 and 0."""


def moment(weight: Mapping[int, int], power: int) -> fmpq:
    """int g(s) s^power ds over [-1, 0]."""
    return sum((fmpq(factor * (-1) ** (power + k), power + k + 1) for k, factor in weight.items()), fmpq(0))


RULES: Mapping[str, Callable[[int, int, int], bool]] = {
    "each": lambda a, b, degree: True,
    "total": lambda a, b, degree: a + b <= degree,
    "outer": lambda a, b, degree: a == 0,
    "inner": lambda a, b, degree: b == 0,
}
"""Which powers (a, b) of s and t the kernels of a degree hold, of those up to the degree each."""
Powers = Sequence[tuple[int, int]]


def kernels(degree: int, rule: str = "each") -> Powers:
    """The powers (a, b) of s and t in zeta of `square` by a rule."""
    powers = range(degree + 1)
    spend(len(powers) ** 2 * PLACE, f"the powers of degree {degree}")
    return [(a, b) for a, b in product(powers, powers) if RULES[rule](a, b, degree)]


def basis_size(points: int, functions: int, degree: int, powers: Powers) -> int:
    """Number of entries of zeta in `square`."""
    return points + functions * (degree + 1 + len(powers))


def square(M: fmpq_mat, weight: Mapping[int, int], points: int, functions: int, degree: int, powers: Powers) -> Form:
    """int g(s) zeta(s)'M zeta(s) ds, which is non-negative for M >= 0 and g >= 0.

    zeta(s) = [u; s^a f(s), a = 0..degree; s^a int t^b f(t) dt, (a, b) in `powers`].
    """
    u = range(points)
    starts = range(points, basis_size(points, functions, degree, powers), functions)
    columns = [range(start, start + functions) for start in starts]
    local = dict(enumerate(columns[: degree + 1]))
    distributed = dict(zip(powers, columns[degree + 1 :], strict=True))
    Q: Polynomial = {}
    S: Polynomial = {}
    R: Kernel = {}
    for a, right in local.items():
        for k, factor in weight.items():
            add_to(Q, a + k, submatrix(M, u, right) * factor)
    for (a, b), right in distributed.items():
        add_to(Q, b, submatrix(M, u, right) * moment(weight, a))
    for (a, left), (other, right) in product(local.items(), local.items()):
        for k, factor in weight.items():
            add_to(S, a + other + k, submatrix(M, left, right) * factor)
    for (a, left), ((other, b), right) in product(local.items(), distributed.items()):
        part = submatrix(M, left, right)
        for k, factor in weight.items():
            add_to(R, (a + other + k, b), part * factor)
            add_to(R, (b, a + other + k), part.transpose() * factor)
    for ((a, b), left), ((other, c), right) in product(distributed.items(), distributed.items()):
        add_to(R, (b, c), submatrix(M, left, right) * moment(weight, a + other))
    return Form(submatrix(M, u, u) * moment(weight, 0), Q, S, R)


Squared = tuple[Mapping[int, int], int, Powers]
"""The weight of a square, the degree of Z_1, the powers of s and t in Z_2."""


def bases(degree: int, rule: str) -> list[Squared]:
    """The squares of a degree with the weights 1 and -s(s+1).

    The second is one degree lower, but for powers of the outer variable alone.
    """
    orders = ((UNIFORM, degree), (BUMP, degree - 1))
    return [(weight, order, kernels(degree if rule == "outer" else order, rule)) for weight, order in orders]


def of_grams(grams: Sequence[fmpq_mat], path: str, points: int, functions: int, degree: int, rule: str) -> Form:
    """The form with these Gram matrices on the `bases` of a degree; refuses those of another size, or indefinite.

    path: where they stand in the certificate.
    """
    parts = []
    for gram, (weight, order, powers) in zip(grams, bases(degree, rule), strict=True):
        size, name = basis_size(points, functions, order, powers), f"{path} of degree {order}"
        require(gram.nrows() == size, f"{name} must have {size} rows, got {gram.nrows()}")
        decide(definite(gram, name))
        parts.append(square(gram, weight, points, functions, order, powers))
    return total(*parts)


@dataclass(frozen=True)
class Proof:
    """Coordinates in which C2 = [0 c], the Gram matrices of the storage V and of the dissipation N for the weights 1
    and -s(s+1); path: where it stands in the certificate."""

    change: fmpq_mat
    storage: list[fmpq_mat]
    dissipation: list[fmpq_mat]
    path: str


def read_proof(value: Any, path: str, n: int) -> Proof:
    """{change (n, n), storage, dissipation} of a plant with n states."""
    grams = sized(sequence, symmetric, 2)
    readers: Mapping[str, Reader] = {"change": sized(matrix, n, n), "storage": grams, "dissipation": grams}
    return Proof(**record(value, path, readers), path=path)


def require_level(plant: DelayPlant, gamma: fmpq, degree: int, proof: Proof, rule: str = "each") -> None:
    """Refuse unless it is proved that the gains of Theorem 3 at this degree give an L2 gain below gamma.

    rule: one of `forms.RULES`; "each" is the tensor rule.
    """
    inner = measured_last(plant, proof.change)
    n, functions = plant.states, plant.late.ncols()
    V = of_grams(proof.storage, f"{proof.path}.storage", n, functions, degree, rule)
    N = of_grams(proof.dissipation, f"{proof.path}.dissipation", plant.points, functions, degree, rule)
    for power, part in V.S.items():
        for i, j in product(range(functions), repeat=2):
            require(i // n == j // n or part[i, j] == 0, f"V couples two delays in S at power {power}")
    require_zero(total(rate(inner, gamma, V), N), inner, cancelled=False, what="the identity of Theorem 3 fails")


@dataclass(frozen=True)
class Motion:
    """The error and its history by the signals v = (w, v, e, l): e = e'v and so on, with f' = rates df/ds.

    error, drift: e and its derivative; start, end: f(0), which is e for every delay, and f(-1) = l.
    """

    error: fmpq_mat
    drift: fmpq_mat
    start: fmpq_mat
    end: fmpq_mat
    rates: fmpq_mat

    def ends(self, power: int) -> Any:
        """s^power f(s) at 0, less that at -1."""
        return self.start * 0**power - self.end * (-1) ** power


def motion(plant: DelayPlant) -> Motion:
    """e' = A0 e + [A_1 ..] l - B w, and rates = 1/delay."""
    n, width = plant.states, plant.late.ncols()
    above = plant.B.ncols() + plant.C10.nrows()
    error = block([[zeros(above, n)], [identity(n)], [zeros(width, n)]])
    rates = zeros(width, width)
    for k in range(width):
        rates[k, k] = 1 / plant.delays[k // n]
    unmoved = zeros(plant.C10.nrows(), n)
    return Motion(
        error,
        block([[-plant.B.transpose()], [unmoved], [plant.A0.transpose()], [plant.late.transpose()]]),
        block([[error] * len(plant.delays)]),
        block([[zeros(above + n, width)], [identity(width)]]),
        rates,
    )


def supplied(plant: DelayPlant, gamma: fmpq) -> fmpq_mat:
    """2 v'z - gamma(|w|^2 + |v|^2) as a matrix on (w, v, e, l)."""
    r, p, rest = plant.B.ncols(), plant.C10.nrows(), plant.states + plant.late.ncols()
    output = block([[plant.C10, plant.late_output]])
    return block(
        [
            [identity(r) * -gamma, zeros(r, p), zeros(r, rest)],
            [zeros(p, r), identity(p) * -gamma, output],
            [zeros(rest, r), output.transpose(), zeros(rest, rest)],
        ]
    )


def rate(plant: DelayPlant, gamma: fmpq, V: Form) -> Form:
    """dV/dt + 2 v'z - gamma(|w|^2 + |v|^2) on (w, v, e, l) and the histories f, integrated by parts.

    The derivative of a power of zero has the factor zero, wherever it is added.
    """
    at = motion(plant)
    P, crossing = supplied(plant, gamma), at.drift * V.P * at.error.transpose()
    Q: Polynomial = {}
    S: Polynomial = {}
    R: Kernel = {}
    for power, part in V.Q.items():
        crossing += at.error * part * at.rates * at.ends(power).transpose()
        add_to(Q, power, at.drift * part)
        add_to(Q, max(power - 1, 0), at.error * part * at.rates * -power)
    for power, part in V.S.items():
        P += at.start * part * at.rates * at.start.transpose() * 0**power
        P -= at.end * part * at.rates * at.end.transpose() * (-1) ** power
        add_to(S, max(power - 1, 0), part * at.rates * -power)
    for (first, second), part in V.R.items():
        moved, lower = at.rates * part * -first, max(first - 1, 0)
        add_to(Q, second, at.ends(first) * at.rates * part)
        add_to(R, (lower, second), moved)
        add_to(R, (second, lower), moved.transpose())
    return Form(P + crossing + crossing.transpose(), Q, S, R)


def require_zero(form: Form, plant: DelayPlant, *, cancelled: bool, what: str) -> None:
    """Refuse unless all coefficients vanish that 2<e, Z C2 e> can cancel (`cancelled`), or all that it cannot.

    Z maps the measured parts of e, of l and of f to the whole of e and f: it reaches (e, e), (e, f) and (f, f) where
    either side is measured, and (e, l) and (f, l) where l is measured; in S it acts within one delay.
    """
    n, q = plant.states, plant.C2.nrows()
    start = plant.B.ncols() + plant.C10.nrows()
    late = start + n

    def seen(i: int) -> bool:
        return i % n >= n - q

    def between_points(i: int, j: int) -> bool:
        low, high = min(i, j), max(i, j)
        return start <= low < late and (seen(high - start) or (high < late and seen(low - start)))

    def to_history(i: int, j: int) -> bool:
        return i >= start and (seen(i - start) or (i < late and seen(j)))

    def kernel(i: int, j: int) -> bool:
        return seen(i) or seen(j)

    def local(i: int, j: int) -> bool:
        return i // n == j // n and kernel(i, j)

    parts = [(form.P, between_points, "P")]
    parts += [(part, to_history, f"Q, power {power}") for power, part in form.Q.items()]
    parts += [(part, local, f"S, power {power}") for power, part in form.S.items()]
    parts += [(part, kernel, f"R, powers {powers}") for powers, part in form.R.items()]
    for part, reached, name in parts:
        for i in range(part.nrows()):
            for j in range(part.ncols()):
                if reached(i, j) is cancelled:
                    decide(equal(part[i, j], 0, f"{what} in {name}: entry ({i}, {j}) is {part[i, j]}"))

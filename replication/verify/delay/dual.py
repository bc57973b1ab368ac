"""How low the level of Theorem 3 can be at one degree: a linear functional that is non-negative on both cones.

The functional is applied to the identity of Theorem 3. It is zero on what Z cancels, and non-negative on N and on dV/dt
for every V and N of this degree; so the level is at least its value on 2 v'z over that on |w|^2 + |v|^2.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from operator import ge
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import below, block, zeros
from replication.verify.algebra.work import bits, multiplying, spend
from replication.verify.delay import sos
from replication.verify.delay.levels import DEGREE, DEGREES, LEAST, ONE_VARIABLE, TENSOR, narrow
from replication.verify.delay.plant import DelayPlant, measured_last, on_plant
from replication.verify.delay.sos import BUMP, UNIFORM, Form, Powers, Squared, basis_size, moment
from replication.verify.kernel import AtMost, Below, Nonnegative, decide
from replication.verify.predicate import Says
from replication.verify.reading import fields, matrices, matrix, sequence, sized, symmetric
from replication.verify.statement import LOWER, Depends


@dataclass(frozen=True)
class Functional:
    """The weight of every coefficient of a form; and those of the coefficients of S of V between two delays."""

    weights: Form
    coupling: list[fmpq_mat]

    def of_rate(self, plant: DelayPlant) -> Form:
        """The weights on V of the value on dV/dt: each term of `rate` from its other side.

        Of an S that couples two delays, which is not allowed, any value serves.
        """
        at, W, (n, width) = sos.motion(plant), self.weights, (plant.states, plant.late.ncols())
        spend(len(W.R) * plant.points * width**2 * 2 * multiplying(_length(W), 60), "the functional on rates")
        drift, error, both = at.drift.transpose(), at.error.transpose(), W.P + W.P.transpose()

        def within(c: int) -> Any:
            start, end = (point.transpose() * W.P * point for point in (at.start, at.end))
            return (start * 0**c - end * (-1) ** c - W.S[max(c - 1, 0)] * c) * at.rates

        def kernel(a: int, b: int) -> Any:
            slope = W.R[max(a - 1, 0), b] + W.R[b, max(a - 1, 0)].transpose()
            return at.rates * (at.ends(a).transpose() * W.Q[b] - slope * a)

        return Form(
            drift * both * at.error,
            {c: drift * Q + error * (both * at.ends(c) - W.Q[max(c - 1, 0)] * c) * at.rates for c, Q in W.Q.items()},
            {c: _mask(within(c), n, inside=True) + _mask(self.coupling[c], n, inside=False) for c in W.S},
            {(a, b): kernel(a, b) for a, b in W.R},
        )


@on_plant(
    "delay.degree-lower",
    parameters={"degree": DEGREE},
    bound=LOWER,
    says=Says(quantity=LEAST, readings=(TENSOR,)),
    witness={
        "change": Depends(lambda values: sized(matrix, values.plant.states, values.plant.states)),
        "functional": Depends(lambda values: sized(read_functional, values.plant, 2 * values.degree + 1)),
    },
)
def degree_lower(plant: DelayPlant, degree: int, lower: fmpq, change: fmpq_mat, functional: Functional) -> None:
    """<The plant {plant.name}: Theorem 3|The plant: the sum-of-squares program> with the squares of degree {degree} by
    the tensor rule is infeasible below {lower:down}; other degree rules may allow less.

    The tensor rule: powers of s and of t up to the degree each, with the weight 1; one less with -s(s + 1).
    """
    _require_functional(plant, sos.bases(degree, "each"), lower, change, functional)


@on_plant(
    "delay.narrow-lower",
    parameters={"degree": DEGREE, "rule": ONE_VARIABLE},
    bound=LOWER,
    says=tuple(narrow(degree, ge) for degree in DEGREES),
    witness={
        "change": Depends(lambda values: sized(matrix, values.plant.states, values.plant.states)),
        "functional": Depends(lambda values: sized(read_functional, values.plant, 2 * values.degree + 3)),
    },
)
def narrow_lower(
    plant: DelayPlant, degree: int, rule: str, lower: fmpq, change: fmpq_mat, functional: Functional
) -> None:
    """<The plant {plant.name}: Theorem 3|The plant: the sum-of-squares program> with the squares of degree {degree} or
    less, with the weight 1 and with -s(s + 1), and powers of the {rule} variable alone in Z_2 is infeasible below
    {lower:down}; other degree rules may allow less.
    """
    powers = sos.kernels(degree, rule)
    squares = [(weight, degree, powers) for weight in (UNIFORM, BUMP)]
    _require_functional(plant, squares, lower, change, functional)


def _require_functional(
    plant: DelayPlant, squares: Sequence[Squared], lower: fmpq, change: fmpq_mat, functional: Functional
) -> None:
    """Refuse unless the functional is non-negative on all squares of these kinds and gives the level."""
    plant = measured_last(plant, change)
    sos.require_zero(functional.weights, plant, cancelled=True, what="the functional sees what Z cancels")
    supply, without = (_inner(functional.weights.P, sos.supplied(plant, fmpq(gamma))) for gamma in (0, 1))
    level = supply - without
    decide(Below(0, level, "the functional is not positive on |w|^2 + |v|^2"))
    decide(AtMost(lower * level, supply, f"the functional gives {below(supply / level)} only"))
    on_cones = {"N": functional.weights, "dV/dt": functional.of_rate(plant)}
    for weight, order, powers in squares:
        for name, weights in on_cones.items():
            gram = _on_squares(weights, plant.late.ncols(), weight, order, powers)
            decide(Nonnegative(gram, f"the functional on {name} of degree {order}"))


def _length(W: Form) -> int:
    return bits(W.P, *W.Q.values(), *W.S.values(), *W.R.values())


def _inner(first: fmpq_mat, second: fmpq_mat) -> fmpq:
    return sum((a * b for a, b in zip(first.entries(), second.entries(), strict=True)), fmpq(0))


def read_functional(value: Any, path: str, plant: DelayPlant, powers: int) -> Functional:
    """{P, Q, S, R, coupling}: a weight for each coefficient of a form, as many powers."""
    points, functions = plant.points, plant.late.ncols()
    P, Q, S, R, coupling = fields(value, path, "P", "Q", "S", "R", "coupling")
    kernels = sequence(R, f"{path}.R", sized(matrices, functions, functions, powers), powers)
    weights = Form(
        symmetric(P, f"{path}.P", points),
        dict(enumerate(matrices(Q, f"{path}.Q", points, functions, powers))),
        dict(enumerate(matrices(S, f"{path}.S", functions, functions, powers))),
        {(a, b): kernel for a, row in enumerate(kernels) for b, kernel in enumerate(row)},
    )
    return Functional(weights, matrices(coupling, f"{path}.coupling", functions, functions, powers))


def _mask(M: fmpq_mat, n: int, *, inside: bool) -> fmpq_mat:
    """The n x n blocks on the diagonal, or all the others."""
    size = M.nrows()
    entries = [M[i, j] if (i // n == j // n) is inside else 0 for i in range(size) for j in range(size)]
    return fmpq_mat(size, size, entries)


def _on_squares(W: Form, functions: int, weight: Mapping[int, int], degree: int, powers: Powers) -> fmpq_mat:
    """The symmetric matrix G with trace(G M) the value of these weights on `square` of M, for every symmetric M."""
    points = W.P.nrows()
    size = basis_size(points, functions, degree, powers)
    spend(size**2 * (2_000 + 5 * _length(W)), f"the functional on squares of degree {degree}")

    def weighted(table: Callable[[int], fmpq_mat], power: int) -> fmpq_mat:
        first, *others = (table(power + k) * factor for k, factor in weight.items())
        return sum(others, first)

    def kernel(b: int, a: int) -> fmpq_mat:
        return W.R[a, b] + W.R[b, a].transpose()

    local, under, beside = range(degree + 1), zeros(functions, points), zeros(functions, functions)
    rows = [
        [
            W.P * moment(weight, 0),
            *[weighted(W.Q.__getitem__, a) for a in local],
            *[W.Q[b] * moment(weight, a) for a, b in powers],
        ]
    ]
    for a in local:
        at_s = [weighted(W.S.__getitem__, a + c) for c in local]
        rows += [[under, *at_s, *[weighted(partial(kernel, b), a + c) for c, b in powers]]]
    for a, b in powers:
        rows += [[under, *[beside for _ in local], *[W.R[b, d] * moment(weight, a + c) for c, d in powers]]]
    half = block(rows)
    return (half + half.transpose()) / 2

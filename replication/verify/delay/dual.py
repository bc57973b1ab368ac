"""How low the level of Theorem 3 can be at one degree: a linear functional that is non-negative on both cones.

The functional is applied to the identity of Theorem 3. It is zero on what Z cancels, and non-negative on N and on dV/dt
for every V and N of this degree; so the level is at least its value on 2 v'z over that on |w|^2 + |v|^2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.decimals import below
from replication.verify.algebra.linear import zeros
from replication.verify.algebra.work import spend
from replication.verify.delay.forms import BUMP, UNIFORM, Form, Powers, basis_size, kernels, square
from replication.verify.delay.levels import DEGREES, LEAST, NARROW, TENSOR, one_variable
from replication.verify.delay.plant import DelayPlant, measured_last, on_plant
from replication.verify.delay.sos import Squared, bases, rate, require_zero
from replication.verify.kernel import AtMost, Below, Nonnegative, decide
from replication.verify.reading import fields, integer, matrices, matrix, sequence, sized, symmetric
from replication.verify.says import Says
from replication.verify.statement import LOWER, Depends


@dataclass(frozen=True)
class Functional:
    """The weight of every coefficient of a form; and those of the coefficients of S of V between two delays."""

    weights: Form
    coupling: list[fmpq_mat]

    def of(self, form: Form) -> fmpq:
        """The value on a form."""
        pairs = [(self.weights.P, form.P)]
        pairs += [(self.weights.Q[power], part) for power, part in form.Q.items()]
        pairs += [(self.weights.S[power], part) for power, part in form.S.items()]
        pairs += [(self.weights.R[powers], part) for powers, part in form.R.items()]
        return sum((_inner(weight, part) for weight, part in pairs), fmpq(0))

    def of_rate(self, plant: DelayPlant) -> Callable[[Form], fmpq]:
        """The value on dV/dt as a function of V, of which S couples no two delays: where it would, any value serves."""
        n = plant.states
        supply = self.of(rate(plant, fmpq(0), Form(zeros(n, n), {}, {}, {})))

        def value(V: Form) -> fmpq:
            within = {power: _mask(part, n, inside=True) for power, part in V.S.items()}
            across = [_inner(self.coupling[power], _mask(part, n, inside=False)) for power, part in V.S.items()]
            return sum(across, self.of(rate(plant, fmpq(0), replace(V, S=within))) - supply)

        return value


def _inner(first: fmpq_mat, second: fmpq_mat) -> fmpq:
    return sum((a * b for a, b in zip(first.entries(), second.entries(), strict=True)), fmpq(0))


@on_plant(
    "delay.degree-lower",
    parameters={"degree": sized(integer, 1)},
    bound=LOWER,
    says=Says(quantity=LEAST, readings=(TENSOR,)),
    witness={
        "change": Depends(lambda given: sized(matrix, given.plant.states, given.plant.states)),
        "functional": Depends(lambda given: sized(read_functional, given.plant, 2 * given.degree + 1)),
    },
)
def degree_lower(plant: DelayPlant, degree: int, lower: fmpq, change: fmpq_mat, functional: Functional) -> None:
    """<The plant {plant.name}: Theorem 3|The plant: the sum-of-squares program> with the squares of degree {degree} by
    the tensor rule is infeasible below {lower:down}; other degree rules may allow less.

    The tensor rule: powers of s and of t up to the degree each, with the weight 1; one less with -s(s + 1).
    """
    _require_functional(plant, bases(degree, "each"), lower, change, functional)


def narrow_below(degree: int) -> Says:
    """What no squares of a degree, or more, with kernels in one variable reach under the rule that they go by."""
    return Says(
        quantity=LEAST,
        setting={"degree": degree},
        readings=lambda parameters: (NARROW[parameters["rule"]],) if parameters["degree"] >= degree else (),
    )


@on_plant(
    "delay.narrow-lower",
    parameters={"degree": sized(integer, 1), "rule": one_variable},
    bound=LOWER,
    says=tuple(map(narrow_below, DEGREES)),
    witness={
        "change": Depends(lambda given: sized(matrix, given.plant.states, given.plant.states)),
        "functional": Depends(lambda given: sized(read_functional, given.plant, 2 * given.degree + 3)),
    },
)
def narrow_lower(
    plant: DelayPlant, degree: int, rule: str, lower: fmpq, change: fmpq_mat, functional: Functional
) -> None:
    """<The plant {plant.name}: Theorem 3|The plant: the sum-of-squares program> with the squares of degree {degree} or
    less, with the weight 1 and with -s(s + 1), and powers of the {rule} variable alone in Z_2 is infeasible below
    {lower:down}; other degree rules may allow less.
    """
    powers = kernels(degree, rule)
    squares = [(weight, degree, powers) for weight in (UNIFORM, BUMP)]
    _require_functional(plant, squares, lower, change, functional)


def _require_functional(
    plant: DelayPlant, squares: Sequence[Squared], lower: fmpq, change: fmpq_mat, functional: Functional
) -> None:
    """Refuse unless the functional is non-negative on all squares of these kinds and gives the level."""
    plant = measured_last(plant, change)
    n, functions, points = plant.states, plant.late.ncols(), plant.points
    require_zero(functional.weights, plant, cancelled=True, what="the functional sees what Z cancels")
    nothing = Form(zeros(n, n), {}, {}, {})
    supply = functional.of(rate(plant, fmpq(0), nothing))
    level = supply - functional.of(rate(plant, fmpq(1), nothing))
    decide(Below(0, level, "the functional is not positive on |w|^2 + |v|^2"))
    decide(AtMost(lower * level, supply, f"the functional gives {below(supply / level)} only"))
    for weight, order, powers in squares:
        for name, count, value in (("N", points, functional.of), ("dV/dt", n, functional.of_rate(plant))):
            gram = _on_squares(value, weight, count, functions, order, powers)
            decide(Nonnegative(gram, f"the functional on {name} of degree {order}"))


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


def _on_squares(
    value: Callable[[Form], fmpq], weight: Mapping[int, int], points: int, functions: int, degree: int, powers: Powers
) -> fmpq_mat:
    """The symmetric matrix G with value(square(M)) = trace(G M) for every symmetric M."""
    size = basis_size(points, functions, degree, powers)
    spend(size**2 * len(powers) ** 2 * (10_000 + 1_000 * functions**2), f"the functional on squares of degree {degree}")
    result = zeros(size, size)
    for i in range(size):
        for j in range(i + 1):
            unit = zeros(size, size)
            unit[i, j] = unit[j, i] = fmpq(1)
            result[i, j] = result[j, i] = value(square(unit, weight, points, functions, degree, powers)) / (
                1 if i == j else 2
            )
    return result

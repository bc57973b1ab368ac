"""Observers of systems with delayed states (Peet and Gu): levels from both sides, and characteristic roots."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from operator import ge, le
from typing import Any

from flint import acb, fmpq, fmpq_mat

from replication.verify.algebra.linear import below, block, zeros
from replication.verify.algebra.work import bits, multiplying, spend
from replication.verify.delay import sos
from replication.verify.delay.plant import DelayPlant, characteristic, hidden, measured_last, on_plant, require_hidden
from replication.verify.delay.sos import (
    BUMP,
    UNIFORM,
    Form,
    Powers,
    Proof,
    Squared,
    basis_size,
    moment,
    read_proof,
    require_level,
)
from replication.verify.kernel import at_most, decide, less, semidefinite
from replication.verify.predicate import Chosen, Says
from replication.verify.reading import (
    fields,
    integer,
    matrices,
    matrix,
    one_of,
    positive,
    rational,
    record,
    sequence,
    several,
    sized,
    symmetric,
)
from replication.verify.statement import LOWER, UPPER, Depends, statement
from replication.verify.theorem import Found, require

DEGREE = sized(integer, 1)
DEGREES = (1, 2, 3, 4)
"""Those of the paper's tables and text."""
LEAST, GAIN, RATIO, MET = "least level of Theorem 3", "gain of the error", "gain over the least", "Theorem 3 met"
OBSERVERS = ("observers by Theorem 3",)
TENSOR = "z2-each"
BY_EACH = (TENSOR, "z2-each-same", "z2-wide", "z2-each-wide")
BY_TOTAL = ("z2-total", "z2-total-same", "z2-total-wide", "z2-total-z1", "z2-total-next")
NARROW = {"outer": "z2-outer", "inner": "z2-inner"}
"""Readings of the degree rule of Z_2: those that hold all powers up to the degree in each variable, those that hold
all of that total degree at least, and those with one variable only, by their rule in `forms`."""
ONE_VARIABLE = sized(one_of, NARROW)
"""The reader of the variable of which alone the kernels hold powers."""
ALL = (*BY_EACH, *BY_TOTAL, *NARROW.values())
"""Readings under which no observer is better than a lower bound."""
UNDER = ("none", TENSOR, "sinc")
"""Readings under which the text speaks of the gain of such an observer, and of conditions that are met."""


def at(degree: int, readings: Chosen[tuple[str, ...]]) -> Says:
    """The least level at a degree, under readings by the parameters."""
    return Says(quantity=LEAST, setting={"degree": degree}, readings=readings)


def above(degree: int, *, total: bool = False) -> Says:
    """What squares of a degree, in each variable or in total, or less of it, are for a rule that allows as much."""

    def readings(parameters: Mapping[str, Any]) -> tuple[str, ...]:
        least = parameters["degree"]
        if least > degree:
            return ()
        # Powers of s and t up to d each have total degree 2 d at most; of total degree d they are up to d each.
        return (*BY_EACH, *(BY_TOTAL if total or 2 * least <= degree else ()))

    return at(degree, readings)


def narrow(degree: int, within: Callable[[int, int], bool] = le) -> Says:
    """What squares of a degree, or less (of the lower bounds: or more), in one variable are under their own rule."""
    return at(degree, lambda parameters: (NARROW[parameters["rule"]],) if within(parameters["degree"], degree) else ())


def ratio(degree: int) -> Says:
    """How near an observer of a degree, or of less, comes to the best."""
    says = at(degree, lambda parameters: UNDER if parameters["degree"] <= degree else ())
    return replace(says, quantity=RATIO, estimators=OBSERVERS, found=lambda known: Found(upper=known["factor"]))


REACHED = Says(quantity=GAIN, estimators=OBSERVERS, setting={}, readings=UNDER)
FEASIBLE = Says(quantity=MET, setting={}, readings=UNDER, found=lambda known: Found(holds=True))
PROOF = Depends(lambda values: sized(read_proof, values.plant.states))


@on_plant(
    "delay.gain-upper",
    parameters={"degree": DEGREE},
    bound=UPPER,
    witness=PROOF,
    says=(*map(above, DEGREES), REACHED, FEASIBLE),
)
def gain_upper(plant: DelayPlant, degree: int, upper: fmpq, witness: Proof) -> None:
    """<The plant {plant.name}: Theorem 3|The plant: the sum-of-squares program>, with the squares of degree {degree} by
    the tensor rule or more, is feasible at the level {upper:up} with some positive eps, and the observer with the gains
    of its storage has an L2 gain from w to the error of z below it.
    """
    require_level(plant, upper, degree, witness)


@on_plant(
    "delay.total-upper",
    parameters={"degree": DEGREE},
    bound=UPPER,
    witness=PROOF,
    says=tuple(above(degree, total=True) for degree in DEGREES),
)
def total_upper(plant: DelayPlant, degree: int, upper: fmpq, witness: Proof) -> None:
    """<The plant {plant.name}: Theorem 3|The plant: the sum-of-squares program>, with the squares of total degree
    {degree} or more, and so by the tensor rule, is feasible at the level {upper:up}.
    """
    require_level(plant, upper, degree, witness, "total")


@on_plant(
    "delay.narrow-upper",
    parameters={"degree": DEGREE, "rule": ONE_VARIABLE},
    bound=UPPER,
    witness=PROOF,
    says=tuple(map(narrow, DEGREES)),
)
def narrow_upper(plant: DelayPlant, degree: int, rule: str, upper: fmpq, witness: Proof) -> None:
    """<The plant {plant.name}: Theorem 3|The plant: the sum-of-squares program>, with the squares of degree {degree} or
    more and powers of the {rule} variable alone in Z_2, is feasible at the level {upper:up}.
    """
    require_level(plant, upper, degree, witness, rule)


@on_plant("delay.gain-lower", bound=LOWER, witness=Depends(hidden), says=tuple(at(degree, ALL) for degree in DEGREES))
def gain_lower(plant: DelayPlant, lower: fmpq, frequency: fmpq, state: fmpq_mat) -> None:
    """The plant< {plant.name}|>: no observer, causal or not, has an L2 gain from w to the error of z below
    {lower:down}: near {frequency:down 6} rad/s a disturbance with y = 0 has that gain to z.
    """
    require_hidden(plant, lower, frequency, state)


@on_plant(
    "delay.near-optimal",
    parameters={"degree": DEGREE, "factor": positive},
    witness={"level": positive, "hidden": Depends(lambda values: sized(record, hidden(values))), "sos": PROOF},
    holds=True,
    says=(*map(ratio, DEGREES), FEASIBLE),
)
def near_optimal(plant: DelayPlant, degree: int, factor: fmpq, level: fmpq, hidden: dict[str, Any], sos: Proof) -> None:
    """The plant< {plant.name}|>: the observer with the gains of a storage of degree {degree}< that meets Theorem 3 with
    some positive eps|> has an L2 gain below {level:up}, and at most {factor} times that of any observer, causal or not.
    """
    require_level(plant, level, degree, sos)
    require_hidden(plant, level / factor, **hidden)


@on_plant("delay.unstable", witness={"left": positive, "right": positive}, holds=True, says="unstable")
def unstable(plant: DelayPlant, left: fmpq, right: fmpq) -> None:
    """The plant< {plant.name}|> is unstable: it has a characteristic root between {left:down 6} and {right:up 6} per
    second.

    det M(s) changes its sign between two positive s, so that it has a positive real root.
    """
    require(left < right, "witness.left must be below witness.right")
    ends = [characteristic(plant, acb(point)).det().real for point in (left, right)]
    decide(less(ends[0] * ends[1], 0, "det M does not change its sign between the two points"))


@statement(
    "delay.not-unstable",
    source="peet2019",
    parameters={"eigenvalues": sized(several, rational)},
    holds=False,
    says=Says(
        quantity="Example 4 unstable",
        setting={},
        readings=lambda parameters: ("jordan-one",) if parameters["eigenvalues"] == ["1"] else (),
    ),
)
def not_unstable(eigenvalues: list[fmpq]) -> Found:
    """If J, whose eigenvalues are not printed, has none but {listed}, Example 4 is exponentially stable for any number
    of states and delays: no characteristic root has a real part of zero or more.

    It says nothing of other eigenvalues: with zero and two states or more the state can grow, and others make it grow
    exponentially.

    Its roots are those of s + (a/K) sum exp(-s i/K), i = 1..K, for each eigenvalue a of J (in a basis in which J is
    triangular, det M is the product of these). With 0 < a <= 1, a root with Re s >= 0 has |s| <= 1, so that |Im s| i/K
    <= 1 < pi/2 and the real part is positive.
    """
    for i, value in enumerate(eigenvalues):
        require(0 < value <= 1, f"eigenvalue {i} is not above 0 and at most 1")
    return Found(words={"listed": ", ".join(map(str, eigenvalues))})


# How low the level of Theorem 3 can be at one degree: a linear functional that is non-negative on both cones.
#
# The functional is applied to the identity of Theorem 3. It is zero on what Z cancels, and non-negative on N and on
# dV/dt for every V and N of this degree; so the level is at least its value on 2 v'z over that on |w|^2 + |v|^2.


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
    decide(less(0, level, "the functional is not positive on |w|^2 + |v|^2"))
    decide(at_most(lower * level, supply, f"the functional gives {below(supply / level)} only"))
    on_cones = {"N": functional.weights, "dV/dt": functional.of_rate(plant)}
    for weight, order, powers in squares:
        for name, weights in on_cones.items():
            gram = _on_squares(weights, plant.late.ncols(), weight, order, powers)
            decide(semidefinite(gram, f"the functional on {name} of degree {order}"))


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

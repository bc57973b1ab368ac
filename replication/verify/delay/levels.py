"""Observers of systems with delayed states (Peet and Gu): levels from both sides, and characteristic roots."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from operator import le
from typing import Any

from flint import acb, fmpq

from replication.verify.delay.plant import DelayPlant, Hidden, characteristic, on_plant, read_hidden, require_hidden
from replication.verify.delay.sos import Proof, read_proof, require_level
from replication.verify.kernel import Below, decide
from replication.verify.predicate import Chosen, Says
from replication.verify.reading import integer, one_of, positive, rational, several, sized
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
HIDDEN = Depends(lambda values: sized(read_hidden, values.plant.states))
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


@on_plant("delay.gain-lower", bound=LOWER, witness=HIDDEN, says=tuple(at(degree, ALL) for degree in DEGREES))
def gain_lower(plant: DelayPlant, lower: fmpq, witness: Hidden) -> None:
    """The plant< {plant.name}|>: no observer, causal or not, has an L2 gain from w to the error of z below
    {lower:down}: near {witness.frequency:down 6} rad/s a disturbance with y = 0 has that gain to z.
    """
    require_hidden(plant, lower, witness)


@on_plant(
    "delay.near-optimal",
    parameters={"degree": DEGREE, "factor": positive},
    witness={"level": positive, "hidden": HIDDEN, "sos": PROOF},
    holds=True,
    says=(*map(ratio, DEGREES), FEASIBLE),
)
def near_optimal(plant: DelayPlant, degree: int, factor: fmpq, level: fmpq, hidden: Hidden, sos: Proof) -> None:
    """The plant< {plant.name}|>: the observer with the gains of a storage of degree {degree}< that meets Theorem 3 with
    some positive eps|> has an L2 gain below {level:up}, and at most {factor} times that of any observer, causal or not.
    """
    require_level(plant, level, degree, sos)
    require_hidden(plant, level / factor, hidden)


@on_plant("delay.unstable", witness={"left": positive, "right": positive}, holds=True, says="unstable")
def unstable(plant: DelayPlant, left: fmpq, right: fmpq) -> None:
    """The plant< {plant.name}|> is unstable: it has a characteristic root between {left:down 6} and {right:up 6} per
    second.

    det M(s) changes its sign between two positive s, so that it has a positive real root.
    """
    require(left < right, "witness.left must be below witness.right")
    ends = [characteristic(plant, acb(point)).det().real for point in (left, right)]
    decide(Below(ends[0] * ends[1], 0, "det M does not change its sign between the two points"))


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

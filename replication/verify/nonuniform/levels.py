"""Statements on the gain of filters under nonuniform sampling: for given filters, and for every filter of form (4)."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.linear import block, energy, hold, identity, product, solved, zeros
from replication.verify.algebra.work import BALL, spend
from replication.verify.kernel import at_most, decide, definite, hurwitz
from replication.verify.nonuniform import gain, system
from replication.verify.nonuniform.gain import ATTAINED, Storage
from replication.verify.nonuniform.system import (
    PERIOD,
    SCOPE,
    Case,
    Filter,
    Plant,
    Time,
    on_filtered,
    on_plant,
    seconds,
)
from replication.verify.predicate import NO_READING, Says
from replication.verify.reading import fields, matrices, positive, rational, sequence, sized, square
from replication.verify.statement import BOTH, LOWER, UPPER, Depends
from replication.verify.theorem import Found, require

# A level that no filter of form (4) attains at a constant period: disturbances that the measurements do not show.
#
# A filter that has seen only zero measurements estimates zero. If w_k for k <= 0, from rest in the distant past, gives
# y_k = 0 for all k <= 0, the errors are e_k = L x_k for k <= 1, whatever the filter; so its gain is at least
# (sum_{k <= 1} |L x_k|^2 / sum_{k <= 0} |w_k|^2)^(1/2).


def require_no_filter_below(plant: Plant, period: Time, level: fmpq, start: list[fmpq]) -> None:
    """Refuse unless every filter of form (4) with A_f Schur has a gain above `level` at this constant period.

    D = 0: nothing is seen of w_0 = start before k = 1. D invertible: `start` is x_0, reached by w_k = -D^{-1} C x_k,
    x_{k+1} = F x_k, F = Phi - Gamma D^{-1} C; this motion comes from rest if F^{-1} is Schur, that is if all zeros of
    w -> y lie outside the unit circle. Truncated in the distant past it keeps its ratio up to any small number,
    because what the truncation shows decays with the plant, and a filter with A_f Schur answers little to it.
    """
    n = plant.order
    Phi, Gamma = hold(plant.A, plant.B, seconds(period))
    L = arb_mat(plant.L)
    x = arb_mat(len(start), 1, [arb(entry) for entry in start])
    if plant.D.rank() == 0:
        require(len(start) == plant.B.ncols(), "witness.start must be a disturbance")
        supplied, seen = energy(x), energy(L * Gamma * x)
    else:
        require(len(start) == n, "witness.start must be a state")
        require(plant.D.nrows() == plant.D.ncols(), "D is neither zero nor square")
        require(plant.D.det() != 0, "D is neither zero nor invertible")
        decide(hurwitz(plant.A, "the plant"))
        ratio = plant.D.inv() * plant.C
        back = solved(Phi - Gamma * arb_mat(ratio), arb_mat(identity(n)), "Phi - Gamma D^-1 C is not proved invertible")
        # J is Schur if X = I + J'XJ has a positive definite solution (Lyapunov).
        X = energy_before(back, arb_mat(identity(n)))
        decide(definite(X, "the energy of the zeros of w -> y, which must lie outside the unit circle,"))
        following = (Phi - Gamma * arb_mat(ratio)) * x
        supplied = _quadratic(energy_before(back, arb_mat(ratio.transpose() * ratio)), x)
        seen = _quadratic(energy_before(back, L.transpose() * L), following)
    gain.require_ratio(seen, supplied, level, "the hidden disturbance")


def energy_before(J: arb_mat, Q: arb_mat) -> arb_mat:
    """X = Q + J'XJ, for a Schur J the sum of (J^k)'Q J^k over k >= 0, by the linear equation for its entries."""
    # Before the equation is set up: its entries alone, the fourth power of the states, fill the memory first.
    spend(J.nrows() ** 6 * BALL, "the energy of a motion")
    places = [(i, j) for i in range(J.nrows()) for j in range(J.nrows())]
    equation = [[arb(int(p == q)) - J[q[0], p[0]] * J[q[1], p[1]] for q in places] for p in places]
    X = solved(arb_mat(equation), arb_mat([[entry] for entry in Q.entries()]), "the energy is not proved finite")
    return arb_mat(J.nrows(), J.nrows(), X.entries())


def _quadratic(Q: arb_mat, x: arb_mat) -> arb:
    return (x.transpose() * Q * x).trace()


GAIN, GIVEN = "gain over sequences", "the given filter"
LEAST, EVERY = "least gain over sequences", "filters of form (4)"
SEQUENCES = {"samples": "every sequence, samples", "duration": "every sequence, seconds"}
"""What the norms count: samples, a reading of the paper, or seconds, beyond its text."""
NOT_NOMINAL = "every sequence, against Theorem 3 and Sec. V-A"
"""A reading that the text rules out."""
AT_ONE_PERIOD = (NO_READING, "least nominal level", "periods of the grid")


def _readings(parameters: Mapping[str, Any]) -> tuple[str, ...]:
    """At one constant period both norms count alike, and the text speaks of it as nominal."""
    if parameters["from"] == parameters["to"]:
        return (*AT_ONE_PERIOD, "level of the filter found")
    some = ("a level, whichever", NOT_NOMINAL) if parameters["weight"] == "samples" else ()
    return (SEQUENCES[parameters["weight"]], *some)


def _range(parameters: Mapping[str, Any]) -> dict[str, Any]:
    return {name: parameters[name] for name in ("from", "to", *(("filter",) if "filter" in parameters else ()))}


OF_FILTER = Says(quantity=GAIN, estimators=(GIVEN,), setting=_range, readings=_readings)
AT_PERIOD = Says(
    quantity=LEAST,
    estimators=(EVERY,),
    setting=lambda parameters: {"from": parameters["period"], "to": parameters["period"]},
    readings=AT_ONE_PERIOD,
)
WITHIN_RANGE = Says(
    quantity=LEAST,
    estimators=(EVERY,),
    setting={"from": "h_l", "to": "h_u"},
    readings=(*SEQUENCES.values(), NOT_NOMINAL, "grid of one element"),
)
"""A constant period is one of the sequences: a lower bound there is one over the range, whatever the norms count."""

CASE = Depends(lambda values: sized(system.read_case, values.plant))
LEVEL = Depends(lambda values: partial(system.read_case, plant=values.plant, level=positive))
STORED = {
    "storage": Depends(lambda values: sized(gain.read_storage, values.plant.order + values.parameters.filter.A.nrows()))
}


@on_filtered("nonuniform.gain-upper", parameters=CASE, bound=UPPER, witness=STORED, says=OF_FILTER)
def gain_upper(plant: Plant, parameters: Case, upper: fmpq, storage: Storage) -> None:
    """The gain of the given filter {parameters.scope} is at most {upper:up}."""
    gain.require_level(plant, parameters, upper, storage)


@on_filtered("nonuniform.keeps-level", parameters=LEVEL, bound=UPPER, witness=STORED, holds=True, says=OF_FILTER)
def keeps_level(plant: Plant, parameters: Case, upper: fmpq, storage: Storage) -> None:
    """The given filter has the level {parameters.level:up} {parameters.scope}."""
    gain.require_level(plant, parameters, upper, storage)
    decide(at_most(upper, parameters.level, f"the bound {upper} exceeds the level {parameters.level}"))


@on_filtered("nonuniform.gain-lower", parameters=CASE, bound=LOWER, witness=ATTAINED, says=OF_FILTER)
def gain_lower(plant: Plant, parameters: Case, lower: fmpq, **motion: Any) -> None:
    """The gain of the given filter {parameters.scope} is more than {lower:down}."""
    gain.require_attained(plant, parameters, lower, **motion)


@on_filtered("nonuniform.breaks-level", parameters=LEVEL, bound=LOWER, witness=ATTAINED, holds=False, says=OF_FILTER)
def breaks_level(plant: Plant, parameters: Case, lower: fmpq, **motion: Any) -> None:
    """The given filter does not have the level {parameters.level:down} {parameters.scope}: its gain is more than
    {lower:down}.
    """
    gain.require_attained(plant, parameters, lower, **motion)
    decide(at_most(parameters.level, lower, f"the bound {lower} is below the level {parameters.level}"))


@on_plant(
    "nonuniform.optimum-upper",
    parameters=SCOPE,
    bound=UPPER,
    witness={
        "filter": Depends(lambda values: sized(system.read_filter, values.plant)),
        "storage": Depends(lambda values: sized(gain.read_storage, values.plant.order + values.filter.A.nrows())),
    },
    says=Says(quantity=LEAST, estimators=(EVERY,), setting=_range, readings=_readings),
)
def optimum_upper(
    plant: Plant, from_: str, to: str, weight: str, upper: fmpq, filter: Filter, storage: Storage
) -> Found:
    """Some filter of <form (4)|the form x_f(k+1) = A_f x_f(k) + B_f y(k), estimate C_f x_f(k)> has the level {upper:up}
    {scope}.
    """
    case = Case(ends=system.ends_between(plant, from_, to), weight=weight, filter=filter, level=upper)
    gain.require_level(plant, case, upper, storage)
    return Found(words={"scope": case.scope})


@on_plant(
    "nonuniform.optimum-lower",
    parameters={"period": PERIOD},
    bound=LOWER,
    witness={"start": sized(sequence, rational)},
    says=(AT_PERIOD, WITHIN_RANGE),
)
def optimum_lower(plant: Plant, period: str, lower: fmpq, start: list[fmpq]) -> Found:
    """Every stable filter of <form (4)|the form x_f(k+1) = A_f x_f(k) + B_f y(k), estimate C_f x_f(k)> has a gain above
    {lower:down} at the constant period {period} s.
    """
    constant = plant.period(period)
    require_no_filter_below(plant, constant, lower, start)
    return Found(words={"period": system.in_words(constant)})


@on_plant(
    "nonuniform.no-filter-keeps-level",
    parameters={"period": PERIOD, "level": positive},
    bound=LOWER,
    witness={"start": sized(sequence, rational)},
    holds=False,
    says=(AT_PERIOD, WITHIN_RANGE, Says(quantity="least level of (6)", setting={}, readings=("grid of one element",))),
)
def no_filter_keeps_level(plant: Plant, period: str, level: fmpq, lower: fmpq, start: list[fmpq]) -> Found:
    """No stable filter of <form (4)|the form x_f(k+1) = A_f x_f(k) + B_f y(k), estimate C_f x_f(k)> has the level
    {level:down} for every sequence of the range: at the constant period {period} s its gain is above {lower:down}<, so
    that (6) has no solution there with this level|>.

    Of a solution P-bar > 0 of the strict inequality (6) at a period the filter is Schur, and has the level there.
    """
    constant = plant.period(period)
    require_no_filter_below(plant, constant, lower, start)
    decide(at_most(level, lower, f"the bound {lower} is below the level {level}"))
    return Found(words={"period": system.in_words(constant)})


@on_filtered(
    "nonuniform.stable",
    parameters=CASE,
    holds=True,
    says=Says(
        quantity="stable for every sequence",
        setting=_range,
        estimators=(GIVEN,),
        readings=(NO_READING, "valid as stable"),
    ),
)
def stable(plant: Plant, parameters: Case) -> None:
    """The error system of the given filter is exponentially stable for every sampling sequence with periods of at least
    {parameters.least} s: A is Hurwitz, A_f Schur.
    """
    system.require_stable(plant, parameters.filter)


@dataclass(frozen=True)
class Stamped:
    """x^(k|k) = x^ + G_x v, w^ = G_w v, v = y - C x^, then the plant's own motion over the known period.

    cells: shares at which the cells end; entries: E = I - G [C, D] for each cell of the period before, G = [G_x; G_w].
    """

    cells: list[fmpq]
    entries: list[fmpq_mat]

    def steps(self, plant: Plant, step: arb_mat) -> list[arb_mat]:
        """e+ = Phi (e - G_x v) + Gamma (w - G_w v), v = C e + D w: (n, n + m)."""
        return [step * arb_mat(entry) for entry in self.entries]

    def output(self, plant: Plant) -> fmpq_mat:
        """z - z^ = L e, before the sample."""
        return plant.L


def read_stamped(value: Any, path: str, plant: Plant) -> Stamped:
    """Cells that cover the range exactly, and G (n + m, r) for each."""
    edges, gains = fields(value, path, "cells", "G")
    cells = gain.read_cells(edges, f"{path}.cells")
    output = block([[plant.C, plant.D]])
    size = output.ncols()
    G = matrices(gains, f"{path}.G", size, output.nrows(), len(cells) - 1)
    return Stamped(cells, [identity(size) - product(G_i, output) for G_i in G])


def in_coordinates(plant: Plant, filter_: Stamped, T: fmpq_mat) -> tuple[Plant, Stamped]:
    """The same for the state T x; no gain depends on that."""
    n, m = plant.order, plant.B.ncols()
    back = solved(T, identity(n), "witness.T is not invertible")
    enter, leave = (block([[M, zeros(n, m)], [zeros(m, n), identity(m)]]) for M in (T, back))
    entries = [product(product(enter, entry), leave) for entry in filter_.entries]
    A, B = product(product(T, plant.A), back), product(T, plant.B)
    return replace(plant, A=A, B=B, C=plant.C * back, L=plant.L * back), replace(filter_, entries=entries)


@on_plant(
    "nonuniform.stamped-gain",
    source="",
    bound=BOTH,
    witness={
        "filter": Depends(lambda values: sized(read_stamped, values.plant)),
        "T": Depends(lambda values: sized(square, values.plant.order)),
        "storage": Depends(lambda values: sized(gain.read_storage, values.plant.order, values.filter.cells)),
        **ATTAINED,
    },
    says=Says(
        quantity="least gain over sequences",
        estimators=("filters with time stamps",),
        found=lambda values: Found(upper=values["upper"]),
    ),
)
def stamped_gain(
    plant: Plant, lower: fmpq, upper: fmpq, filter: Stamped, T: fmpq_mat, storage: Storage, **motion: Any
) -> Found:
    """The filter with time stamps that stands here has a gain of more than {lower:down} and at most {upper:up}
    {scope}; its error settles for every such sequence.

    Nothing is asked of the plant: its state does not enter the error. The inequality of `require_level` is strict and
    its periods are those of a closed range, so that without a disturbance the storage falls by a fixed share with each
    step: the error system is stable, as `require_motion` asks. The gain at the first sample, which no period precedes,
    may be any of the filter's: each is one of the inequalities, and one step does not change what a motion tends to.
    The storage is written for the state T x: balls are narrow where it is about the identity.
    """
    moved, chosen = in_coordinates(plant, filter, T)
    case = Case(ends=(plant.h_l, plant.h_u), weight="samples", filter=chosen, level=upper)
    gain.require_level(moved, case, upper, storage)
    gain.require_motion(moved, case, lower, **motion)
    return Found(words={"scope": case.scope})

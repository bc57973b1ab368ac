"""Condition (8) itself, in balls: where one element of the grid meets it over the whole range, and where it does not.

For a constant change theta = h - h_0 the norm in (8) is that of T(z) = A Phi (zI - Phi)^-1 Delta(theta), Phi at h_0.
All factors are functions of A: with an eigenvalue a of A, T(z) has the eigenvalue (e^{ah} - e^{a h_0})/(z - e^{a h_0}),
the largest modulus of which over the circle is r(a, h) = |e^{ah} - e^{a h_0}|/(1 - |e^{a h_0}|).

And what the printed filter is: its output matrix, its observer, its size.
"""

from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.linear import above as above_
from replication.verify.algebra.linear import below as below_
from replication.verify.algebra.linear import circle_point, complex_of, hold, identity, largest, resolved, rounded_ends
from replication.verify.algebra.work import BALL, spend
from replication.verify.kernel import decide, definite, holds, hurwitz, less
from replication.verify.nonuniform.gain import Fails, Pair, require_everywhere
from replication.verify.nonuniform.grid import bounded_real
from replication.verify.nonuniform.system import PERIOD, Filter, Plant, in_words, on_filtered, on_plant, seconds
from replication.verify.predicate import Says
from replication.verify.reading import MAX_ENTRIES, fields, integer, positive, rational, sequence, sized, symmetric
from replication.verify.statement import Depends
from replication.verify.theorem import Found, require

CONDITION = Says(quantity="condition (8)", setting={}, readings=("constant change", "any change"))
HALVINGS = 12
"""Times that a piece of the range may be halved before its storage matrix is refused."""
MOST_PIECES = 200


def eigenvalues(A: fmpq_mat) -> tuple[acb, acb]:
    """Both eigenvalues of A of order two."""
    require(A.nrows() == 2, "the eigenvalues are written out for two states")
    half = (A[0, 0] + A[1, 1]) / 2
    root = acb(arb(half * half - A.det())).sqrt()
    return acb(arb(half)) + root, acb(arb(half)) - root


def modal(a: acb, h_0: arb, h: arb) -> arb:
    """r(a, h)."""
    start = (a * acb(h_0)).exp()
    return abs((a * acb(h)).exp() - start) / (1 - abs(start))


@on_plant("nonuniform.breaks-condition-8", parameters={"period": PERIOD}, holds=False, says=CONDITION)
def breaks_condition(plant: Plant, period: str) -> Found:
    """With the middle of the range for its one element (8) does not hold over the range in any coordinates: at the
    period {period} s the norm is at least {least:down 6}.

    The norm of T(z) is not below the modulus of an eigenvalue, in whatever coordinates. A constant change is one of the
    sequences, so that the gain for every sequence is no less.
    """
    decide(hurwitz(plant.A, "the plant"))
    changed = plant.period(period)
    h_0, h = seconds(plant.middle), seconds(changed)
    moduli = [modal(a, h_0, h) for a in eigenvalues(plant.A)]
    reached = [size for size in moduli if holds(less(1, size, "one"))]
    require(reached != [], f"the eigenvalues give {moduli[0].str(5)} and {moduli[1].str(5)} there, not more than one")
    return Found(words={"period": in_words(changed), "least": reached[0]})


@on_plant(
    "nonuniform.meets-condition-8",
    witness={"P": Depends(lambda values: sized(sequence, sized(symmetric, values.plant.order)))},
    holds=True,
    says=CONDITION,
)
def meets_condition(plant: Plant, P: list[fmpq_mat]) -> Found:
    """With the middle of the range for its one element (8) holds over the whole range: for every constant change in the
    coordinates of the plant, and for every sequence of changes in modal coordinates, where the norm is at most
    {most:up 6}.

    The range is cut into as many equal pieces as there are matrices P > 0 (bounded real lemma, on each piece). In modal
    coordinates the factors are diagonal, so that the gain is the largest r(a, h); for real a < 0 the modulus in r is
    largest at an end of the range.
    """
    decide(hurwitz(plant.A, "the plant"))
    require(0 < len(P) <= MOST_PIECES, f"witness.P must have 1 to {MOST_PIECES} matrices")
    values = eigenvalues(plant.A)
    trace, determinant = plant.A[0, 0] + plant.A[1, 1], plant.A.det()
    decide(less(4 * determinant, trace * trace, "the eigenvalues of A are not real and different"))
    h_0 = seconds(plant.middle)
    sizes = [modal(a, h_0, seconds(h)) for a in values for h in (plant.h_l, plant.h_u)]
    for size in sizes:
        decide(less(size, 1, "in modal coordinates the norm is not proved to be below one"))
    for k, (first, last) in enumerate(pairwise([fmpq(i, len(P)) for i in range(len(P) + 1)])):
        require_everywhere(_fails(plant, P[k]), first, last, [(k, k)], HALVINGS)
    return Found(words={"most": max(sizes, key=lambda size: float(size.upper()))})


def _fails(plant: Plant, P: fmpq_mat) -> Fails:
    """The bounded real lemma for T at the level one, C = A Phi, and the changes to all periods between two shares."""
    n, middle, unit = plant.order, seconds(plant.middle), identity(plant.order)
    Phi = hold(plant.A, plant.B, middle)[0]
    decide(definite(arb_mat(P), "witness.P"))

    def fails(a: fmpq, b: fmpq, transitions: list[Pair]) -> list[Pair]:
        spend(30 * n**3 * BALL, "condition (8)")
        h = seconds(plant.along(a)).union(seconds(plant.along(b)))
        D = hold(plant.A, unit, h - middle)[1]
        room = bounded_real(arb_mat(P), Phi, D, arb_mat(plant.A) * Phi, arb_mat(unit))
        return [] if holds(definite(room, "the bounded real lemma")) else transitions

    return fails


# The output matrices C_f with which a filter with given A_f and B_f keeps a level at the middle period: a box of them.
#
# At a point z of the unit circle the error is l(z) - C_f f(z), l = L (zI - Phi)^-1 Gamma and f the response of the
# filter's state, and a gain of at most g means |l - C_f f| <= g. So for complex numbers u_k at points z_k
#
#     sum Re(u_k f(z_k))' C_f' <= sum Re(u_k l(z_k)) + g sum |u_k|,
#
# a half-space for every choice of the u_k; that of each entry and side has a normal near to an axis.


Point = tuple[acb, acb]
"""A point of the unit circle, and the weight of the error there."""


def read_point(value: Any, path: str) -> Point:
    """{turn, u}."""
    turn, u = fields(value, path, "turn", "u")
    return circle_point(rational(turn, f"{path}.turn")), complex_of(sequence(u, f"{path}.u", rational, 2))


def read_points(value: Any, path: str, count: int) -> list[list[Point]]:
    """The points of the half-space of each entry, `count` of them."""
    points = sequence(value, path, sized(sequence, read_point), count)
    require(sum(map(len, points)) <= MAX_ENTRIES, f"{path} has more than {MAX_ENTRIES} points")
    return points


def _setting(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """The level as a decimal, as the paper has it."""
    level = Fraction(parameters["level"])
    return {"level": str(Decimal(level.numerator) / level.denominator)}


POINTS = Depends(lambda values: sized(read_points, values.plant.order))


@on_filtered(
    "nonuniform.output-matrix",
    source="mustafa",
    parameters={"level": positive},
    witness={"above": POINTS, "below": POINTS},
    says=Says(quantity="output matrix", setting=_setting),
)
def output_matrix(plant: Plant, level: fmpq, above: list[list[Point]], below: list[list[Point]]) -> Found:
    """With the given A_f and B_f and the level {level:up} at the constant period {period} s, the entries of C_f lie
    within {entries}.
    """
    filter_, single = plant.printed, plant.B.ncols() == plant.C.nrows() == plant.L.nrows() == 1
    require(single and filter_.A.nrows() == plant.order, "for one input, output and estimate, and equal orders")
    sides = [[half_space(plant, filter_, level, points) for points in side] for side in (above, below)]
    # With m the largest entry in size, c_i <= limit + tilt m and -c_i <= limit + tilt m.
    tilts = [
        largest([abs(entry - (sign if i == j else 0)) for j, entry in enumerate(normal)]) * len(normal)
        for sign, side in zip((1, -1), sides, strict=True)
        for i, (normal, _) in enumerate(side)
    ]
    tilt, most = largest(tilts), largest([limit for side in sides for _, limit in side]).max(arb(0))
    decide(less(tilt, 1, "the half-spaces do not bound C_f"))
    spare = tilt * most / (1 - tilt)
    upper, lower = ([limit + spare for _, limit in side] for side in sides)
    items = tuple((rounded_ends(-low)[0], rounded_ends(high)[1]) for low, high in zip(lower, upper, strict=True))
    require(all(low <= high for low, high in items), "no C_f has this level")
    entries = " and ".join(f"[{below_(low, 4)}, {above_(high, 4)}]" for low, high in items)
    return Found(words={"entries": entries, "period": in_words(plant.middle)}, items=items)


def half_space(plant: Plant, filter_: Filter, level: fmpq, points: list[Point]) -> tuple[list[arb], arb]:
    """The normal of a half-space in which C_f' lies, and its limit."""
    n = plant.order
    spend(len(points) * 10 * n**3 * BALL, "the responses on the unit circle")
    Phi, Gamma = map(acb_mat, hold(plant.A, plant.B, seconds(plant.middle)))
    normal, limit = [arb(0)] * n, arb(0)
    for z, u in points:
        x = resolved(Phi, z, Gamma)
        seen = acb_mat(filter_.B) * (acb_mat(plant.C) * x + acb_mat(plant.D))
        f = resolved(arb_mat(filter_.A), z, seen)
        normal = [a + (u * b).real for a, b in zip(normal, f.entries(), strict=True)]
        limit += (u * (acb_mat(plant.L) * x)[0, 0]).real + arb(level) * abs(u)
    return normal, limit


@on_filtered("nonuniform.sizes", source="mustafa", holds=True, says="size of F")
def sizes(plant: Plant) -> Found:
    """F, to be multiplied by C ({r} x {n}) and added to a block of size {n} x {n}, is {n} x {r}, not {r} x {n}."""
    n, r, B = plant.order, plant.C.nrows(), plant.printed.B
    require((B.nrows(), B.ncols()) == (n, r), "the printed B_f = -Y^-1 F has another size")
    require(r != n, "both sizes are the same here")
    return Found(words={"n": n, "r": r})


@on_filtered(
    "nonuniform.observer-column",
    source="mustafa",
    parameters={"column": integer},
    says=Says(quantity="column of the observer", readings=("filter as an observer",)),
)
def observer_column(plant: Plant, column: int) -> Found:
    """Column {place} of Phi(h) - B_f C at the period {period} s has its entries in {entries:ball 8}."""
    require(column < plant.order, "parameters.column is not one of the columns")
    whole = hold(plant.A, plant.B, seconds(plant.middle))[0] - arb_mat(plant.printed.B * plant.C)
    entries = [row[column] for row in whole.tolist()]
    words = {"place": column + 1, "entries": entries, "period": in_words(plant.middle)}
    return Found(words=words, items=tuple(rounded_ends(entry) for entry in entries))

"""The output matrices C_f with which a filter with given A_f and B_f keeps a level at the middle period: a box of them.

At a point z of the unit circle the error is l(z) - C_f f(z), l = L (zI - Phi)^-1 Gamma and f the response of the
filter's state, and a gain of at most g means |l - C_f f| <= g. So for complex numbers u_k at points z_k

    sum Re(u_k f(z_k))' C_f' <= sum Re(u_k l(z_k)) + g sum |u_k|,

a half-space for every choice of the u_k; that of each entry and side has a normal near to an axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any

from flint import acb, acb_mat, arb, fmpq

from replication.verify.algebra.balls import circle_point, complex_of, largest
from replication.verify.algebra.decimals import above as above_
from replication.verify.algebra.decimals import below as below_
from replication.verify.algebra.linear import identity, solved
from replication.verify.algebra.work import BALL, spend
from replication.verify.kernel import Below, decide
from replication.verify.nonuniform.system import Filter, Plant, in_words, on_filtered, seconds, step_at
from replication.verify.reading import MAX_ENTRIES, fields, positive, rational, sequence, sized
from replication.verify.says import Says
from replication.verify.statement import Depends
from replication.verify.theorem import Found, Refused, require

BITS = 40


@dataclass(frozen=True)
class Point:
    """A point of the unit circle, and the weight of the error there."""

    z: acb
    u: acb


def read_point(value: Any, path: str) -> Point:
    """{turn, u}."""
    turn, u = fields(value, path, "turn", "u")
    return Point(circle_point(rational(turn, f"{path}.turn")), complex_of(sequence(u, f"{path}.u", rational, 2)))


def read_points(value: Any, path: str, count: int) -> list[list[Point]]:
    """The points of the half-space of each entry, `count` of them."""
    found = sequence(value, path, sized(sequence, read_point), count)
    require(sum(map(len, found)) <= MAX_ENTRIES, f"{path} has more than {MAX_ENTRIES} points")
    return found


def _setting(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """The level as a decimal, as the paper has it."""
    level = Fraction(parameters["level"])
    return {"level": str(Decimal(level.numerator) / level.denominator)}


POINTS = Depends(lambda given: sized(read_points, given.plant.A.nrows()))


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
    if plant.filter is None:
        raise Refused("plant lacks the field filter")
    single = plant.B.ncols() == plant.C.nrows() == plant.L.nrows() == 1
    require(
        single and plant.filter.A.nrows() == plant.A.nrows(), "for one input, output and estimate, and equal orders"
    )
    sides = [[half_space(plant, plant.filter, level, points) for points in side] for side in (above, below)]
    # With m the largest entry in size, c_i <= limit + tilt m and -c_i <= limit + tilt m.
    tilts = [
        largest([abs(entry - (sign if i == j else 0)) for j, entry in enumerate(normal)]) * len(normal)
        for sign, side in zip((1, -1), sides, strict=True)
        for i, (normal, _) in enumerate(side)
    ]
    tilt, most = largest(tilts), largest([limit for side in sides for _, limit in side]).max(arb(0))
    decide(Below(tilt, 1, "the half-spaces do not bound C_f"))
    spare = tilt * most / (1 - tilt)
    upper, lower = ([limit + spare for _, limit in side] for side in sides)
    items = tuple((_floor(-low), -_floor(-high)) for low, high in zip(lower, upper, strict=True))
    require(all(low <= high for low, high in items), "no C_f has this level")
    entries = " and ".join(f"[{below_(low, 4)}, {above_(high, 4)}]" for low, high in items)
    return Found(words={"entries": entries, "period": in_words(plant.middle)}, items=items)


def half_space(plant: Plant, filter_: Filter, level: fmpq, points: list[Point]) -> tuple[list[arb], arb]:
    """The normal of a half-space in which C_f' lies, and its limit."""
    n = plant.A.nrows()
    spend(len(points) * 10 * n**3 * BALL, "the responses on the unit circle")
    step = acb_mat(step_at(plant, seconds(plant.middle)))
    Phi, Gamma = (acb_mat([row[part] for row in step.tolist()]) for part in (slice(0, n), slice(n, None)))
    normal, limit = [arb(0)] * n, arb(0)
    for point in points:
        x = _response(Phi, Gamma, point.z)
        seen = acb_mat(filter_.B) * (acb_mat(plant.C) * x + acb_mat(plant.D))
        f = _response(acb_mat(filter_.A), seen, point.z)
        normal = [a + (point.u * b).real for a, b in zip(normal, f.entries(), strict=True)]
        limit += (point.u * (acb_mat(plant.L) * x)[0, 0]).real + arb(level) * abs(point.u)
    return normal, limit


def _response(A: acb_mat, driven: acb_mat, z: acb) -> acb_mat:
    found: acb_mat = solved(acb_mat(identity(A.nrows())) * z - A, driven, "zI - A is not proved invertible")
    return found


def _floor(ball: arb) -> fmpq:
    return fmpq((ball * 2**BITS).lower().floor().unique_fmpz(), 2**BITS)

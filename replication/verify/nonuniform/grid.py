"""Theorem 1, eq. (9) and Algorithm 1 in balls: the periods that the small-gain condition covers, the grid; statements.

alpha(h) = ||A Phi(h) (zI - Phi(h))^{-1}||_inf is that of every filter: Sigma_11 of (7) sees the plant's states only.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import isqrt
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.linear import beside, between, circle_point, energy, hold, identity, resolved, solved
from replication.verify.kernel import decide, definite, hurwitz, less
from replication.verify.nonuniform import gain
from replication.verify.nonuniform.gain import ATTAINED, complex_vector, require_ratio
from replication.verify.nonuniform.identities import logarithmic_norm, require_sharp_ends
from replication.verify.nonuniform.system import Case, Filter, Plant, on_plant, read_filter, seconds
from replication.verify.predicate import Says
from replication.verify.reading import fields, integer, matrix, positive, rational, sequence, sized, symmetric
from replication.verify.statement import BOTH, Depends
from replication.verify.theorem import Found, Refused, require


@dataclass(frozen=True)
class Response:
    """A point z of the unit circle and a complex direction; path: where they stand in the certificate."""

    z: acb
    direction: acb_mat
    path: str


@dataclass(frozen=True)
class Alpha:
    """The witness of a bracket of alpha: a response that attains `lower`, P of the bounded real lemma at `upper`."""

    lower: fmpq
    upper: fmpq
    P: fmpq_mat
    response: Response


@dataclass(frozen=True)
class Interval:
    """Balls of the ends of an open interval of periods."""

    lower: arb
    upper: arb


def modal(A: fmpq_mat) -> fmpq_mat:
    """[a, b; -b, a] for the eigenvalues a + bi of A of order two; refused unless these are rational and not real."""
    require(A.nrows() == 2, "modal coordinates are written out for two states")
    a = (A[0, 0] + A[1, 1]) / 2
    square = A.det() - a * a
    b = fmpq(isqrt(int(square.numerator)), isqrt(int(square.denominator))) if square > 0 else fmpq(0)
    require(b > 0 and b * b == square, "the eigenvalues of A are not rational, or real")
    return fmpq_mat([[a, b], [-b, a]])


def read_response(value: Any, path: str, n: int) -> Response:
    """{turn, direction}: z = circle_point(turn), and n pairs of real and imaginary part."""
    turn, direction = fields(value, path, "turn", "direction")
    z = circle_point(rational(turn, f"{path}.turn"))
    return Response(z, complex_vector(direction, f"{path}.direction", n), path)


def read_alpha(value: Any, path: str, n: int) -> Alpha:
    """{lower, upper, P, turn, direction} for a plant of n states."""
    low, high, storage, turn, direction = fields(value, path, "lower", "upper", "P", "turn", "direction")
    response = read_response({"turn": turn, "direction": direction}, path, n)
    bounds = positive(low, f"{path}.lower"), positive(high, f"{path}.upper")
    return Alpha(*bounds, symmetric(storage, f"{path}.P", n), response)


def small_gain(A: fmpq_mat, Phi: arb_mat, alpha: Alpha) -> arb:
    """A ball that is proved to hold alpha for Phi in a ball.

    Above: P > 0 with [P - (A Phi)'(A Phi), 0; 0, g^2 I] - [Phi, I]'P[Phi, I] > 0 (bounded real lemma). Below: the
    response to a rational direction at a point of the unit circle.
    """
    path, unit = alpha.response.path, arb_mat(identity(A.nrows()))
    decide(definite(alpha.P, f"{path}.P"))
    room = bounded_real(arb_mat(alpha.P), Phi, unit, arb_mat(A) * Phi, unit * arb(alpha.upper**2))
    decide(definite(room, f"{path}: the bounded real lemma at {alpha.upper}"))
    require_response(A, Phi, alpha.lower, alpha.response)
    return between(alpha.lower, alpha.upper)


def bounded_real(P: arb_mat, A: arb_mat, B: arb_mat, C: arb_mat, supplied: arb_mat) -> arb_mat:
    """[P - C'C - A'P A, -A'P B; ., supplied - B'P B]."""
    cross = -(A.transpose() * P * B)
    state = P - C.transpose() * C - A.transpose() * P * A
    rows = beside(state, cross).tolist()
    return arb_mat(rows + beside(cross.transpose(), supplied - B.transpose() * P * B).tolist())


def require_response(A: fmpq_mat, Phi: arb_mat, lower: fmpq, response: Response) -> None:
    """Refuse unless A Phi (zI - Phi)^{-1} amplifies a complex direction by more than `lower` at a point z."""
    states = resolved(Phi, response.z, response.direction, "zI - Phi is not proved invertible")
    reached = acb_mat(arb_mat(A) * Phi) * states
    require_ratio(energy(reached), energy(response.direction), lower, f"{response.path}: the response")


def covered(h: arb, below: arb, above: arb, printed: arb, gain: arb) -> Interval:
    """H(h, gain) of (9), cases L3 and U3: below = mu(-A), above = mu(A); `printed` stands in the logarithm of U3."""
    for mu in (below, above):
        require(bool(mu != 0) and bool(mu > -gain), f"(9) is not in case L3 and U3: mu = {mu.str(5)}")
    argument = 1 + printed / gain
    decide(less(0, argument, "the logarithm of U3 has no value"))
    return Interval(h - (1 + below / gain).log() / below, h + argument.log() / above)


def run_algorithm(plant: Plant, passes: list[list[Alpha]]) -> tuple[list[arb], list[Interval]]:
    """The elements and intervals (9) of Algorithm 1 with alpha in both steps, U3 with mu(A), and a set-minus in step 4.

    Every decision is made in balls, or refused. `passes` lists for each pass the witnesses of alpha of the new
    elements, in increasing order.
    """
    start, stop = seconds(plant.h_l), seconds(plant.h_u)
    below, above = logarithmic_norm(-plant.A), logarithmic_norm(plant.A)
    new, intervals, elements = [(start + stop) / 2], list[Interval](), list[arb]()
    for count, witnesses in enumerate(passes):
        number = len(witnesses)
        require(number == len(new), f"witness.passes[{count}] must have {len(new)} elements, got {number}")
        for h, alpha in zip(new, witnesses, strict=True):
            intervals.append(covered(h, below, above, above, small_gain(plant.A, hold(plant.A, plant.B, h)[0], alpha)))
        elements += new
        new = [(a + b) / 2 for a, b in gaps(intervals, start, stop)]
        if not new:
            require(count + 1 == len(passes), "witness.passes goes on after the range is covered")
            return elements, intervals
    raise Refused(f"after {len(passes)} passes the range is not covered: {len(new)} gaps are left")


def gaps(intervals: list[Interval], start: arb, stop: arb) -> list[tuple[arb, arb]]:
    """The parts of [start, stop] that no interval covers: (L_j, U_j) of step 4. Each interval holds a point of it."""
    ordered = sorted(intervals, key=lambda interval: float(interval.lower.mid()))
    require(all(before(a.lower, b.lower) for a, b in pairwise(ordered)), "the intervals are not in order")
    pieces, reached = [], start
    for interval in ordered:
        if before(reached, interval.lower):
            pieces.append((reached, interval.lower))
        if before(reached, interval.upper):
            reached = interval.upper
    if before(reached, stop):
        pieces.append((reached, stop))
    return pieces


def before(first: arb, second: arb) -> bool:
    """Whether first < second; refused if the balls do not tell them apart."""
    if first < second:
        return True
    decide(less(second, first, f"{first.str(8)} and {second.str(8)} are not told apart"))
    return False


def covers(interval: Interval, start: arb, stop: arb) -> bool:
    """Whether an open interval holds all of [start, stop]."""
    return before(interval.lower, start) and before(stop, interval.upper)


def require_radius(A: fmpq_mat, theta: arb, lower: fmpq, direction: fmpq_mat) -> None:
    """Refuse unless Delta(theta) = A^{-1} (e^{theta A} - I) amplifies a rational direction by more than `lower`."""
    v = arb_mat(direction)
    grown = ((arb_mat(A) * theta).exp() - arb_mat(identity(A.nrows()))) * v
    image = solved(arb_mat(A), grown, "A is not proved invertible")
    require_ratio(energy(image), energy(v), lower, "witness.direction: Delta")


# Statements on (9), on Algorithm 1, and on what solves (6) on its grid.


PASSES = {"passes": Depends(lambda values: sized(sequence, sized(sequence, sized(read_alpha, values.plant.order))))}


@on_plant("nonuniform.upper-end", holds=True, says="sharp upper end (9)")
def upper_end(plant: Plant) -> Found:
    """With mu(A) in U3, alpha times the bound of Lemma 3 reaches one at the upper end of (9), and not before;
    {printed}.

    U3 with mu(-A) in the logarithm misses the end of what (8) covers.
    With e^{mu theta} = 1 + m/alpha the bound of Lemma 3 times alpha is m/mu at the end: one for m = mu(A). For
    mu(A) > 0 the printed m = mu(-A) > mu(A) goes too far; for mu(A) < 0 < mu(-A) its logarithm is positive and the end
    lies below the centre. Case U3 needs mu(A) > -alpha; alpha is at least the gain at z = 1.
    """
    require_sharp_ends()
    below, above = logarithmic_norm(-plant.A), logarithmic_norm(plant.A)
    if above > 0:
        require(before(above, below), "the printed end of U3 does not go too far")
        printed = f"as printed the bound exceeds 1/alpha at the end by a factor in {(below / above).str(6)}"
        return Found(words={"printed": printed})
    decide(less(above, 0, "neither U3 nor its misprint is decided by these signs"))
    Phi = hold(plant.A, plant.B, seconds(plant.middle))[0]
    unit = arb_mat(identity(plant.order))
    at_one = arb_mat(plant.A) * Phi * solved(unit - Phi, unit, "I - Phi is not proved invertible")
    # The squared entries of a matrix of order n add up to at most n times its squared norm.
    least = energy(at_one) / plant.order
    require(before(-above, least.sqrt()), "case U3 is not met")
    return Found(words={"printed": "as printed the upper end lies below the centre of the interval"})


@on_plant("nonuniform.lower-end", holds=True, says="sharp lower end (9)")
def lower_end(plant: Plant) -> None:
    """At the lower end of (9), case L3, and not before, alpha times the bound of Lemma 3 for -A is one."""
    require_sharp_ends()
    require(before(arb(0), logarithmic_norm(-plant.A)), "case L3 is not met")


@on_plant(
    "nonuniform.grid-size",
    bound=BOTH,
    witness=PASSES,
    says=(
        Says(quantity="elements of the grid", readings=("bound (9)",)),
        Says(quantity="Algorithm 1 ends", readings=("grid by (9), corrected",), found=lambda values: Found(holds=True)),
    ),
)
def grid_size(plant: Plant, lower: fmpq, upper: fmpq, passes: list[list[Alpha]]) -> Found:
    """Algorithm 1 with U3 corrected, alpha in both steps and a set-minus in step 4 ends with {lower} elements after
    {number} passes.
    """
    elements, _ = run_algorithm(plant, passes)
    size = len(elements)
    require(lower == size == upper, f"the grid has {size} elements, not {lower} to {upper}")
    return Found(words={"number": len(passes)})


@on_plant("nonuniform.one-interval", witness=PASSES, holds=True, says="conservative element")
def one_interval(plant: Plant, passes: list[list[Alpha]]) -> Found:
    """With U3 corrected, the interval (9) around the middle of the range leaves out part of it, although the error
    system of every filter with A_f Schur is stable on all of it; {size} elements cover the range.
    """
    elements, intervals = run_algorithm(plant, passes)
    decide(hurwitz(plant.A, "the plant"))
    require(not covers(intervals[0], seconds(plant.h_l), seconds(plant.h_u)), "one element covers the range")
    return Found(words={"size": len(elements)})


@on_plant(
    "nonuniform.stalls",
    witness=Depends(lambda values: sized(read_alpha, values.plant.order)),
    holds=False,
    says=Says(quantity="Algorithm 1 ends", readings=("no set-minus", "set-minus")),
)
def stalls(plant: Plant, witness: Alpha) -> Found:
    """Algorithm 1 as printed does not reach a grid, if step 4 is read with a set-minus or with its union cut to the
    range: step 3 fails at the first element and step 4 leaves all as it is, since {how}.

    As printed: mu(-A) in the logarithm of U3, alpha in step 3, its root in step 4. The union of the range and the
    intervals, cut to the range, is the range, and its middle is in the grid already. With a set-minus: if the interval
    by the root is empty the gap is the whole range; if it covers the range there is none.
    """
    start, stop = seconds(plant.h_l), seconds(plant.h_u)
    h = (start + stop) / 2
    below, above = logarithmic_norm(-plant.A), logarithmic_norm(plant.A)
    size = small_gain(plant.A, hold(plant.A, plant.B, h)[0], witness)
    tested, marked = (covered(h, below, above, below, used) for used in (size, size.sqrt()))
    require(not covers(tested, start, stop), "step 3 does not fail: the algorithm ends")
    how = "the interval by the root of alpha is empty, and the middle of the range is in the grid already"
    if not before(marked.upper, marked.lower):
        require(covers(marked, start, stop), "step 4 adds an element")
        how = "the interval by the root of alpha covers the range, and step 4 has nothing to add"
    return Found(words={"how": how})


@on_plant(
    "nonuniform.same-level",
    parameters={"cells": sized(integer, 1)},
    witness={
        "cell": integer,
        "alpha": positive,
        "response": Depends(lambda values: sized(read_response, values.plant.order)),
        "radius": positive,
        "direction": Depends(lambda values: sized(matrix, values.plant.order, 1)),
        "filter": Depends(lambda values: sized(read_filter, values.plant)),
        "level": positive,
        "storage": Depends(lambda values: sized(gain.read_storage, values.plant.order + values.filter.A.nrows())),
    },
    holds=True,
    says=Says(quantity="conservative level", readings=("(13) reconstructed",)),
)
def same_level(plant: Plant, cells: int, cell: int, alpha: fmpq, radius: fmpq, level: fmpq, **proof: Any) -> Found:
    """For (13), missing from our copy, as it is reconstructed here, with a scalar scaling: with {cells} cells, in modal
    coordinates, one level for both channels is at least {forced:down}, whether or not Delta is divided by its norm; a
    filter of form (4) has the level {level:up} for every sequence.

    Modal coordinates, in which A is [a, b; -b, a], are those of (13) as it is reconstructed; others would change alpha
    and the norm of Delta.
    """
    require(cell < cells, "witness.cell is not one of the cells")
    h = seconds(plant.along(fmpq(2 * cell + 1, 2 * cells)))
    moved = replace(plant, A=modal(plant.A))
    require_response(moved.A, hold(moved.A, moved.B, h)[0], alpha, proof["response"])
    half = (seconds(plant.h_u) - seconds(plant.h_l)) / (2 * cells)
    require_radius(moved.A, half, radius, proof["direction"])
    case = Case(ends=(plant.h_l, plant.h_u), weight="samples", filter=proof["filter"], level=level)
    gain.require_level(plant, case, level, proof["storage"])
    forced = min(alpha, alpha * radius)
    decide(less(level, forced, f"the level {level} of the filter is not below {forced}"))
    return Found(words={"forced": forced})


# A solution of (6) on the grid of the corrected Algorithm 1 that does not solve (6) at all periods of the range.


@on_plant(
    "nonuniform.grid-solution-fails",
    witness={
        **PASSES,
        "level": positive,
        "filter": Depends(lambda values: sized(read_filter, values.plant)),
        "P": Depends(lambda values: sized(symmetric, values.plant.order + values.filter.A.nrows())),
        **ATTAINED,
    },
    holds=False,
    says=Says(quantity="grid solutions of (6) are valid", setting={}, readings=("grid by (9), corrected",)),
)
def grid_solution_fails(
    plant: Plant, passes: list[list[Alpha]], level: fmpq, filter: Filter, P: fmpq_mat, **motion: Any
) -> Found:
    """A filter and a matrix solve (6) with the level {level:up} at all {size} elements of the grid of Algorithm 1, U3
    corrected, alpha in both steps and a set-minus in step 4; they do not solve (6) at all periods of the range, for the
    gain of this filter over them is above that level.

    With P the inverse of P-bar, (6) is [P - C-bar' C-bar, 0; 0, g^2 I] - M'P M > 0 (Schur complements); at all periods
    it would give the level to every sequence (Lemma 1).
    """
    decide(definite(P, "witness.P"))
    case = Case(ends=(plant.h_l, plant.h_u), weight="samples", filter=filter, level=level)
    elements, _ = run_algorithm(plant, passes)
    for h in elements:
        gain.require_at(plant, case, level, P, h)
    gain.require_attained(plant, case, level, **motion)
    return Found(words={"size": len(elements)})

"""Statements on the method: lemmas, intervals (9), Algorithm 1, the inequality (10), the printed filter's columns."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from flint import acb_mat, arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.linear import circle_point
from replication.verify.kernel import Below, Hurwitz, Positive, decide
from replication.verify.nonuniform import grid, identities, system
from replication.verify.nonuniform.gain import read_storage, require_at, require_attained, require_level
from replication.verify.nonuniform.levels import ATTAINED
from replication.verify.nonuniform.system import (
    Case,
    Filter,
    Plant,
    along,
    in_words,
    on_filtered,
    on_plant,
    read_filter,
    seconds,
)
from replication.verify.predicate import Says
from replication.verify.reading import integer, matrix, positive, sequence, sized, symmetric
from replication.verify.statement import BOTH, Depends
from replication.verify.theorem import Found, Refused, require

DIGITS = 40
"""Bits of the bounds of entries."""
PASSES = {
    "passes": Depends(lambda given: sized(sequence, sized(sequence, sized(grid.read_alpha, given.plant.A.nrows()))))
}


@on_filtered("nonuniform.sizes", source="mustafa", holds=True, says="size of F")
def sizes(plant: Plant) -> Found:
    """F, to be multiplied by C ({r} x {n}) and added to a block of size {n} x {n}, is {n} x {r}, not {r} x {n}."""
    n, r, B = plant.A.nrows(), plant.C.nrows(), _printed(plant).B
    require((B.nrows(), B.ncols()) == (n, r), "the printed B_f = -Y^-1 F has another size")
    require(r != n, "both sizes are the same here")
    return Found(words={"n": n, "r": r})


@on_plant("nonuniform.upper-end", source="mustafa", holds=True, says="sharp upper end (9)")
def upper_end(plant: Plant) -> Found:
    """With mu(A) in U3, alpha times the bound of Lemma 3 reaches one at the upper end of (9), and not before;
    {printed}."""
    identities.require_sharp_ends()
    return Found(words={"printed": grid.require_upper_end(plant)})


@on_plant("nonuniform.lower-end", source="mustafa", holds=True, says="sharp lower end (9)")
def lower_end(plant: Plant) -> None:
    """At the lower end of (9), case L3, and not before, alpha times the bound of Lemma 3 for -A is one."""
    identities.require_sharp_ends()
    grid.require_lower_end(plant)


@on_plant(
    "nonuniform.grid-size",
    source="mustafa",
    bound=BOTH,
    witness=PASSES,
    says=(
        Says(quantity="elements of the grid", readings=("bound (9)",)),
        Says(quantity="Algorithm 1 ends", readings=("grid by (9), corrected",), found=lambda given: Found(holds=True)),
    ),
)
def grid_size(plant: Plant, lower: fmpq, upper: fmpq, passes: list[list[grid.Alpha]]) -> Found:
    """Algorithm 1 with U3 corrected, alpha in both steps and a set-minus in step 4 ends with {lower} elements after
    {number} passes.
    """
    covering = grid.run_algorithm(plant, passes)
    found = lower == covering.size == upper
    require(found, f"the grid has {covering.size} elements, not {lower} to {upper}")
    return Found(words={"number": covering.passes})


@on_plant("nonuniform.one-interval", source="mustafa", witness=PASSES, holds=True, says="conservative element")
def one_interval(plant: Plant, passes: list[list[grid.Alpha]]) -> Found:
    """With U3 corrected, the interval (9) around the middle of the range leaves out part of it, although the error
    system of every filter with A_f Schur is stable on all of it; {size} elements cover the range.
    """
    covering = grid.run_algorithm(plant, passes)
    decide(Hurwitz(plant.A, "the plant"))
    grid.require_one_interval_is_not_enough(plant, covering)
    return Found(words={"size": covering.size})


@on_plant(
    "nonuniform.stalls",
    source="mustafa",
    witness=Depends(lambda given: sized(grid.read_alpha, given.plant.A.nrows())),
    holds=False,
    says=Says(quantity="Algorithm 1 ends", readings=("no set-minus", "set-minus")),
)
def stalls(plant: Plant, witness: grid.Alpha) -> Found:
    """Algorithm 1 as printed does not reach a grid: step 3 fails at the first element and step 4 leaves all as it is,
    with a set-minus as without (the union cut to the range): {how}.
    """
    return Found(words={"how": grid.require_stall(plant, witness)})


@on_plant(
    "nonuniform.same-level",
    source="mustafa",
    parameters={"cells": sized(integer, 1)},
    witness={
        "cell": integer,
        "alpha": positive,
        "response": Depends(lambda given: sized(grid.read_response, given.plant.A.nrows())),
        "radius": positive,
        "direction": Depends(lambda given: sized(matrix, given.plant.A.nrows(), 1)),
        "filter": Depends(lambda given: sized(read_filter, given.plant)),
        "level": positive,
        "storage": Depends(lambda given: sized(read_storage, given.plant.A.nrows() + given.filter.A.nrows())),
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
    h = seconds(along(plant.h_l, plant.h_u, fmpq(2 * cell + 1, 2 * cells)))
    moved = replace(plant, A=grid.modal(plant.A))
    grid.require_response(moved.A, grid.state_transition(moved, h), alpha, proof["response"])
    half = (seconds(plant.h_u) - seconds(plant.h_l)) / (2 * cells)
    grid.require_radius(moved.A, half, radius, proof["direction"])
    case = Case(ends=(plant.h_l, plant.h_u), weight="samples", filter=proof["filter"], level=level)
    require_level(plant, case, level, proof["storage"])
    forced = min(alpha, alpha * radius)
    decide(Below(level, forced, f"the level {level} of the filter is not below {forced}"))
    return Found(words={"forced": forced})


@on_filtered(
    "nonuniform.observer-column",
    source="mustafa",
    parameters={"column": integer},
    says=Says(quantity="column of the observer", readings=("filter as an observer",)),
)
def observer_column(plant: Plant, column: int) -> Found:
    """Column {place} of Phi(h) - B_f C at the period {period} s has its entries in {entries:ball 8}."""
    require(column < plant.A.nrows(), "parameters.column is not one of the columns")
    whole = grid.state_transition(plant, seconds(plant.middle)) - arb_mat(_printed(plant).B * plant.C)
    entries = [row[column] for row in whole.tolist()]
    words = {"place": column + 1, "entries": entries, "period": in_words(plant.middle)}
    return Found(words=words, items=tuple(_ends(entry) for entry in entries))


def _printed(plant: Plant) -> Filter:
    """The filter that is printed with the plant."""
    if plant.filter is None:
        raise Refused("plant lacks the field filter")
    return plant.filter


def _ends(ball: arb) -> tuple[fmpq, fmpq]:
    """Multiples of 2^-DIGITS on both sides of a ball."""
    scaled = ball * 2**DIGITS
    return tuple(fmpq(end.unique_fmpz(), 2**DIGITS) for end in (scaled.lower().floor(), scaled.upper().ceil()))  # type: ignore[return-value]


# A solution of (6) on the grid of the corrected Algorithm 1 that does not solve (6) at all periods of the range.


@on_plant(
    "nonuniform.grid-solution-fails",
    source="mustafa",
    witness={
        **PASSES,
        "level": positive,
        "filter": Depends(lambda given: sized(system.read_filter, given.plant)),
        "P": Depends(lambda given: sized(symmetric, given.plant.A.nrows() + given.filter.A.nrows())),
        **ATTAINED,
    },
    holds=False,
    says=Says(quantity="grid solutions of (6) are valid", setting={}, readings=("grid by (9), corrected",)),
)
def grid_solution_fails(
    plant: Plant,
    passes: list[list[grid.Alpha]],
    level: fmpq,
    filter: Filter,
    P: fmpq_mat,
    pattern: list[fmpq],
    turn: fmpq,
    w: list[acb_mat],
) -> Found:
    """A filter and a matrix solve (6) with the level {level:up} at all {size} elements of the grid of Algorithm 1, U3
    corrected, alpha in both steps and a set-minus in step 4; they do not solve (6) at all periods of the range, for the
    gain of this filter over them is above that level.

    With P the inverse of P-bar, (6) is [P - C-bar' C-bar, 0; 0, g^2 I] - M'P M > 0 (Schur complements); at all periods
    it would give the level to every sequence (Lemma 1).
    """
    decide(Positive(P, "witness.P"))
    case = Case(ends=(plant.h_l, plant.h_u), weight="samples", filter=filter, level=level)
    elements = grid.run_algorithm(plant, passes).elements
    for h in elements:
        require_at(plant, case, level, P, h)
    require_attained(plant, case, level, pattern, circle_point(turn), w)
    return Found(words={"size": len(elements)})

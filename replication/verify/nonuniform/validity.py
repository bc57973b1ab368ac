"""A solution of (6) on the grid of the corrected Algorithm 1 that does not solve (6) at all periods of the range."""

from __future__ import annotations

from flint import acb_mat, fmpq, fmpq_mat

from replication.verify.algebra.balls import circle_point
from replication.verify.kernel import Positive, decide
from replication.verify.nonuniform import gain, grid, system
from replication.verify.nonuniform.gain import require_at, require_attained
from replication.verify.nonuniform.system import Case, Filter, Plant, on_plant
from replication.verify.nonuniform.theory import PASSES
from replication.verify.reading import positive, rational, sequence, sized, symmetric
from replication.verify.says import Says
from replication.verify.statement import Depends
from replication.verify.theorem import Found


@on_plant(
    "nonuniform.grid-solution-fails",
    source="mustafa",
    witness={
        **PASSES,
        "level": positive,
        "filter": Depends(lambda given: sized(system.read_filter, given.plant)),
        "P": Depends(lambda given: sized(symmetric, given.plant.A.nrows() + given.filter.A.nrows())),
        "pattern": gain.read_pattern,
        "turn": rational,
        "w": Depends(
            lambda given: sized(sequence, sized(gain.complex_vector, given.plant.B.ncols()), len(given.pattern))
        ),
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

"""Filters that know the periods: the gain of one, from both sides."""

from __future__ import annotations

from typing import Any

from replication.recheck.exact import blocks, minus, times, unit
from replication.recheck.nonuniform.levels import read_cells, require_level
from replication.recheck.nonuniform.lower import require_motion
from replication.recheck.nonuniform.sampled import Case, Plant, read_plant
from replication.recheck.reading import Certificate, Proof, matrix, several, take


def read_stamped(value: Any, plant: Plant) -> Case:
    """e+ = [Phi, Gamma] (I - G [C, D]) [e; w] over the whole range, where G is that of the cell of the period before;
    the error is that of the estimate which is there before the sample."""
    listed, gains = take(value, "filter", "cells", "G")
    ends = read_cells(listed, "the cells of the filter")
    seen = blocks([[plant.C, plant.D]])
    size = len(seen[0])
    made = several(gains, "G", lambda one, at: matrix(one, at, size, len(seen)), len(ends) - 1)
    factors = [minus(unit(size), times(one, seen)) for one in made]
    return Case(plant, plant.low, plant.high, False, plant.L, ends, factors, [])


def stamped_gain(given: Certificate) -> Proof:
    """The gain of a filter with time stamps lies between two bounds.

    The storage, by a strict inequality on a closed range, makes the error settle; that the motion below it needs.
    """
    lower, upper = given.stated("lower", "upper")
    take(given.parameters, "parameters")
    listed, storage, pattern, turn, w = take(given.witness, "witness", "filter", "storage", "pattern", "turn", "w")
    case = read_stamped(listed, read_plant(given.plant))
    require_level(case, upper, storage)
    require_motion(case, lower, {"pattern": pattern, "turn": turn, "w": w})
    return Proof(lower=lower, upper=upper)


CHECKS = {"nonuniform.stamped-gain": stamped_gain}

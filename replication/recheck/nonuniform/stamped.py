"""Filters that know the periods: the gain of one, from both sides."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from replication.recheck.exact import blocks, inverse, minus, nought, times, unit
from replication.recheck.nonuniform.levels import read_cells, require_level
from replication.recheck.nonuniform.lower import require_motion
from replication.recheck.nonuniform.sampled import Case, Plant, read_plant
from replication.recheck.reading import Certificate, Proof, matrix, several, take


def read_stamped(value: Any, coordinates: Any, plant: Plant) -> Case:
    """e+ = [Phi, Gamma] (I - G [C, D]) [e; w] over the whole range, where G is that of the cell of the period before;
    the error is that of the estimate which is there before the sample."""
    listed, gains = take(value, "filter", "cells", "G")
    ends = read_cells(listed, "the cells of the filter")
    seen = blocks([[plant.C, plant.D]])
    size = len(seen[0])
    made = several(gains, "G", lambda one, at: matrix(one, at, size, len(seen)), len(ends) - 1)
    # The state is written as T x.
    n, m = len(plant.A), len(plant.B[0])
    t = matrix(coordinates, "T", n, n)
    back = inverse(t)
    to, fro = (blocks([[one, nought(n, m)], [nought(m, n), unit(m)]]) for one in (t, back))
    factors = [times(to, minus(unit(size), times(one, seen)), fro) for one in made]
    moved = replace(plant, A=times(t, plant.A, back), B=times(t, plant.B))
    return Case(moved, plant.low, plant.high, False, times(plant.L, back), ends, factors, [])


def stamped_gain(given: Certificate) -> Proof:
    """The gain of a filter with time stamps lies between two bounds.

    The storage, by a strict inequality on a closed range, makes the error settle; that the motion below it needs.
    """
    lower, upper = given.stated("lower", "upper")
    take(given.parameters, "parameters")
    names = ("filter", "T", "storage", "pattern", "turn", "w")
    listed, coordinates, storage, pattern, turn, w = take(given.witness, "witness", *names)
    case = read_stamped(listed, coordinates, read_plant(given.plant))
    require_level(case, upper, storage)
    require_motion(case, lower, {"pattern": pattern, "turn": turn, "w": w})
    return Proof(lower=lower, upper=upper)


CHECKS = {"nonuniform.stamped-gain": stamped_gain}

"""Filters that know the periods: the gain of one, from both sides."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

from replication.recheck.exact import blocks, minus, times, unit
from replication.recheck.nonuniform.levels import require_level
from replication.recheck.nonuniform.lower import require_motion
from replication.recheck.nonuniform.sampled import Errors, Plant, read_plant
from replication.recheck.reading import Certificate, Matrix, Proof, matrix, need, number, several, take


@dataclass(frozen=True)
class StampedErrors(Errors):
    """e+ = [Phi, Gamma] (I - G [C, D]) [e; w], where G is that of the cell of the period before."""

    ends: list[Fraction]
    factors: list[Matrix]

    @property
    def cells(self) -> list[Fraction]:
        """Those of the filter."""
        return self.ends

    @property
    def output(self) -> Matrix:
        """The error of the estimate that is there before the sample."""
        return self.plant.L

    def error_steps(self, step: Matrix) -> list[Matrix]:
        """[Phi, Gamma] times each of the factors."""
        return [times(step, factor) for factor in self.factors]

    @property
    def moved(self) -> list[list[Fraction]]:
        """Sums of moduli over the columns of the factors."""
        return [[sum(map(abs, column), Fraction(0)) for column in zip(*one, strict=True)] for one in self.factors]


def read_stamped(value: Any, plant: Plant) -> StampedErrors:
    """The error of the filter of a certificate, over the whole range."""
    listed, gains = take(value, "filter", "cells", "G")
    ends = several(listed, "cells", number)
    need(len(ends) > 1 and ends[0] == 0 and ends[-1] == 1, "the cells of the filter do not cover the range")
    need(all(a < b for a, b in pairwise(ends)), "the cells of the filter do not follow each other")
    seen = blocks([[plant.C, plant.D]])
    size = len(seen[0])
    made = several(gains, "G", lambda one, at: matrix(one, at, size, len(seen)), len(ends) - 1)
    factors = [minus(unit(size), times(one, seen)) for one in made]
    return StampedErrors(plant, plant.low, plant.high, False, ends, factors)


def stamped_gain(given: Certificate) -> Proof:
    """The gain of a filter with time stamps lies between two bounds.

    The storage, by a strict inequality on a closed range, makes the error settle; that the motion below it needs.
    """
    lower, upper = given.stated("lower", "upper")
    take(given.parameters, "parameters")
    need("filter" not in given.plant, "the filter stands with the plant")
    listed, storage, pattern, turn, w = take(given.witness, "witness", "filter", "storage", "pattern", "turn", "w")
    errors = read_stamped(listed, read_plant(given.plant))
    require_level(errors, upper, storage)
    require_motion(errors, lower, {"pattern": pattern, "turn": turn, "w": w})
    return Proof(lower=lower, upper=upper)


CHECKS = {"nonuniform.stamped-gain": stamped_gain}

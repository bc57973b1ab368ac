"""The least level of Theorem 3 at one degree, from a linear functional that is nowhere negative on squares."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from replication.recheck.delay.plant import changed, read_plant
from replication.recheck.delay.squares import MOST_DEGREE, Error, Form, Place, entries, narrow, terms
from replication.recheck.exact import is_semidefinite
from replication.recheck.reading import Certificate, Proof, count, matrix, need, several, symmetric, take


def degree_lower(given: Certificate) -> Proof:
    """Theorem 3 is infeasible below a level at one degree, by a functional that is nowhere negative on squares."""
    (degree,) = take(given.parameters, "parameters", "degree")
    return _infeasible(given, degree, "tensor", 1)


def narrow_lower(given: Certificate) -> Proof:
    """The same with powers of one variable alone, and squares of the degree under both weights."""
    degree, rule = take(given.parameters, "parameters", "degree", "rule")
    return _infeasible(given, degree, narrow(rule), 0)


def _infeasible(given: Certificate, degree: Any, rule: str, less: int) -> Proof:
    """What the functional shows; `less` is the degree that the second weight, of two powers, takes from its squares."""
    (lower,) = given.stated("lower")
    change, functional = take(given.witness, "witness", "change", "functional")
    need(count(degree, "degree", 1) <= MOST_DEGREE and lower > 0, "the degree is too large, or the bound not positive")
    system = Error(changed(read_plant(given.plant), change))
    weights, coupling = _functional(functional, system, 2 * (degree + 1 - less) + 1)
    need(not any(system.cancelled(place) for place, one in weights.items() if one), "Z reaches a weight")

    def valued(form: Iterator[tuple[Place, Fraction]]) -> Fraction:
        return sum((one * weights.get(place, Fraction(0)) for place, one in form), Fraction(0))

    def along(form: Iterator[tuple[Place, Fraction]]) -> Fraction:
        total = Fraction(0)
        for place, one in form:
            total += one * (valued(system.rate(place)) + coupling.get(place, Fraction(0)))
        return total

    for us, value in ((system.plant.n, along), (system.us, valued)):
        for weight in (0, 1):
            zeta = entries(us, system.functions, degree, weight * less, rule)
            gram = [[Fraction(0)] * len(zeta) for _ in zeta]
            for i, left in enumerate(zeta):
                for j in range(i, len(zeta)):
                    gram[i][j] = gram[j][i] = value(terms(weight, left, zeta[j])) / (1 if i == j else 2)
            need(is_semidefinite(gram), "the functional is negative on a square")
    spent = sum((weights.get(("P", i, i), Fraction(0)) for i in range(system.e)), Fraction(0))
    need(spent > 0, "the functional does not see w and v")
    need(valued(iter(system.supplied(Fraction(0)).items())) >= lower * spent, "the functional gives a smaller level")
    return Proof(lower=lower)


def _functional(value: Any, system: Error, powers: int) -> tuple[Form, Form]:
    """A weight for each coefficient of a form of this many powers; and what is added where S of V couples delays."""
    p, q, s, r, coupling = take(value, "functional", "P", "Q", "S", "R", "coupling")
    us, functions = system.us, system.functions
    found: Form = {("P", i, j): one for i, row in enumerate(symmetric(p, "P", us)) for j, one in enumerate(row)}

    def stacked(given: Any, where: str, rows: int) -> Iterator[tuple[int, int, int, Fraction]]:
        read = several(given, where, lambda one, at: matrix(one, at, rows, functions), powers)
        return (
            (i, j, k, one) for k, block in enumerate(read) for i, row in enumerate(block) for j, one in enumerate(row)
        )

    found |= {("Q", i, j, k): one for i, j, k, one in stacked(q, "Q", us)}
    found |= {("S", i, j, k): one for i, j, k, one in stacked(s, "S", functions)}
    for k, block in enumerate(several(r, "R", lambda one, _: one, powers)):
        found |= {("R", i, j, k, m): one for i, j, m, one in stacked(block, "R", functions)}
    n = system.plant.n
    read = stacked(coupling, "coupling", functions)
    return found, {("S", i, j, k): one for i, j, k, one in read if i // n != j // n}


CHECKS = {"delay.degree-lower": degree_lower, "delay.narrow-lower": narrow_lower}

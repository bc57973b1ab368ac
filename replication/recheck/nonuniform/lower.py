"""Gains over sampling sequences from below: disturbances that repeat, and disturbances that no measurement shows."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any

from replication.recheck.exact import (
    Complex,
    characteristic,
    inverse,
    is_hurwitz,
    is_schur,
    plus,
    scaled,
    solved,
    times,
    turned,
    unit,
)
from replication.recheck.interval import Interval
from replication.recheck.nonuniform.levels import cell_of
from replication.recheck.nonuniform.sampled import (
    Case,
    Plant,
    between,
    complex_column,
    modulus2,
    on_circle,
    read_case,
    read_plant,
    resolved,
    seconds,
)
from replication.recheck.reading import Certificate, Matrix, Proof, count, need, number, positive, several, take

LONGEST = 20_000
"""Samples of a pattern."""


def require_attained(case: Case, level: Fraction, witness: Any) -> None:
    """Refuse unless a pattern of periods and a disturbance that turns by z from pattern to pattern exceed the level."""
    case.require_stable()
    require_motion(case, level, witness)


def require_motion(case: Case, level: Fraction, witness: Any) -> None:
    """The same for an error that is known to settle whatever the periods of the range."""
    listed, turn, noises = take(witness, "witness", "pattern", "turn", "w")
    runs = several(listed, "pattern", lambda run, at: take_run(run, at))
    total = sum(number_ for _, number_ in runs)
    need(0 < total <= LONGEST, f"no sample in the pattern, or more than {LONGEST}")
    drive = several(noises, "w", lambda one, at: complex_column(one, at, len(case.plant.B[0])), total)
    n = len(case.output[0])
    made = {}
    for share, _ in runs:
        h = seconds(between(case.start, case.stop, share))
        made[share] = (h, case.plant.step(h))
    shares = [share for share, number_ in runs for _ in range(number_)]
    cells = [cell_of(case.cells, share) for share in (shares[-1], *shares[:-1])]
    after = cache(lambda share, cell: case.step_after(cell, made[share][1]))
    steps = [(made[share][0], after(share, cell)) for share, cell in zip(shares, cells, strict=True)]
    product: Matrix = unit(n, Interval.of(1))
    forced: Matrix = [[Complex(Interval.of(0))] for _ in range(n)]
    for (_, step), w in zip(steps, drive, strict=True):
        product = times([row[:n] for row in step], product)
        forced = times(step, [*forced, *w])
    state = solved(resolved(on_circle(turn), product), forced)
    seen, spent = Interval.of(0), Interval.of(0)
    for (h, step), w in zip(steps, drive, strict=True):
        seen = seen + modulus2(times(case.output, state)) * case.weight(h)
        spent = spent + case.weight(h) * Interval.of(modulus2(w))
        state = times(step, [*state, *w])
    _require_ratio(seen, spent, level)


def take_run(run: Any, where: str) -> tuple[Fraction, int]:
    """[share of the way between the ends, number of samples]."""
    need(isinstance(run, list) and len(run) == 2, f"{where} is no pair")
    share = number(run[0], where)
    need(0 <= share <= 1, f"{where} is no share")
    return share, count(run[1], where, 1)


def _require_ratio(seen: Any, spent: Any, level: Fraction) -> None:
    need(level > 0 and Interval.of(spent) > 0, "the level or the disturbance is not positive")
    need(Interval.of(spent) * level * level < Interval.of(seen), "the disturbance does not exceed the level")


def gain_lower(given: Certificate) -> Proof:
    """The gain of a filter is more than that."""
    (lower,) = given.stated("lower")
    require_attained(read_case(given)[0], lower, given.witness)
    return Proof(lower=lower)


def breaks_level(given: Certificate) -> Proof:
    """A filter does not have a level."""
    (lower,) = given.stated("lower")
    case, (level,) = read_case(given, "level")
    need(lower >= positive(level, "level"), "the bound is below the level")
    require_attained(case, lower, given.witness)
    return Proof(lower=lower, holds=False)


def require_no_filter(plant: Plant, period: Any, level: Fraction, start: Any) -> None:
    """Refuse unless a disturbance that no measurement shows up to k = 0 has this gain to the errors up to k = 1."""
    n, r, m = len(plant.A), len(plant.C), len(plant.B[0])
    step = plant.step(seconds(plant.time(period)))
    phi, gamma = [row[:n] for row in step], [row[n:] for row in step]
    if not any(map(any, plant.D)):
        w = [[entry] for entry in several(start, "start", number, m)]
        _require_ratio(modulus2(times(plant.L, gamma, w)), modulus2(w), level)
        return
    need(r == m, "D is neither zero nor square")
    need(is_hurwitz(plant.A), "A is not Hurwitz")
    hidden = scaled(-1, times(inverse(plant.D), plant.C))
    backwards = inverse(plus(phi, times(gamma, hidden)))
    need(is_schur(characteristic(backwards)), "a zero may lie in the unit circle")
    x = [[entry] for entry in several(start, "start", number, n)]
    spent = _form(_summed(backwards, times(turned(hidden), hidden)), x)
    after = times(plus(phi, times(gamma, hidden)), x)
    seen = _form(_summed(backwards, times(turned(plant.L), plant.L)), x) + modulus2(times(plant.L, after))
    _require_ratio(seen, spent, level)


def _summed(step: Matrix, rate: Matrix) -> Matrix:
    """The sum of (step^k)' rate step^k over k >= 0: X = rate + step' X step, entry by entry."""
    n = len(step)
    system = [
        [Interval.of(int((i, j) == (k, q))) - Interval.of(step[k][i]) * step[q][j] for k in range(n) for q in range(n)]
        for i in range(n)
        for j in range(n)
    ]
    found = solved(system, [[rate[i][j]] for i in range(n) for j in range(n)])
    return [[found[i * n + j][0] for j in range(n)] for i in range(n)]


def _form(matrix_: Matrix, vector: Matrix) -> Any:
    return times(turned(vector), matrix_, vector)[0][0]


def optimum_lower(given: Certificate) -> Proof:
    """Every stable filter has a gain above that at a constant period."""
    (lower,) = given.stated("lower")
    (period,), (start,) = take(given.parameters, "parameters", "period"), take(given.witness, "witness", "start")
    require_no_filter(read_plant(given.plant), period, lower, start)
    return Proof(lower=lower)


def no_filter_keeps_level(given: Certificate) -> Proof:
    """No stable filter has a level for every sequence of the range."""
    (lower,) = given.stated("lower")
    period, level = take(given.parameters, "parameters", "period", "level")
    (start,) = take(given.witness, "witness", "start")
    need(lower >= positive(level, "level"), "the bound is below the level")
    require_no_filter(read_plant(given.plant), period, lower, start)
    return Proof(lower=lower, holds=False)


CHECKS = {
    "nonuniform.gain-lower": gain_lower,
    "nonuniform.breaks-level": breaks_level,
    "nonuniform.optimum-lower": optimum_lower,
    "nonuniform.no-filter-keeps-level": no_filter_keeps_level,
}

"""A certificate of a given level: a feasible point of Theorem 3 with moderate gains."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import Program, Solution
from replication.estimation.conic.sdpa import SdpaOptions, one_process, solve_sdpa
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import synthesis
from replication.estimation.delay.sos.cone import DegreeRule
from replication.estimation.delay.sos.synthesis import Assembly, assemble, program, reduced
from replication.estimation.delay.spectrum import require_seen
from replication.estimation.delay.units import gain_scaled, natural_units, rounded
from replication.estimation.validation import Array, positive_scalar

UNITS = SdpaOptions(tolerance=1e-6, gap=1.0, residual=1e-1)
"""For a first estimate of γ, which only sets the units of the second run."""

STATED_GAP = SdpaOptions(tolerance=1e-10, scale=1e1, gap=1e-2, residual=1e-5)
"""A gap up to this is stated by the bracket; wider ones are errors."""

ROOM = 10.0
"""Traces that the lower end allows for, over that found: where the infimum is not attained they grow towards it."""

LOOSER = 1e2
STOPS = 3
"""Where the optimum is not attained the iterates grow and lose the equalities: SDPA is then stopped earlier.

It then also starts from larger matrices: too small a start reads as infeasible where the solution is large; and at
last from the first start, as one that is too large loses the equalities, too.
"""


@dataclass(frozen=True)
class LeastGain:
    """lower <= least γ of one degree and rule <= gamma, both in floating point, from the two sides of one program.

    gamma allows for what the point misses of the equalities (`slip`), lower for a dual slack that is slightly
    indefinite: it holds for matrices of a trace up to ROOM times that of the point. Theorem 3 has certificates for
    every level above gamma (`certificate_at`); lower says nothing of other degrees.

    Attributes
    ----------
    lower : float
        Lower end, of the dual.
    gamma : float
        Upper end, of the point.
    solution : Solution
        The matrices of the cones, with status and residuals of the solver.
    """

    lower: float
    gamma: float
    solution: Solution


@one_process()
def minimum_gain(
    system: DelayPlant,
    degree: int,
    rule: DegreeRule = DegreeRule.TENSOR,
    *,
    epsilon: float = 0.0,
    options: SdpaOptions = STATED_GAP,
) -> LeastGain:
    """The infimum of γ in Theorem 3 with polynomials of degree d (of `reduced`, which has the same).

    Solved in `natural_units`, and twice: the second time with w and z in units that make γ about 1, where SDPA comes
    closer to the optimum; once if the first run cannot tell γ from zero, as where y reveals w. If the point misses the
    equalities by more than the options allow, it is tried again as `solved` says; `solution` records what held.

    Parameters
    ----------
    system : DelayPlant
        The plant.
    degree : int
        Degree of the polynomials.
    rule : DegreeRule
        Which monomials that stands for.
    epsilon : float
        Strictness of both inequalities.
    options : SdpaOptions
        Stopping rules of the solver, and the gap that may be left, relative to 1 + γ in those units.

    Returns
    -------
    LeastGain
        Both ends.

    Raises
    ------
    InvalidInputError
        A bad degree, or a system that is not detectable.
    InfeasibleError
        There is proved to be none.
    SolverError
        SDPA settles on none, or leaves a wider gap than the options allow.
    """
    rates = rule is DegreeRule.BESSEL  # its matrices act on the point variables one by one: sparse ones are cheap
    units = natural_units(system)
    plant = units.plant(system)
    assembly = reduced(assemble(plant, degree, rule, rates=rates))
    require_seen(plant, units.time)
    rough = solved(program(assembly, epsilon), UNITS)
    unit = float(rough.linear[0])
    if _lower(rough) <= 0.0:
        return _found(1.0, rough)
    scaled = reduced(assemble(gain_scaled(plant, unit), degree, rule, rates=rates))
    return _found(unit, solved(program(scaled, epsilon), options))


def solved(task: Program, options: SdpaOptions) -> Solution:
    """The first point within the options as these are made `looser`, then with the first start."""
    start = options.scale
    for _ in range(STOPS):
        try:
            return solve_sdpa(task, options)
        except SolverError:
            last, options = options, looser(options)
    return solve_sdpa(task, replace(last, scale=start))


def looser(options: SdpaOptions) -> SdpaOptions:
    """The options with a looser tolerance and a larger start; what must hold of the point stays."""
    return replace(options, tolerance=options.tolerance * LOOSER, scale=options.scale * LOOSER)


def _lower(solution: Solution) -> float:
    """What the dual point proves of matrices with a trace up to ROOM times that of the point."""
    distance = abs(solution.objective - solution.dual_objective)
    indefinite = solution.report.residuals["gap"] * (1.0 + abs(solution.objective)) - distance
    return solution.dual_objective - ROOM * max(0.0, indefinite)


def _found(unit: float, solution: Solution) -> LeastGain:
    return LeastGain(unit * max(0.0, _lower(solution)), unit * (solution.objective + solution.slip), solution)


@dataclass(frozen=True)
class Certificate:
    """A feasible point of Theorem 3, in coordinates with C_2 = [0 c] and units of time: x' = change·x, t' = t/time."""

    system: DelayPlant  # The plant in these coordinates
    change: Array  # (n, n) The coordinates in those of the plant
    degree: int  # Degree of the polynomials
    rule: DegreeRule  # Which monomials that stands for
    gamma: float  # The level that is proved, up to the residuals in `solution`
    count: int  # Legendre coefficients of each history
    storage: Array  # Coefficients of V
    residual: Array  # Coefficients that 2⟨e, 𝒵C_2e⟩ must have
    solution: Solution  # The matrices of the cones, with status and residuals of the solver
    time: float = 1.0  # Unit of time, s


FEASIBLE = SdpaOptions(tolerance=1e-8, scale=1e3, gap=1e-2)
"""For a certificate at a given γ: any feasible point serves, so the trace need not be least to many digits."""


def certificate_at(
    system: DelayPlant,
    gamma: float,
    degree: int,
    rule: DegreeRule = DegreeRule.TENSOR,
    *,
    epsilon: float = 1e-5,
    options: SdpaOptions = FEASIBLE,
) -> Certificate:
    """A certificate of the level γ with moderate gains: the cone matrices of least trace, in `natural_units`.

    epsilon: strictness of both inequalities. Any feasible point serves, so `options` stop early. Raises
    InvalidInputError for a bad degree or level or a plant that is not detectable, InfeasibleError where the lower end
    of the least γ proves γ out of reach, whatever the solver calls it, SolverError if it settles on no point.
    """
    level = positive_scalar("gamma", gamma)
    units = natural_units(system)
    gain = rounded(level)
    plant = units.plant(system)
    assembly = assemble(gain_scaled(plant, gain), degree, rule, rates=rule is DegreeRule.BESSEL)
    require_seen(plant, units.time)
    task = program(assembly, epsilon, level / gain)
    try:
        solution = solve_sdpa(task, options)
    except (InfeasibleError, SolverError) as error:
        solution = _again(task, looser(options), error, system, level, degree, rule)
    certificate = certificate_of(assembly, epsilon, level / gain, solution)
    plain = gain_scaled(certificate.system, 1.0 / gain)  # the same V and 𝒵 serve, with w and v in other units
    return replace(certificate, system=plain, gamma=level, change=certificate.change * units.states, time=units.time)


def _again(
    task: Program, stops: SdpaOptions, error: Exception, plant: DelayPlant, level: float, degree: int, rule: DegreeRule
) -> Solution:
    """A point from a larger start, after `error`, if the level is not proved out of reach; or what is known of it."""
    try:
        least = minimum_gain(plant, degree, rule)
    except (InfeasibleError, SolverError) as second:
        raise SolverError(f"{error}; whether the level {level:.6g} can be reached is open: {second}") from second
    if level < least.lower:
        raise InfeasibleError(
            f"the level {level:.6g} is out of reach: degree {degree} of the {rule} rule proves none below "
            f"{least.lower:.6g}; relax the level or raise the degree"
        ) from error
    try:
        return solved(task, stops)
    except (InfeasibleError, SolverError) as last:
        can = "it is known that it can be reached" if level > least.gamma else "it is open whether it can be reached"
        raise SolverError(
            f"{last}; the least level of this degree lies between {least.lower:.6g} and {least.gamma:.6g}, and of "
            f"{level:.6g} {can}; ask for a higher one"
        ) from last


def certificate_of(assembly: Assembly, epsilon: float, gamma: float, solution: Solution) -> Certificate:
    """Read V and the coefficients of 2⟨e, 𝒵C_2e⟩ off a solution."""
    system, count, (cross, level) = assembly.system, assembly.count, assembly.supply
    matrices = np.concatenate([block.ravel() for block in solution.blocks])
    size, e = assembly.storage.shape[1], synthesis.point_offsets(system)[1]
    storage = assembly.storage @ matrices[:size] + epsilon * synthesis.energy(synthesis.state_space(system, count))
    total = assembly.derivative @ storage + cross + gamma * level + assembly.dissipation @ matrices[size:]
    total = total + epsilon * synthesis.energy(synthesis.derivative_space(system, count), e)
    return Certificate(
        system=system,
        change=assembly.change,
        degree=assembly.degree,
        rule=assembly.rule,
        gamma=gamma,
        count=count,
        storage=storage,
        residual=np.where(synthesis.absorbed(system, count), -total, 0.0),
        solution=solution,
    )

"""The least γ that Theorem 3 proves with polynomials of a given degree, as a bracket."""

from __future__ import annotations

from dataclasses import dataclass, replace

from replication.errors import SolverError
from replication.estimation.conic.program import Program, Solution
from replication.estimation.conic.sdpa import SdpaOptions, solve_sdpa
from replication.estimation.delay.sos.cone import DegreeRule
from replication.estimation.delay.sos.reduction import reduced
from replication.estimation.delay.sos.synthesis import Assembly, assemble, program
from replication.estimation.delay.spectrum import require_detectable
from replication.estimation.delay.system import DelaySystem, gain_scaled
from replication.estimation.delay.units import natural_units

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
    """lower <= least γ of this degree <= gamma, both in floating point, from the two sides of one program.

    gamma allows for what the point misses of the equalities (`slip`), lower for a dual slack that is slightly
    indefinite: it holds for matrices of a trace up to ROOM times that of the point. Theorem 3 has certificates for
    every level above gamma (`certificate_at`); lower says nothing of other degrees.

    Attributes
    ----------
    system : DelaySystem
        The plant in the coordinates of the program.
    degree : int
        Degree of the polynomials.
    rule : DegreeRule
        Which monomials that stands for.
    epsilon : float
        Strictness of both inequalities.
    lower : float
        Lower end, of the dual.
    gamma : float
        Upper end, of the point.
    solution : Solution
        The matrices of the cones, with status and residuals of the solver.
    """

    system: DelaySystem
    degree: int
    rule: DegreeRule
    epsilon: float
    lower: float
    gamma: float
    solution: Solution


def minimum_gain(
    system: DelaySystem,
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
    system : DelaySystem
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
    plant = natural_units(system).system
    assembly = reduced(assemble(plant, degree, rule, rates=rates))
    require_detectable(system)
    rough = solved(program(assembly, epsilon), UNITS)
    unit = float(rough.linear[0])
    if _lower(rough) <= 0.0:
        return _found(assembly, epsilon, 1.0, rough)
    scaled = reduced(assemble(gain_scaled(plant, unit), degree, rule, rates=rates))
    return _found(assembly, epsilon, unit, solved(program(scaled, epsilon), options))


def solved(task: Program, options: SdpaOptions) -> Solution:
    """The first point within the options as these are made `looser`, then with the first start. InfeasibleError is a
    proof and ends it; SolverError is that of the last try.
    """
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


def _found(assembly: Assembly, epsilon: float, unit: float, solution: Solution) -> LeastGain:
    return LeastGain(
        system=assembly.system,
        degree=assembly.degree,
        rule=assembly.rule,
        epsilon=epsilon,
        lower=unit * max(0.0, _lower(solution)),
        gamma=unit * (solution.objective + solution.slip),
        solution=solution,
    )

"""The least level of a general delay plant by the small program, and an observer that keeps a level."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.interior import Block, Point, solve
from replication.estimation.delay.exact.loop import plant_terms
from replication.estimation.delay.exact.smoothing import smoother_bound
from replication.estimation.delay.general.cone import (
    Rates,
    Storage,
    dissipation,
    injection,
    positivity,
    rates,
    storage_of,
)
from replication.estimation.delay.general.lines import DelayObserver, LineForm, line_form
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.general.scaling import Scaling, scaling_of
from replication.estimation.validation import Array, positive_integer, positive_scalar

DEGREES, ORDER = (6, 5, 4, 3, 2, 1), 50
"""Degrees unless one is asked for: the first with which the storage has at most so many rows; else the last."""
ROUGH = 0.1
"""Relative gap of an interior point: it only has to be well inside."""


@dataclass(frozen=True)
class GeneralLevel:
    """A level that a storage function proves, and the least of its degree up to the gap of the program."""

    degree: int  # Moments of each line
    level: float  # What `storage` proves
    scaling: Scaling  # The units of the program
    storage: Storage  # In those units, the level included
    steps: int  # Of the interior-point method
    slack: float  # The smallest eigenvalue of all inequalities at `storage`, in those units: positive
    rounding: float  # What rounding may add to it, at most about


@dataclass(frozen=True)
class _Program:
    """The inequalities of a plant in the units of `scaling`."""

    scaling: Scaling
    form: LineForm
    rates: Rates
    blocks: tuple[Block, ...]

    def proved(self, point: Point, scalars: Array, degree: int) -> GeneralLevel:
        """What a point proves. Raises SolverError if an inequality does not hold there."""
        spectra = [np.linalg.eigvalsh(block.at(point.w, scalars)) for block in self.blocks]
        slack = min(float(values[0]) for values in spectra)
        if not slack > 0.0:
            raise SolverError(f"the point found proves nothing (least eigenvalue {slack:.1e}); ask for a higher level")
        rounding = max(float(len(values) * np.finfo(float).eps * values[-1]) for values in spectra)
        storage = storage_of(self.rates, point.w, scalars)
        level = storage.level * self.scaling.gain
        return GeneralLevel(degree, level, self.scaling, storage, point.steps, slack, rounding)


def degree_of(plant: DelayPlant) -> int:
    """The degree that a design takes unless one is asked for, see DEGREES."""
    form = line_form(plant)
    fitting = (degree for degree in DEGREES if form.states + degree * form.width <= ORDER)
    return max(next(fitting, DEGREES[-1]), form.moments)


def least_level(plant: DelayPlant, degree: int) -> GeneralLevel:
    """The least level that `degree` moments of each line prove, with the storage function that proves it.

    The level of a smoother, below which no observer comes, gives w and z their units. Raises InvalidInputError if a
    combination of measurements has no noise or the averages need a higher degree, SolverError if no point is found.
    """
    degree = positive_integer("degree", degree)
    bound = smoother_bound(plant_terms(plant)).level
    unit = bound if 0.0 < bound < np.inf else 1.0
    program = _program(plant, scaling_of(plant).at(unit), degree)
    cost = np.zeros(len(program.blocks[0].others))
    cost[-1] = -1.0
    point = solve(program.blocks, len(program.rates.u), cost)
    return program.proved(point, point.y, degree)


def _program(plant: DelayPlant, scaling: Scaling, degree: int) -> _Program:
    form = line_form(scaling.plant(plant))
    over = rates(form, degree)
    blocks = (
        *positivity(over),
        dissipation(over, over.without_innovation(), outputs=form.outputs),
        dissipation(over, over.without_state(), outputs=0),
    )
    return _Program(scaling, form, over, blocks)


def observer_at(plant: DelayPlant, level: float, degree: int, scaling: Scaling) -> tuple[GeneralLevel, DelayObserver]:
    """An observer that keeps `level`: its storage function is far inside all inequalities, which keeps gains moderate.

    scaling: as `least_level` gives it. Raises InfeasibleError unless the level is above the least of this degree,
    SolverError if no point is found.
    """
    target = positive_scalar("level", level) / scaling.gain
    program = _program(plant, scaling, degree)
    last = len(program.blocks[0].others) - 1
    inside = tuple(_with_slack(block.fixed(last, target)) for block in program.blocks)
    cost = np.zeros(last + 1)
    cost[-1] = 1.0
    point = solve(inside, len(program.rates.u), cost, gap=ROUGH, floor=0.0)
    if point.value <= 0.0:
        raise InfeasibleError(
            f"the level {level:.6g} is not found to be in reach of degree {degree}; relax it or raise the degree"
        )
    found = program.proved(point, np.append(point.y[:-1], target), degree)
    if found.slack <= found.rounding:
        raise SolverError(
            f"whether {level:.6g} is reached is lost in rounding (slack {found.slack:.1e}); ask for a higher level"
        )
    l0, lz, kernels = injection(program.form, program.rates, found.storage)
    return found, DelayObserver(
        plant,
        scaling.back(program.form),
        l0 / scaling.states[:, None] / scaling.time * scaling.sensors,
        lz * scaling.gain**0.5 * scaling.sensors,
        tuple(kernel / scaling.time * scaling.sensors for kernel in kernels),
    )


def _with_slack(block: Block) -> Block:
    """The block less t times the unit matrix, t the last scalar."""
    return replace(block, others=np.concatenate([block.others, -np.eye(len(block.constant))[None]]))

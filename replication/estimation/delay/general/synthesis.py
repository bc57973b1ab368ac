"""The least level of a general delay plant by the small program, and an observer that keeps a level."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.conic.interior import Block, Point, solve
from replication.estimation.delay.exact.central import ladder_model, normal_states, whitened
from replication.estimation.delay.exact.smoothing import highest, smoother_bound
from replication.estimation.delay.exact.terms import Terms, axis, plant_terms
from replication.estimation.delay.general import cone
from replication.estimation.delay.general.cone import LineForm, Rates, Storage
from replication.estimation.delay.general.observer import DelayObserver
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.units import Scaling, natural_units
from replication.estimation.validation import Array, positive_integer, positive_scalar

# Units in which the matrices of a general plant are of moderate size: states, time, and those of w and z.
#
# As `natural_units` of a plant without noise, with delayed and spread terms among the A_i, delayed disturbances in B.


MOMENTS = 3
"""On each piece of the past, in the model of the Kalman filter."""


def back_in(scaling: Scaling, form: LineForm) -> LineForm:
    """A line form in these units in those of the plant, with the same signals on the lines."""
    p, root = form.outputs, scaling.gain**0.5
    rows = np.concatenate([1.0 / (scaling.time * scaling.states), np.full(p, root), 1.0 / scaling.sensors])[:, None]
    columns = np.concatenate([scaling.states, np.full(form.inputs, root)])
    lines = (
        cone.Line(line.delay * scaling.time, line.carry * columns, rows * line.end, rows * line.moments)
        for line in form.lines
    )
    return replace(form, now=rows * form.now * columns, lines=tuple(lines))


def scaling_of(plant: DelayPlant) -> Scaling:
    """Time in natural units, at most the longest delay; errors of the Kalman filter of unit size; w and z as they are.

    So a slow mode is as large as its error, and not as what it becomes in its own time. Where there is no Kalman filter
    the states are balanced.
    """
    a = tuple(now + np.abs(spread).sum(axis=0) for now, spread in zip(plant.a, plant.a_spread, strict=True))
    b = np.hstack([plant.b, *plant.b_delayed])
    c1 = tuple(now + np.abs(spread).sum(axis=0) for now, spread in zip(plant.c1, plant.c1_spread, strict=True))
    c2 = np.eye(1, plant.states)  # no unit hangs on what is measured
    units = natural_units(DelayPlant(plant.a0, plant.delays, b, plant.c10, c2, a, c1))
    noise = np.linalg.norm(np.hstack([plant.d21, *plant.d21_delayed]), axis=1)
    sensors = np.array([1.0 / _power(size) if size > 0.0 else 1.0 for size in noise])
    natural = replace(units, sensors=sensors, time=min(units.time, _power(plant.delays[-1])))
    model = ladder_model(plant_terms(natural.plant(plant)), MOMENTS)
    if np.linalg.matrix_rank(model.dy) < len(model.dy):
        return natural
    return replace(natural, states=natural.states * normal_states(whitened(model))[1][: plant.states])


def _power(value: float) -> float:
    return float(2.0 ** np.round(np.log2(value)))


# Noise at all frequencies: without it an observer may differentiate, and the least level is not attained


NONE = 1e-6
"""Least singular value, relative to rows of unit length, that counts as none."""
POINTS, DECADES = 400, 4


def require_noise(plant: DelayPlant) -> None:
    """Raise InvalidInputError where a combination of measurements is free of noise, at one frequency or high ones."""
    fast = _direct_noise(plant)
    if fast <= NONE:
        raise InvalidInputError(
            "a combination of measurements is free of noise at high frequencies (D_21 with its delayed parts loses "
            "rank there); add a disturbance of its own to each row of d21"
        )
    # Neither the unit of a state nor that of w makes noise small: in units of the errors.
    scaling = scaling_of(plant)
    omega, least = _weakest(scaling.plant(plant))
    omega /= scaling.time
    if least <= NONE:
        raise InvalidInputError(
            f"a combination of measurements is free of noise at {omega:.6g} rad/s; add a disturbance of its own to "
            "each row of d21, or drop a measurement"
        )


def _direct_noise(plant: DelayPlant) -> float:
    """The least singular value of D_21 + sum D_21i e^{-j omega tau_i} over frequencies beyond all dynamics."""
    sizes = np.linalg.norm(plant.d21, axis=1) + sum(np.linalg.norm(d, axis=1) for d in plant.d21_delayed)
    if plant.measurements > plant.inputs or np.any(sizes == 0.0):
        return 0.0

    direct = Terms(plant.d21, plant.delays, plant.d21_delayed, (None,) * plant.delay_count)

    def values(omega: Array) -> Array:
        return np.asarray(-np.linalg.svd(direct.at(axis(omega)) / sizes[:, None], compute_uv=False)[:, -1])

    return -highest(values, np.linspace(0.0, 40.0 * np.pi / plant.delays[0], 4000))[0]


def _weakest(plant: DelayPlant) -> tuple[float, float]:
    """The frequency where the pencil comes closest to losing a row, and how close."""
    terms, rate = plant_terms(plant), 1.0 / plant.delays[-1]
    grid = np.concatenate([[0.0], rate * np.logspace(-DECADES, DECADES / 2, POINTS), rate * np.linspace(0, 50, POINTS)])

    def values(omega: Array) -> Array:
        return np.asarray(-np.linalg.svd(terms.pencil(omega, terms.terms.at(axis(omega))), compute_uv=False)[:, -1])

    least, where = highest(values, np.unique(grid))
    return where, -least


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
        storage, level = Storage(point.w, scalars), float(scalars[-1]) * self.scaling.gain
        return GeneralLevel(degree, level, self.scaling, storage, point.steps, slack, rounding)


def degree_of(plant: DelayPlant) -> int:
    """The degree that a design takes unless one is asked for, see DEGREES."""
    form = cone.line_form(plant)
    fitting = (degree for degree in DEGREES if form.states + degree * form.width <= ORDER)
    return max(next(fitting, DEGREES[-1]), form.moments)


def least_level(plant: DelayPlant, degree: int) -> GeneralLevel:
    """The least level that `degree` moments of each line prove, with the storage function that proves it."""
    degree = positive_integer("degree", degree)
    bound = smoother_bound(plant_terms(plant)).level
    unit = bound if 0.0 < bound < np.inf else 1.0
    program = _program(plant, scaling_of(plant).at(unit), degree)
    cost = np.zeros(len(program.blocks[0].others))
    cost[-1] = -1.0
    point = solve(program.blocks, len(program.rates.u), cost)
    return program.proved(point, point.y, degree)


def _program(plant: DelayPlant, scaling: Scaling, degree: int) -> _Program:
    form = cone.line_form(scaling.plant(plant))
    over = cone.rates(form, degree)
    (change, unit), k = over.innovation, len(over.u)
    still, unmoved = np.delete(change, np.s_[k : k + len(unit)], axis=1), change[:, k:]  # eps = 0, and u = 0
    blocks = (
        *cone.positivity(over),
        cone.dissipation(over, still, outputs=form.outputs),
        cone.dissipation(over, unmoved, outputs=0),
    )
    return _Program(scaling, form, over, blocks)


def observer_at(plant: DelayPlant, level: float, degree: int, scaling: Scaling) -> tuple[GeneralLevel, DelayObserver]:
    """An observer that keeps `level`: with a storage far inside all inequalities, which keeps gains moderate."""
    target = positive_scalar("level", level) / scaling.gain
    program = _program(plant, scaling, degree)
    last = len(program.blocks[0].others) - 1
    fixed = (block.fixed(last, target) for block in program.blocks)
    # Less t times the unit matrix, t the last scalar.
    inside = tuple(replace(b, others=np.concatenate([b.others, -np.eye(len(b.constant))[None]])) for b in fixed)
    cost = np.zeros(last + 1)
    cost[-1] = 1.0
    point = solve(inside, len(program.rates.u), cost, gap=ROUGH, floor=0.0)
    if point.value <= 0.0:
        raise InfeasibleError(
            f"the level {level:.6g} is not found to be in reach of degree {degree}; relax it or raise the degree"
        )
    proof = program.proved(point, np.append(point.y[:-1], target), degree)
    if proof.slack <= proof.rounding:
        raise SolverError(
            f"whether {level:.6g} is reached is lost in rounding (slack {proof.slack:.1e}); ask for a higher level"
        )
    l0, lz, kernels = cone.injection(program.form, program.rates, proof.storage)
    return proof, in_units_of(plant, scaling, program.form, l0, lz, kernels)


def in_units_of(
    plant: DelayPlant, scaling: Scaling, form: LineForm, l0: Array, lz: Array, kernels: Iterable[Array]
) -> DelayObserver:
    """The observer of a plant, from its gains and lines in the units of `scaling`."""
    rate = scaling.sensors / scaling.time
    l0, lz = l0 / scaling.states[:, None] * rate, lz * scaling.gain**0.5 * scaling.sensors
    return DelayObserver(plant, back_in(scaling, form), l0, lz, tuple(kernel * rate for kernel in kernels))

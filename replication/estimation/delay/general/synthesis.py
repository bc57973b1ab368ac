"""Gains of a delay plant with noise: the least level and an observer by the small program, and central gains.

Those are of the filter Riccati equation of the plant with each delay by its moments, at any level up to infinity, the
Kalman filter. Without noise at all frequencies an observer may differentiate, and the least level is not attained.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import scipy

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.shown import Measures, balanced
from replication.estimation.conic.interior import Block, Point, solve
from replication.estimation.delay.exact.central import FilterModel, central, scaling_of
from replication.estimation.delay.exact.limit import Limit, limit
from replication.estimation.delay.exact.response import GainBracket
from replication.estimation.delay.exact.smoothing import FARTHEST, error_covariance, highest, smoother_bound
from replication.estimation.delay.exact.terms import Terms, plant_terms
from replication.estimation.delay.general import cone
from replication.estimation.delay.general.cone import LineForm, Rates, Storage, line_form, moment_plant
from replication.estimation.delay.general.observer import DelayObserver, exact_gain
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.spectrum import require_seen
from replication.estimation.delay.units import Scaling
from replication.estimation.linear.norms import continuous_norm
from replication.estimation.validation import Array, positive_integer, positive_scalar

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
        return np.asarray(-np.linalg.svd(direct.at(1j * omega) / sizes[:, None], compute_uv=False)[:, -1])

    return -highest(values, np.linspace(0.0, 40.0 * np.pi / plant.delays[0], 4000))[0]


def _weakest(plant: DelayPlant) -> tuple[float, float]:
    """The frequency where the pencil comes closest to losing a row, and how close."""
    terms, rate = plant_terms(plant), 1.0 / plant.delays[-1]
    grid = np.concatenate([[0.0], rate * np.logspace(-DECADES, DECADES / 2, POINTS), rate * np.linspace(0, 50, POINTS)])

    def values(omega: Array) -> Array:
        return np.asarray(-np.linalg.svd(terms.pencil(omega, terms.terms.at(1j * omega)), compute_uv=False)[:, -1])

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
    fitting = (degree for degree in DEGREES if plant.states + degree * form.width <= ORDER)
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
        cone.dissipation(over, still, outputs=plant.outputs),
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
    return DelayObserver(plant, back_in(plant, scaling, form), l0, lz, tuple(kernel * rate for kernel in kernels))


def back_in(plant: DelayPlant, scaling: Scaling, form: LineForm) -> LineForm:
    """The lines of a plant in these units in its own, with the same signals on them."""
    root = scaling.gain**0.5
    into = 1.0 / (scaling.time * scaling.states), np.full(plant.outputs, root), 1.0 / scaling.sensors
    rows, columns = np.concatenate(into)[:, None], np.concatenate([scaling.states, np.full(plant.inputs, root)])
    lines = (
        cone.Line(line.delay * scaling.time, line.carry * columns, rows * line.end, rows * line.moments)
        for line in form.lines
    )
    return LineForm(plant, tuple(lines))


WIDTH, KEPT = 1e-6, 1e-3
"""Relative width of the exact gain, and excess over the level of the model that is left to it."""
BALANCE, SMALL, LOST = 1e-3, 40, 0.15
"""Of the level that loses the same share of both: width of the search, states of the model, most share of the mean."""
MARGIN = 0.01
"""Relative distance above the least level at which gains are computed: nearer to it they grow without bound."""
DEGREE, STATES = 12, 120
"""Moments of each delay unless a degree is asked for, and states of the model for which there are fewer."""
OF = "rms error of z"


class Designs:
    """The central gains of a plant at any level, with both measures of each, exact."""

    def __init__(self, plant: DelayPlant, degree: int | None) -> None:
        if np.any(plant.d11):
            raise InvalidInputError(
                "z holds w itself (d11), and white noise has an infinite mean square; leave d11 out, or estimate a "
                "filtered signal"
            )
        require_noise(plant)
        self.plant, self.scaling = plant, scaling_of(plant)
        scaled = self.scaling.plant(plant)
        require_seen(scaled, self.scaling.time)
        self.form = line_form(scaled)
        most = (STATES - plant.states) // max(self.form.width, 1)
        self.degree = max(min(DEGREE, most), self.form.moments, 1) if degree is None else degree
        self.model = moment_plant(self.form, self.degree)

    def exact(self, level: float) -> tuple[DelayObserver, GainBracket]:
        """The observer and its exact gain; raises SolverError if it does not keep the level."""
        observer, few = self.at(level), f"the gains of {self.degree} moments of each delay"
        why = " (a disturbance that y has shown acts again later, where they jump)" if returns(self.plant) else ""
        try:
            gain = exact_gain(observer, WIDTH)
        except InfeasibleError as error:
            raise SolverError(f"{few} do not stabilise the error{why}; set `degree`") from error
        except SolverError as error:
            raise SolverError(f"{few} are of no use: {error}; raise the level, or set `degree`") from error
        if gain.upper > level * (1 + KEPT):
            raise SolverError(
                f"{few} found for the level {level:.6g} have the gain {gain.upper:.6g}; raise the level, "
                "or set `degree`"
            )
        return observer, gain

    def at(self, level: float) -> DelayObserver:
        """The observer, in the units of the plant."""
        try:
            gains, _ = central(self.model, level)
        except (InfeasibleError, np.linalg.LinAlgError) as error:
            what = f"for the level {level:.6g}" if np.isfinite(level) else "of the Kalman filter"
            raise SolverError(
                f"the gains {what} are not found with {self.degree} moments of each delay ({error}); "
                "raise the level, or set `degree`"
            ) from error
        n, p, q = self.plant.states, self.plant.outputs, self.plant.measurements
        ends = n + self.degree * np.cumsum([line.width for line in self.form.lines], dtype=int)
        kernels = [part.reshape(self.degree, -1, q) for part in np.split(gains, [n, *ends])[1:-1]]
        return in_units_of(self.plant, self.scaling, self.form, gains[:n], np.zeros((p, q)), kernels)

    def measures(self, level: float) -> Measures:
        """The exact gain and root mean square of the design at a level."""
        observer, gain = self.exact(level)
        covariance, _ = error_covariance(plant_terms(self.plant), observer.terms)
        return gain.upper, float(np.sqrt(np.trace(covariance)))

    @cached_property
    def limit(self) -> Limit:
        """The least level of any observer."""
        if returns(self.plant):
            raise InvalidInputError(
                "a disturbance that y has shown acts again later (b_delayed or d21_delayed): the gains between both "
                "goals jump there, and are not found; take the goal hinf or h2, or let that noise pass a state"
            )
        least = limit(self.plant)
        if least.level <= 0.0:
            raise InfeasibleError("the least level cannot be told from zero: there is nothing to trade; take goal h2")
        return least

    def least(self) -> float:
        """The smallest level of a design."""
        limit = self.limit
        return (1 + MARGIN) * (limit.level + limit.moving)

    def above_least(self, level: float) -> float:
        """The level if some observer keeps it."""
        limit = self.limit
        if level <= limit.level - limit.moving:
            raise InfeasibleError(
                f"no observer has a gain below {level!r}: the least is {limit.level:.6g}; ask for more"
            )
        return level

    def balance(self, alone: float) -> float:
        """The level whose design loses the same share of both measures, of the mean at most LOST and half the gain."""
        few = max(min(self.degree, (SMALL - self.plant.states) // max(self.form.width, 1)), self.form.moments, 1)
        measures, least = partial(_model_measures, moment_plant(self.form, few)), self.limit.level
        rms = measures(np.inf)[1]
        won = max(alone * self.scaling.time**0.5 / rms - 1.0, 0.0)
        most = 1.0 + min(LOST, won / 2.0)

        def capped(level: float) -> Measures:
            """As if no more of the gain were lost than may be lost of the mean."""
            gain, mean = measures(level)
            return min(gain, most * least), min(mean, FARTHEST * rms)

        return balanced(self.least(), least, capped, BALANCE)


def _model_measures(model: FilterModel, level: float) -> Measures:
    """Gain and root mean square of the error of a model with its central gains at a level; of no gains, infinite."""
    try:
        gains = central(model, level)[0]
    except (InfeasibleError, np.linalg.LinAlgError):
        if np.isinf(level):
            raise
        return level, np.inf
    error = model.error(gains)
    a, b, *_ = error
    P = scipy.linalg.solve_continuous_lyapunov(a, -b @ b.T)
    mean = float(np.sqrt(max(np.trace(model.cz @ P @ model.cz.T), 0.0)))
    return continuous_norm(*error).upper, mean


def returns(plant: DelayPlant) -> bool:
    """Whether a disturbance reaches y and, with a longer delay, x or y once more."""
    shown = [plant.d21, *plant.d21_delayed]
    later = [np.vstack(pair) for pair in zip(plant.b_delayed, plant.d21_delayed, strict=True)]
    return any(np.any(channel @ again.T) for i, channel in enumerate(shown) for again in later[i:])

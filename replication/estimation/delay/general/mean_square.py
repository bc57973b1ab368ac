"""Central gains of a delay plant at any level up to infinity, the Kalman filter, with both measures of each, exact."""

from collections.abc import Callable, Sequence
from functools import cached_property, partial

import numpy as np
import scipy
from numpy.polynomial import legendre

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.shown import Measures, balanced
from replication.estimation.delay.exact.central import FilterModel, central
from replication.estimation.delay.exact.limit import Limit, limit
from replication.estimation.delay.exact.response import GainBracket, error_response, right_roots
from replication.estimation.delay.exact.smoothing import smoother_maps
from replication.estimation.delay.exact.terms import Complex, PlantTerms, Terms, axis, plant_terms
from replication.estimation.delay.general.cone import line_form, moment_plant
from replication.estimation.delay.general.observer import DelayObserver, exact_gain
from replication.estimation.delay.general.synthesis import in_units_of, require_noise, scaling_of
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.spectrum import require_seen
from replication.estimation.linear.norms import continuous_norm
from replication.estimation.validation import Array

# The mean square of an error under white noise of unit intensity, by its spectrum: delays are true exponentials.
#
# The integral over all frequencies is cut smoothly: below a window by Gauss' rule on panels that are halved until they
# agree with a finer rule, beyond it by what the spectrum times omega^2 tends to. The window is smooth, so that the
# oscillations which delays leave there average out.


FAR, TURNED, FARTHEST = 30.0, 80.0, 1000.0
"""Where the window begins: in units of the frequency beyond which there are no dynamics, at least; phase of the
shortest delay there, rad; in those units at the most."""
DECADES, PANELS, PER_DELAY, WINDOW = 8, 100, 8.0, 32
"""The first panels: decades and number of the logarithmic ones; phase of the longest delay over one, rad; number in the
window."""
COARSE, FINE, DIGITS = 6, 12, 1e-9
"""Points of both rules on a panel, and by how much of the integral they may differ, all panels together."""
MOST = 2_000_000
"""Frequencies."""

Function = Callable[[Array], Complex | Array]


def error_covariance(plant: PlantTerms, injection: Terms | None = None) -> tuple[Array, float]:
    """Covariance (p, p) of the error of z, with an injection or of z itself; and where its dynamics end, rad/s."""
    response = error_response(plant, injection)
    reach, roots = right_roots(response)
    if roots:
        raise InfeasibleError(f"the mean square is infinite: the error has {roots} roots in the right half-plane")

    def spectrum(omega: Array) -> Complex:
        return _squared(response.part(np.linalg.inv(response.matrix(axis(omega)))))

    return integrated(spectrum, reach, response.loop.delays), reach


def smoother_covariance(plant: PlantTerms, reach: float) -> Array:
    """The same for an estimator that knows all measurements, past and future; nan where one frequency has no bound."""

    def spectrum(omega: Array) -> Complex:
        maps, hidden = smoother_maps(plant, omega)
        maps[hidden] = np.nan
        return _squared(maps)

    return integrated(spectrum, reach, plant.terms.delays)


def integrated(spectrum: Function, reach: float, delays: Sequence[float]) -> Array:
    """Integral over all frequencies, by 2 pi, of a spectrum (M, p, p), even and from `reach` on like omega^-2."""
    top = max(FAR, min(TURNED / (reach * min(delays)), FARTHEST)) * reach if delays else FAR * reach
    far = np.linspace(top, 2.0 * top, WINDOW + 1)
    edges = [np.array([0.0]), np.geomspace(reach * 10.0**-DECADES, top, PANELS), far]
    if delays:
        edges.append(np.arange(0.0, FAR * reach, max(PER_DELAY / max(delays), 40.0 * FAR * reach / MOST)))
    panels = np.unique(np.concatenate(edges))

    def window(omega: Array) -> tuple[Array, Array, Array]:
        """omega over `top`; what rises smoothly from 0 to 1 over the window; a smooth weight inside of it."""
        ratio = omega / top
        along = np.clip(ratio - 1.0, 1e-3, 1.0 - 1e-3)  # from 0 to 1 over the window, ends left out
        beyond = np.where(ratio < 1.0, 0.0, scipy.special.expit(1.0 / (1.0 - along) - 1.0 / along))
        return ratio, beyond, np.exp(4.0 - 1.0 / (along * (1.0 - along)))

    def averaged(omega: Array) -> Complex | Array:
        ratio, _, middle = window(omega)
        return spectrum(omega)[:, None] * np.stack([middle * ratio**k for k in (2, 4)], axis=1)[..., None, None]

    def weights(omega: Array) -> Array:
        ratio, beyond, middle = window(omega)
        return np.stack([middle * ratio**k for k in (-2, 0, 2)] + [beyond * ratio**-k for k in (2, 4)], axis=1)

    near = _quadrature(lambda omega: spectrum(omega) * (1.0 - window(omega)[1])[:, None, None], panels)
    # There the spectrum is m_1 (top/omega)^2 + m_2 (top/omega)^4 on the average: two averages tell m.
    # What is below the digits of the whole is rounding there.
    averages = _quadrature(averaged, far, float(np.abs(near).max()))
    low, mid, high, *rest = _quadrature(weights, far).real
    parts = np.linalg.solve([[mid, low], [high, mid]], averages.reshape(2, -1)).reshape(averages.shape)
    tail = np.add(rest, [top / 2.0, top / 24.0])  # beyond the window
    return np.asarray((near + np.tensordot(tail, parts, axes=1)).real / np.pi)


def _quadrature(function: Function, edges: Array, size: float = 0.0) -> Complex:
    """The integral over all panels, part of a whole of a `size`; those on which both rules differ are halved."""
    left, right = edges[:-1], edges[1:]
    total: Complex = np.zeros(function(edges[:1]).shape[1:], dtype=complex)
    allowed, used = -1.0, 0
    while left.size:
        used += (COARSE + FINE) * left.size
        if used > MOST:
            raise SolverError(
                "the mean square error stays open: its spectrum is too sharp for "
                f"{MOST} frequencies; a root of the error lies next to the imaginary axis"
            )
        coarse, fine = (_on_panels(function, left, right, points) for points in (COARSE, FINE))
        if allowed < 0.0:
            allowed = DIGITS * max(float(np.abs(fine.sum(axis=0)).max()), size) / left.size
        axes = tuple(range(1, fine.ndim))
        mask = np.abs(fine - coarse).max(axis=axes) <= np.maximum(allowed, 1e-13 * np.abs(fine).max(axis=axes))
        mask |= ~np.isfinite(fine).all(axis=axes)
        total = total + fine[mask].sum(axis=0)
        left, right = left[~mask], right[~mask]
        middle = (left + right) / 2.0
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    return total


def _on_panels(function: Function, left: Array, right: Array, points: int) -> Complex:
    """The integral over each panel (M, ..) by Gauss' rule."""
    nodes, weights = legendre.leggauss(points)
    half = (right - left) / 2.0
    values = function(((left + half)[:, None] + half[:, None] * nodes).ravel())
    return np.asarray(np.einsum("t,m,mt...->m...", weights, half, values.reshape(len(left), points, *values.shape[1:])))


def _squared(maps: Complex) -> Complex:
    return np.asarray(maps @ maps.conj().swapaxes(1, 2))


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
    """The central gains of a plant at any level."""

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
        n, q = self.form.states, self.form.measurements
        ends = n + self.degree * np.cumsum([line.width for line in self.form.lines], dtype=int)
        kernels = [part.reshape(self.degree, -1, q) for part in np.split(gains, [n, *ends])[1:-1]]
        return in_units_of(self.plant, self.scaling, self.form, gains[:n], np.zeros((self.form.outputs, q)), kernels)

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
        few = max(min(self.degree, (SMALL - self.form.states) // max(self.form.width, 1)), self.form.moments, 1)
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

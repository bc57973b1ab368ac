"""The observer of a delay plant, with gains on the present innovation: its error, exact and as a model; its gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.delay.exact.response import (
    GainBracket,
    Response,
    decided,
    error_response,
    gain_bracket,
    mismatched_response,
    right_roots,
)
from replication.estimation.delay.exact.terms import Kernel, Terms, plant_terms, projected
from replication.estimation.delay.general.cone import LineForm, moment_plant
from replication.estimation.delay.general.sampled import InnovationsObserver
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.observer import DelayGains, Trajectory, equidistant
from replication.estimation.linear.periodic import Stage
from replication.estimation.validation import Array, as_array, positive_integer, positive_scalar

# The observer of a delay plant: gains on the present innovation, as data.
#
# With the plant as lines (`LineForm`), x^ and psi^_i follow
#
#     x^'(t) = [A_0 x^ + sum_i (end_i psi^_i(-1) + sum_c moments_i[c] mu^_ic)]_x + L_0 eps(t) + known inputs,
#     d psi^_i / dt = (1/tau_i) d psi^_i / ds + L_i(s) eps(t),    psi^_i(0, t) = E_x,i x^(t),    -1 <= s <= 0,
#     eps(t) = y(t) - [C_2 x^ + sum_i (end_i psi^_i(-1) + sum_c moments_i[c] mu^_ic)]_y,
#     z^(t) = [C_10 x^ + sum_i (end_i psi^_i(-1) + sum_c moments_i[c] mu^_ic)]_z + L_z eps(t),
#
# so that psi^_i(s, t) = E_x,i x^(t + s tau_i) + integral over 0 <= a <= -s tau_i of L_i(s + a / tau_i) eps(t - a): a
# delay equation for x^ with finite memory of the innovation; no history of y is kept. The errors e = x - x^ and psi_i -
# psi^_i follow the same equations with B w for the known inputs, -L_0 eps, -L_i eps, and psi_i(0) = E_i [e; w]; then
# eps is C_2 e + .. + D_21 w, and the error of z is C_10 e + .. + D_11 w - L_z eps.


@dataclass(frozen=True)
class DelayObserver(DelayGains):
    """The gains of an observer, in the units of the plant.

    Attributes
    ----------
    plant : DelayPlant
        Whose known inputs the observer copies.
    form : LineForm
        The same plant as lines.
    l0 : array (n, q)
        L_0, in 1/s.
    lz : array (p, q)
        L_z.
    kernels : tuple of arrays (c, m, q)
        For each line the Legendre coefficients of the polynomial L_i(s) over -1 <= s <= 0, in 1/s.
    """

    plant: DelayPlant
    form: LineForm
    l0: Array
    lz: Array
    kernels: tuple[Array, ...]

    def kernel(self, line: int, points: Array) -> Array:
        """L_i at points of [-1, 0].

        Parameters
        ----------
        line : int
            i, from zero.
        points : array (M,)
            Points s.

        Returns
        -------
        array (M, m, q)
            In 1/s.
        """
        coefficients = self.kernels[line]
        return np.asarray(np.tensordot(legendre.evaluate(len(coefficients), points), coefficients, axes=1))

    @cached_property
    def terms(self) -> Terms:
        """What the innovation adds to the observer's (x', z, y): gains and, for each line, its kernel over the lags.

        The far end of line i adds tau L(lag - 1); its moment c adds tau times the integral of p_c(s) L(s + lag) over
        -1 <= s <= -lag.
        """
        form = self.form
        q = form.measurements
        constant = np.vstack([self.l0, self.lz, np.zeros((q, q))])
        kernels = []
        for i, line in enumerate(form.lines):
            count = len(line.moments)
            degree = len(self.kernels[i]) + count

            def values(lags: Array, i: int = i, count: int = count) -> Array:
                line = form.lines[i]
                total = np.einsum("am,tmq->taq", line.end, self.kernel(i, lags - 1.0))
                if count:
                    nodes, weights = legendre.gauss(len(self.kernels[i]) + count + 1)
                    for t, lag in enumerate(lags):
                        points = -1.0 + (1.0 - lag) * (nodes + 1.0)
                        basis = legendre.evaluate(count, points) * (weights * (1.0 - lag))[:, None]
                        gains = self.kernel(i, points + lag)
                        total[t] += np.einsum("cam,tc,tmq->aq", line.moments, basis, gains)
                return np.asarray(line.delay * total)

            kernels.append(Kernel(projected(values, degree)))
        delays = tuple(line.delay for line in form.lines)
        return Terms(constant, delays, tuple(np.zeros_like(constant) for _ in delays), tuple(kernels))

    @cached_property
    def error(self) -> Response:
        """From w to the error of z, true exponentials."""
        return error_response(plant_terms(self.plant), self.terms)

    def arrays(self, order: int = 0) -> tuple[dict[str, Array], dict[str, str]]:
        """A line that carries nothing has none."""
        gains, axes = {"L0": self.l0, "Lz": self.lz}, {"L0": "(state, measurement)", "Lz": "(output, measurement)"}
        for i, (line, kernel) in enumerate(zip(self.form.lines, self.kernels, strict=True), start=1):
            gains |= {f"L{i}": kernel, f"E{i}": line.carry}
            axes |= {f"L{i}": "(Legendre coefficient, line, measurement)", f"E{i}": "(line, state and disturbance)"}
        return gains, axes

    def error_model(self, order: int) -> Stage:
        """Each line by `order` moments (Legendre-tau method), no fewer than the averages need."""
        plant = moment_plant(self.form, positive_integer("order", order))
        moments = [np.zeros((order, *kernel.shape[1:])) for kernel in self.kernels]
        for held, kernel in zip(moments, self.kernels, strict=True):
            held[: len(kernel)] = kernel[:order]
        injection = np.vstack([self.l0, *(held.reshape(-1, held.shape[2]) for held in moments)])
        return plant.error(injection, self.lz)

    def gain_at(self, omega: Array, order: int = 0) -> Array:
        """With true exponentials."""
        return self.error.gains(omega)

    def running(self, dt: float, order: int = 0) -> InnovationsObserver:
        """With the recursion `sampled`."""
        return InnovationsObserver(plant_terms(self.plant), self.terms, dt=dt)

    def trajectory(self, times: object, disturbance: object, order: int = 0) -> Trajectory:
        """By the recursion that runs: of second order in the step."""
        instants, w, dt = equidistant(times, disturbance, self.plant.inputs)
        plant = plant_terms(self.plant)
        n, _, q, _ = plant.sizes
        # An observer that measures y = 0 and is told -w as if it were known estimates -e.
        rows, columns = np.eye(len(plant.terms.constant)), np.eye(plant.terms.constant.shape[1])
        driven = replace(plant, known=plant.terms.applied(-rows, columns[:, plant.columns[1]]))
        copy = InnovationsObserver(driven, self.terms, dt=dt)
        output, state = np.zeros((len(w), plant.sizes[1])), np.zeros((len(w), n))
        for k, value in enumerate(w):
            state[k] = -copy.step(value, np.zeros(q))
            output[k] = -copy.output
        return Trajectory(instants, w, output, state)


@decided
def exact_gain(observer: DelayObserver, relative: float = 1e-6) -> GainBracket:
    """The L2 gain from w to the error of z, delays and kernels exact.

    Parameters
    ----------
    observer : DelayObserver
        What a synthesis gave.
    relative : float
        Relative width of the bracket that is asked for.

    Returns
    -------
    GainBracket
        Both ends, in floating point; the error system is stable.

    Raises
    ------
    InvalidInputError
        `relative` is not positive.
    InfeasibleError
        The error does not die out.
    SolverError
        A root of the error lies on the imaginary axis, or so near that stability stays open.
    """
    positive_scalar("relative", relative)
    return gain_bracket(observer.error, relative)


@decided
def worst_gain(
    observer: DelayObserver, ranges: Sequence[tuple[float, float]] | None = None, relative: float = 1e-3
) -> GainBracket:
    """The largest gain of an observer while the delays of the plant, constant and unknown, lie anywhere in ranges.

    Parameters
    ----------
    observer : DelayObserver
        Made for the nominal delays, which it keeps.
    ranges : sequence of K pairs of floats, optional
        Shortest and longest delay, s; those of the plant unless given.
    relative : float
        Relative width of the bracket that is asked for.

    Returns
    -------
    GainBracket
        The upper end holds for all delays of the ranges, in floating point; the lower end is attained at the delays
        that it names. The upper end is infinite where stability over the ranges stays open.

    Raises
    ------
    InvalidInputError
        `relative` is not positive, or the ranges are no pairs of positive, ordered delays.
    InfeasibleError
        The plant is unstable: with the least error in a delay the estimate does not follow it.
    SolverError
        Stability at the nominal delays stays open, or the plant has a root on the axis, to rounding.

    Notes
    -----
    The ranges and the frequencies are cut into cells. On each the response is its value and slope at the centre, plus a
    remainder that is bounded. An observer that is stable at the nominal delays, and has no root on the axis in any
    cell, is stable for all delays of the ranges.
    """
    plant = plant_terms(observer.plant)
    positive_scalar("relative", relative)
    intervals = observer.plant.ranges if ranges is None else ranges
    ends = as_array("ranges", intervals, (len(plant.terms.delays), 2), axes="(delays, 2)")
    if np.any(ends[:, 0] <= 0.0) or np.any(ends[:, 0] > ends[:, 1]):
        raise InvalidInputError(f"ranges must be pairs (shortest, longest) of positive delays, got {ends.tolist()}")
    roots = right_roots(error_response(plant))[1]
    if roots:
        raise InfeasibleError(
            f"the plant has {roots} unstable roots: with an error in a delay, however small, no estimate follows it; "
            "stabilise the plant, or measure the delays"
        )
    middle = [float(value) for value in ends.mean(axis=1)]
    pairs = [(float(low), float(high)) for low, high in ends]
    response = mismatched_response(plant, observer.terms, middle, pairs)
    gain = gain_bracket(response, relative)
    return replace(gain, delays=gain.delays[: len(pairs)])

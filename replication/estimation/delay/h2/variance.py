"""The mean square of an error under white noise of unit intensity, by its spectrum: delays are true exponentials.

The integral over all frequencies is cut smoothly: below a window by Gauss' rule on panels that are halved until they
agree with a finer rule, beyond it by what the spectrum times omega^2 tends to. The window is smooth, so that the
oscillations which delays leave there average out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy
from numpy.polynomial import legendre

from replication.errors import InfeasibleError, SolverError
from replication.estimation.delay.exact.kernel import Complex
from replication.estimation.delay.exact.loop import error_response
from replication.estimation.delay.exact.peak import right_roots
from replication.estimation.delay.exact.smoothing import smoother_maps
from replication.estimation.delay.exact.terms import PlantTerms, Terms, axis
from replication.estimation.validation import Array

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


def error_covariance(plant: PlantTerms, injection: Terms) -> tuple[Array, float]:
    """Covariance (p, p) of the error of z for an observer that adds `injection` times its innovation.

    And the frequency beyond which its error has no dynamics, rad/s.

    Raises InfeasibleError if the error does not die out, SolverError if that stays open or the integral does.
    """
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
    """Integral of a spectrum (M, p, p), even in omega and at last like omega^-2, over all frequencies, by 2 pi.

    reach: where that begins, rad/s. Raises SolverError beyond MOST frequencies.
    """
    top = max(FAR, min(TURNED / (reach * min(delays)), FARTHEST)) * reach if delays else FAR * reach
    far = np.linspace(top, 2.0 * top, WINDOW + 1)
    edges = [np.array([0.0]), np.geomspace(reach * 10.0**-DECADES, top, PANELS), far]
    if delays:
        edges.append(np.arange(0.0, FAR * reach, max(PER_DELAY / max(delays), 40.0 * FAR * reach / MOST)))
    panels = np.unique(np.concatenate(edges))

    def along(omega: Array) -> Array:
        """From 0 to 1 over the window, ends left out."""
        return np.asarray(np.clip(omega / top - 1.0, 1e-3, 1.0 - 1e-3))

    def beyond(omega: Array) -> Array:
        """Rises smoothly from 0 to 1 over the window."""
        return np.asarray(
            np.where(omega < top, 0.0, scipy.special.expit(1.0 / (1.0 - along(omega)) - 1.0 / along(omega)))
        )

    def middle(omega: Array) -> Array:
        """A smooth weight inside the window."""
        return np.asarray(np.exp(4.0 - 1.0 / (along(omega) * (1.0 - along(omega)))))

    def weighted(weight: Callable[[Array], Array]) -> Function:
        return lambda omega: spectrum(omega) * weight(omega)[:, None, None]

    def of(weight: Callable[[Array], Array]) -> float:
        return float(_quadrature(lambda omega: weight(omega)[:, None, None], far)[0, 0].real)

    near = _quadrature(weighted(lambda omega: 1.0 - beyond(omega)), panels)
    # There the spectrum is m_1 (top/omega)^2 + m_2 (top/omega)^4 on the average: two averages tell m.
    averages = [_quadrature(weighted(lambda omega, k=k: middle(omega) * (omega / top) ** k), far) for k in (2, 4)]  # type: ignore[misc]
    sizes = [of(lambda omega, k=k: middle(omega) * (omega / top) ** k) for k in (-2, 0, 2)]  # type: ignore[misc]
    parts = np.linalg.solve([sizes[1::-1], sizes[:0:-1]], np.stack(averages).reshape(2, -1)).reshape(2, *near.shape)
    rest = [of(lambda omega, k=k: beyond(omega) * (top / omega) ** k) + top / (k - 1) / 2.0 ** (k - 1) for k in (2, 4)]  # type: ignore[misc]
    return np.asarray((near + np.tensordot(rest, parts, axes=1)).real / np.pi)


def _quadrature(function: Function, edges: Array) -> Complex:
    """The integral over all panels; those on which both rules differ are halved."""
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
            allowed = DIGITS * float(np.abs(fine.sum(axis=0)).max()) / left.size
        done = np.abs(fine - coarse).max(axis=(1, 2)) <= np.maximum(allowed, 1e-13 * np.abs(fine).max(axis=(1, 2)))
        done |= ~np.isfinite(fine).all(axis=(1, 2))
        total = total + fine[done].sum(axis=0)
        left, right = left[~done], right[~done]
        middle = (left + right) / 2.0
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    return total


def _on_panels(function: Function, left: Array, right: Array, points: int) -> Complex:
    """The integral over each panel (M, p, p) by Gauss' rule."""
    nodes, weights = legendre.leggauss(points)
    half = (right - left) / 2.0
    values = function(((left + half)[:, None] + half[:, None] * nodes).ravel())
    return np.asarray(np.einsum("t,m,mtab->mab", weights, half, values.reshape(len(left), points, *values.shape[1:])))


def _squared(maps: Complex) -> Complex:
    return np.asarray(maps @ maps.conj().swapaxes(1, 2))

"""A delay plant, and an observer of it, as matrix functions of s; field by field, apart from the synthesis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from replication.estimation.delay.exact.kernel import Kernel, polynomial, projected
from replication.estimation.delay.exact.terms import PlantTerms, Terms
from replication.estimation.delay.general.observer import DelayObserver
from replication.estimation.delay.general.plant import DelayPlant, plant_of
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.system import DelaySystem
from replication.estimation.validation import Array


def plant_terms(plant: DelayPlant | DelaySystem) -> PlantTerms:
    """(x', z, y) = M(s) (x, w) + N(s) u of a plant."""
    if isinstance(plant, DelaySystem):
        plant = plant_of(plant)
    n, p, q, r, m = plant.states, plant.outputs, plant.measurements, plant.inputs, plant.known_inputs
    constant = np.block([[plant.a0, plant.b], [plant.c10, plant.d11], [plant.c2, plant.d21]])
    delayed, kernels, known = [], [], []
    for i in range(plant.delay_count):
        outputs = np.hstack([plant.c1[i], np.zeros((p, r))])
        measured = np.hstack([plant.c2_delayed[i], plant.d21_delayed[i]])
        delayed.append(np.vstack([np.hstack([plant.a[i], plant.b_delayed[i]]), outputs, measured]))
        kernels.append(_average((plant.a_spread[i], plant.c1_spread[i], plant.c2_spread[i]), r))
        known.append(np.vstack([plant.b_known_delayed[i], np.zeros((p + q, m))]))
    terms = Terms(constant, plant.delays, tuple(delayed), tuple(kernels))
    first = np.vstack([plant.b_known, np.zeros((p + q, m))])
    return PlantTerms((n, p, q, r), terms, Terms(first, plant.delays, tuple(known), (None,) * plant.delay_count))


def _average(weights: Sequence[Array], r: int) -> Kernel | None:
    """The kernel whose rows are the given sums of powers of the lag, (k, rows, n) each; None for zero."""
    if not any(np.any(part) for part in weights):
        return None
    count = max(len(part) for part in weights)
    padded = [np.pad(part, ((0, count - len(part)), (0, 0), (0, r))) for part in weights]
    powers, exponents = np.concatenate(padded, axis=1), np.arange(count)
    return polynomial(projected(lambda lags: np.tensordot(lags[:, None] ** exponents, powers, axes=1), count - 1))


def injection_terms(observer: DelayObserver) -> Terms:
    """What the innovation adds to the observer's (x', z, y): gains and, for each line, its kernel over the lags.

    The far end of line i adds tau L(lag - 1); its moment c adds tau times the integral of p_c(s) L(s + lag) over
    -1 <= s <= -lag.
    """
    form = observer.form
    q = form.measurements
    constant = np.vstack([observer.l0, observer.lz, np.zeros((q, q))])
    kernels = []
    for i, line in enumerate(form.lines):
        count = len(line.moments)
        degree = len(observer.kernels[i]) + count

        def values(lags: Array, i: int = i, count: int = count) -> Array:
            line = form.lines[i]
            total = np.einsum("am,tmq->taq", line.end, observer.kernel(i, lags - 1.0))
            if count:
                nodes, weights = legendre.gauss(len(observer.kernels[i]) + count + 1)
                for t, lag in enumerate(lags):
                    points = -1.0 + (1.0 - lag) * (nodes + 1.0)
                    basis = legendre.evaluate(count, points) * (weights * (1.0 - lag))[:, None]
                    gains = observer.kernel(i, points + lag)
                    total[t] += np.einsum("cam,tc,tmq->aq", line.moments, basis, gains)
            return np.asarray(line.delay * total)

        kernels.append(polynomial(projected(values, degree)))
    delays = tuple(line.delay for line in form.lines)
    return Terms(constant, delays, tuple(np.zeros_like(constant) for _ in delays), tuple(kernels))

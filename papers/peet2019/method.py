"""What the paper compares with: delays as Padé sections or on Chebyshev points, LMI (3), the open loop's gain."""

from dataclasses import dataclass

import numpy as np

from replication.errors import InvalidInputError, SolverError
from replication.estimation.conic.program import solve_modelled
from replication.estimation.delay.exact.central import FilterModel
from replication.estimation.delay.exact.limit import filter_level
from replication.estimation.delay.exact.response import GainBracket, error_response, gain_bracket
from replication.estimation.delay.exact.terms import plant_terms
from replication.estimation.delay.general.cone import line_form, moment_plant
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.spectrum import generator
from replication.estimation.validation import Array, positive_integer, undetectable_mode


def without_noise(a: Array, b: Array, cz: Array, cy: Array) -> FilterModel:
    """ẋ = a x + b w, z = cz x, y = cy x."""
    inputs = b.shape[1]
    return FilterModel(a, b, cz, np.zeros((len(cz), inputs)), cy, np.zeros((len(cy), inputs)))


def pade_model(system: DelayPlant, order: int) -> FilterModel:
    """The plant with each delay as its Padé approximant [order/order]; its first n states are those of the plant.

    Lossless: by moments of what passes, with regard to orthonormal polynomials. Only the row space of [A_i; C_1i] is
    delayed: rank × order states per delay.
    """
    return moment_plant(line_form(system), positive_integer("order", order))


def chebyshev_model(system: DelayPlant, order: int) -> FilterModel:
    """The plant with its history at order + 1 Chebyshev points; the first n states are those of the plant."""
    a, cz = generator(system, order)
    zeros = len(a) - system.states
    b = np.vstack([system.b, np.zeros((zeros, system.inputs))])
    return without_noise(a, b, cz, np.hstack([system.c2, np.zeros((system.measurements, zeros))]))


# LMI (3): the H∞-optimal observer without delays, with Z eliminated, and by Riccati equations.


SLOW = 1e-6
"""Rates below this share of the fastest say nothing of the unit of time."""


@dataclass(frozen=True)
class LmiResult:
    """γ, and what Clarabel said."""

    gamma: float
    status: str


def require_detectable_model(model: FilterModel) -> None:
    """Raise InvalidInputError if an unstable mode of the model is not seen by y."""
    mode = undetectable_mode(model.a, model.cy, discrete=False)
    if mode is not None:
        raise InvalidInputError(
            f"the model is not detectable: y does not see the mode {mode:.6g}; measure another state"
        )


def lmi_gain(model: FilterModel, *, tolerance: float = 1e-9) -> LmiResult:
    """Least γ of LMI (3) with Clarabel, Z eliminated by the kernel of C_2.

    The inequalities are not strict, so γ is the infimum over strict observers. It is Clarabel's word: in awkward
    coordinates an optimum by its account can be off by per cents; `riccati_gain` is the check. Raises InvalidInputError
    for a model that is not detectable, SolverError unless Clarabel reports an optimum to the relative `tolerance`.
    """
    import cvxpy as cp

    require_detectable_model(model)
    (n, r), p, rate = model.b.shape, len(model.cz), _natural_rate(model.a)
    a, b, cz = model.a / rate, model.b / rate**0.5, model.cz / rate**0.5
    gamma = cp.Variable(nonneg=True)
    storage = cp.Variable((n, n), PSD=True)
    kernel = np.linalg.svd(model.cy)[2][len(model.cy) :].T
    corner = kernel.T @ (storage @ a + a.T @ storage) @ kernel
    cross, output = -kernel.T @ storage @ b, kernel.T @ cz.T
    block = cp.bmat(
        [
            [corner, cross, output],
            [cross.T, -gamma * np.eye(r), np.zeros((r, p))],
            [output.T, np.zeros((p, r)), -gamma * np.eye(p)],
        ]
    )
    problem = cp.Problem(cp.Minimize(gamma), [(block + block.T) / 2 << 0])
    options = {"tol_gap_abs": tolerance, "tol_gap_rel": tolerance, "tol_feas": tolerance, "max_iter": 200}
    status = solve_modelled(problem, options)
    if status != cp.OPTIMAL:
        raise SolverError(f"Clarabel stopped with status {status} on LMI (3); loosen the tolerance")
    return LmiResult(float(np.asarray(gamma.value)), status)


def _natural_rate(a: Array) -> float:
    """The geometric mean of the rates of the model, 1/s: in this unit of time the solver's numbers stay moderate."""
    rates = np.abs(np.linalg.eigvals(a))
    rates = rates[rates > SLOW * rates.max(initial=0.0)]
    return float(np.exp(np.mean(np.log(rates)))) if rates.size else 1.0


def riccati_gain(model: FilterModel) -> float:
    """Least γ of any observer of the model by Riccati equations, to ten digits; no code of the LMI.

    Zero if it cannot be told from that, as where y reveals w or all that z needs. Raises InvalidInputError for a model
    that is not detectable, InfeasibleError if there is no finite γ.
    """
    require_detectable_model(model)
    return filter_level(model)


def open_loop_gain(system: DelayPlant, relative: float = 1e-9) -> GainBracket:
    """Supremum of ‖G(jω)‖ from w to z without an observer, delays exact; raises InfeasibleError for an unstable one."""
    return gain_bracket(error_response(plant_terms(system)), relative)

"""Delay-free approximations of a system with delays: lossless Padé of any order, Chebyshev collocation; python-control.

Padé [N/N] of e^{-s} is (1-t)/(1+t) with t the N-th truncation of tanh(s/2) = 1/(1/x + 1/(3/x + 1/(5/x + ..))), x = s/2.
The continued fraction is a lossless ladder, so the all-pass has a realisation with A + Aᵀ = -BBᵀ and moderate entries
at every order; no polynomial and none of its roots is ever computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import TYPE_CHECKING

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.delay.collocation import generator
from replication.estimation.delay.system import DelaySystem, delay_system
from replication.estimation.validation import Array, positive_integer, positive_scalar

if TYPE_CHECKING:
    import control


@dataclass(frozen=True)
class Model:
    """A plant without delays, ẋ = a x + b w, z = c1 x, y = c2 x, with N states.

    Attributes
    ----------
    a : array (N, N)
        1/s.
    b : array (N, r)
        Effect of the disturbance.
    c1 : array (p, N)
        What is estimated.
    c2 : array (q, N)
        Measurements.
    """

    a: Array
    b: Array
    c1: Array
    c2: Array


@dataclass(frozen=True)
class AllPass:
    """ẋ = a x + b u, out = c x + d u: one channel of a delay."""

    a: Array
    b: Array
    c: Array
    d: float


def lossless_delay(order: int, delay: float) -> AllPass:
    """Padé approximant [order/order] of e^{-s·delay} with a + aᵀ = -bbᵀ, c = -d bᵀ, d = ±1."""
    order = positive_integer("order", order)
    time = positive_scalar("delay", delay, unit="s")
    odd = order % 2
    # Z strictly proper: t itself for even order, 1/t = 1/x + (rest of the ladder) for odd order.
    elements = 2.0 * np.arange(odd, order) + 1.0
    lossless, port = np.zeros((order, order)), np.zeros(order)
    port[:odd] = np.sqrt(2.0)
    if elements.size:
        link = 1.0 / np.sqrt(elements[:-1] * elements[1:])
        ladder = np.linalg.inv(np.diag(link, 1) - np.diag(link, -1))
        lossless[odd:, odd:] = -(ladder - ladder.T)  # -2K⁻¹, exactly skew
        port[odd:] = np.sqrt(2.0) * ladder[:, 0] / np.sqrt(elements[0])
    b = np.sqrt(2.0) * port[:, None]
    sign = -1.0 if odd else 1.0
    return AllPass((lossless - b @ b.T / 2.0) / time, b / np.sqrt(time), -sign * b.T / np.sqrt(time), sign)


def companion_delay(order: int, delay: float) -> AllPass:
    """The same approximant in companion form: coefficients spread over many decades. Kept as a warning example."""
    order = positive_integer("order", order)
    time = positive_scalar("delay", delay, unit="s")
    powers = np.arange(order + 1)
    weights = [
        factorial(2 * order - k) / (factorial(k) * factorial(order - k)) for k in range(order + 1)
    ]  # q(s) = Σ weights_k (sτ)^k
    denominator = np.array(weights) * time**powers
    numerator = denominator * (-1.0) ** powers
    feedthrough = numerator[-1] / denominator[-1]
    monic = denominator[:-1] / denominator[-1]
    a = np.diag(np.ones(order - 1), 1)
    a[-1] = -monic
    b = np.zeros((order, 1))
    b[-1] = 1.0
    return AllPass(a, b, (numerator[:-1] / denominator[-1] - feedthrough * monic)[None, :], float(feedthrough))


def pade_model(system: DelaySystem, order: int, *, companion: bool = False) -> Model:
    """The plant with each delay replaced by its Padé approximant [order/order].

    Only the row space of [A_i; C_1i] is delayed: rank × order states per delay.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    order : int
        Order of the approximants.
    companion : bool
        Whether they are realised in companion form, whose coefficients spread over many decades: a warning example.

    Returns
    -------
    Model
        The first n states are those of the plant.

    Raises
    ------
    InvalidInputError
        `order` is below one.
    """
    build = companion_delay if companion else lossless_delay
    n = system.states
    a, c1 = system.a0.copy(), system.c10.copy()
    tails: list[tuple[Array, ...]] = []
    for matrix, output, delay in zip(system.a, system.c1, system.delays, strict=True):
        _, values, right = np.linalg.svd(np.vstack([matrix, output]))
        rank = int(np.sum(values > 1e-12 * max(1.0, values[0])))
        channels = right[:rank]
        section = build(order, delay)
        a += section.d * matrix @ channels.T @ channels
        c1 += section.d * output @ channels.T @ channels
        eye = np.eye(rank)
        tails.append(
            (
                np.kron(eye, section.a).astype(float),
                np.kron(eye, section.b) @ channels,
                matrix @ channels.T @ np.kron(eye, section.c),
                output @ channels.T @ np.kron(eye, section.c),
            )
        )
    size = n + sum(tail[0].shape[0] for tail in tails)
    whole = np.zeros((size, size))
    whole[:n, :n] = a
    outputs = [c1]
    start = n
    for tail_a, tail_b, tail_c, tail_z in tails:
        stop = start + tail_a.shape[0]
        whole[start:stop, start:stop] = tail_a
        whole[start:stop, :n] = tail_b
        whole[:n, start:stop] = tail_c
        outputs.append(tail_z)
        start = stop
    zeros = size - n
    b = np.vstack([system.b, np.zeros((zeros, system.inputs))])
    c2 = np.hstack([system.c2, np.zeros((system.measurements, zeros))])
    return Model(whole, b, np.hstack(outputs), c2)


def chebyshev_model(system: DelaySystem, order: int) -> Model:
    """The plant with its history collocated at Chebyshev points.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    order : int
        The history has order + 1 points.

    Returns
    -------
    Model
        The first n states are those of the plant.

    Raises
    ------
    InvalidInputError
        `order` is below one.
    """
    a, c1 = generator(system, order)
    zeros = a.shape[0] - system.states
    b = np.vstack([system.b, np.zeros((zeros, system.inputs))])
    return Model(a, b, c1, np.hstack([system.c2, np.zeros((system.measurements, zeros))]))


def to_control(system: DelaySystem, order: int) -> control.StateSpace:
    """The Padé model for python-control.

    Parameters
    ----------
    system : DelaySystem
        The plant.
    order : int
        Order of the approximants.

    Returns
    -------
    control.StateSpace
        Inputs w, outputs (z, y).

    Raises
    ------
    InvalidInputError
        `order` is below one.
    """
    import control

    model = pade_model(system, order)
    outputs = np.vstack([model.c1, model.c2])
    return control.StateSpace(model.a, model.b, outputs, np.zeros((outputs.shape[0], model.b.shape[1])))


def from_control(plant: control.StateSpace, measurements: int, a: list[Array], delays: list[float]) -> DelaySystem:
    """A plant whose delay-free part is a `control.StateSpace` with inputs w and outputs (z, y).

    Parameters
    ----------
    plant : control.StateSpace
        Continuous-time, without feedthrough.
    measurements : int
        How many of the last outputs are y.
    a : list of arrays (n, n)
        A_1 ... A_K, in 1/s.
    delays : list of float
        tau_1 < ... < tau_K, s.

    Returns
    -------
    DelaySystem
        The plant of eq. (1).

    Raises
    ------
    InvalidInputError
        The plant is discrete, has feedthrough or too few outputs, or the delayed terms do not fit.
    """
    if not plant.isctime():
        raise InvalidInputError(f"the plant must be in continuous time, its period is {plant.dt}")
    if np.any(plant.D != 0.0):
        raise InvalidInputError("the plant must have no feedthrough: disturbances in z or y are not part of system (1)")
    split = plant.noutputs - positive_integer("measurements", measurements)
    if split < 1:
        raise InvalidInputError(f"the plant has {plant.noutputs} outputs: at least one must be left for z")
    return delay_system(plant.A, a, delays, plant.B, plant.C[:split], plant.C[split:])

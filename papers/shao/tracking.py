"""Experiments on tracking: Table I under the literal reading and others, error against frequency, transients, lag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from papers.shao.method.motor import Feedforward, Motor, ReferenceTiming
from papers.shao.method.readings import STRUCTURES, Structure
from papers.shao.method.simulation import simulate
from papers.shao.method.sweeps import over_plants
from papers.shao.problem import (
    APO,
    APO_READINGS,
    DESIGN,
    FAST,
    FREQUENCIES,
    HELD,
    MOTOR,
    PMI,
    PMI_READINGS,
    READINGS,
    REPAIRED,
    SINGLE,
    START,
    STATE,
    literal_loop,
    reading_loop,
)
from replication.errors import InfeasibleError
from replication.estimation.dualrate.loop import DualRateLoop, noise_gain, stability_radius
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import plant_of
from replication.estimation.dualrate.response import time_response
from replication.estimation.dualrate.tracking import (
    bandwidth,
    estimation_error_ratio,
    estimation_lag,
    reference,
    tracking_error_ratio,
)

COMPARED = (PMI, HELD, SINGLE, APO, REPAIRED, FAST, STATE)
DISTURBED = (PMI, HELD, APO, REPAIRED, FAST)
LOW_FREQUENCY = 0.02
"""σ in rad/s far below the rates of every loop."""


def table(simulated_periods: int) -> dict[str, Any]:
    """Table I by the lifted form, in percent; the radius of each loop; the check by brute-force simulation.

    agreement: for each σ the largest difference in position and its estimate, lifted against simulated, rad.
    weak_gain: two readings of DRC-PMI with L/M in place of L. slow: percent error far below the rates of the loops.
    """
    stable = [name for name in OBSERVERS if stability_radius(literal_loop(name, FREQUENCIES[0])) < 1]
    weak = replace(DESIGN, injection=DESIGN.injection / DESIGN.ratio)
    return {
        "ratios": {name: _percent(literal_loop(name, f) for f in FREQUENCIES) for name in stable},
        "corrected": {name: _percent(_corrected(name, f) for f in FREQUENCIES) for name in stable},
        "weak_gain": {name: _percent(literal_loop(name, f, weak) for f in FREQUENCIES) for name in (PMI, HELD)},
        "slow": {name: _percent([literal_loop(name, LOW_FREQUENCY)])[0] for name in (PMI, HELD, APO)},
        "radius": {name: stability_radius(literal_loop(name, FREQUENCIES[0])) for name in OBSERVERS},
        "agreement": {name: [_agreement(name, f, simulated_periods) for f in FREQUENCIES] for name in (PMI, HELD, APO)},
        "estimation": {
            name: [100 * estimation_error_ratio(literal_loop(name, f)) for f in FREQUENCIES]
            for name in (PMI, HELD, SINGLE, APO, REPAIRED, FAST)
        },
    }


def orderings() -> list[dict[str, Any]]:
    """Steady-state percent errors for every structure and every observer of a column; None for an unstable loop."""
    return [
        {
            "structure": [structure.feedforward, structure.timing, structure.discrete_gain, structure.current],
            "ratios": {name: _structure_ratios(name, structure) for name in (*PMI_READINGS, *APO_READINGS)},
        }
        for structure in STRUCTURES
    ]


def frequency_sweep(frequencies: Sequence[float], levels: Sequence[float]) -> dict[str, Any]:
    """Percent error against σ, bandwidths (rad/s) at the given error ratios, and noise gains; literal reading."""
    return {
        "frequencies": list(frequencies),
        "ratios": {name: _percent(literal_loop(name, f) for f in frequencies) for name in COMPARED},
        "levels": list(levels),
        "bandwidth": {name: [_bandwidth(name, level, frequencies) for level in levels] for name in COMPARED},
        "noise": {name: noise_gain(literal_loop(name, 1.0)) for name in COMPARED},
    }


def transients(slow_periods: int, substeps: int) -> dict[str, Any]:
    """Responses of Figs. 2 and 3 from the printed start with ζ(0) = 0, and time constants −M T/ln(radius) in s."""
    return {
        "responses": {
            name: {str(f): _response(name, f, slow_periods, substeps) for f in (0.5, 1.5)} for name in (PMI, APO)
        },
        "time_constants": {
            name: -DESIGN.slow_period / float(np.log(stability_radius(literal_loop(name, 1.0)))) for name in COMPARED
        },
    }


def lags(ratios: Sequence[int], frequency: float) -> dict[str, Any]:
    """Mean lag of the estimate (s) at a very slow reference against M, for the literal and the repaired observers."""
    found: dict[str, list[float]] = {name: [] for name in (PMI, HELD, APO, REPAIRED)}
    for ratio in ratios:
        for name, values in found.items():
            values.append(estimation_lag(literal_loop(name, frequency, replace(DESIGN, ratio=ratio))))
    return {"ratios": list(ratios), "lags": found, "period": DESIGN.period}


def robustness(factors: Sequence[float]) -> dict[str, Any]:
    """[radius, percent error or None if unstable] at σ = 1 rad/s when J, Ψ_f (with K_T) or R is off by a factor."""
    result: dict[str, Any] = {"factors": list(factors)}
    for parameter in ("inertia", "flux", "resistance"):
        plants = [plant_of(_motor_with(parameter, factor).system()) for factor in factors]
        result[parameter] = {
            name: [
                [radius, None if ratio is None else 100 * ratio]
                for radius, ratio in over_plants(literal_loop(name, 1.0), OBSERVERS[name], plants)
            ]
            for name in DISTURBED
        }
    return result


def _percent(loops: Any) -> list[float]:
    return [100 * tracking_error_ratio(loop) for loop in loops]


def _corrected(name: str, frequency: float) -> DualRateLoop:
    return reading_loop(name, frequency, Feedforward.CORRECTED, ReferenceTiming.HELD)


def _structure_ratios(name: str, structure: Structure) -> list[float] | None:
    loops = [READINGS.loop(name, structure, f) for f in FREQUENCIES]
    return _percent(loops) if stability_radius(loops[0]) < 1 else None


def _bandwidth(name: str, level: float, frequencies: Sequence[float]) -> float | None:
    try:
        return bandwidth(lambda f: literal_loop(name, f), level, frequencies)
    except InfeasibleError:  # the level is not crossed within the sweep
        return None


def _agreement(name: str, frequency: float, periods: int) -> float:
    loop = literal_loop(name, frequency)
    lifted = time_response(loop, START, 0 * START, slow_periods=periods, substeps=5)
    brute = simulate(DESIGN, name, reference(loop), START, 0 * START, slow_periods=periods, substeps=5)
    gaps = lifted.output - brute.output, (lifted.estimate - brute.estimate)[:, 0]
    return float(max(np.abs(gap).max() for gap in gaps))


def _response(name: str, frequency: float, slow_periods: int, substeps: int) -> dict[str, list[float]]:
    loop = literal_loop(name, frequency)
    response = time_response(loop, START, 0 * START, slow_periods=slow_periods, substeps=substeps)
    return {
        "time": response.time.tolist(),
        "output": response.output.tolist(),
        "error": response.error.tolist(),
        "instants": response.instants.tolist(),
        "estimate": response.estimate[:, 0].tolist(),
        "estimation_error": (response.state - response.estimate)[:, 0].tolist(),
    }


def _motor_with(parameter: str, factor: float) -> Motor:
    changes = {parameter: getattr(MOTOR, parameter) * factor}
    if parameter == "flux":
        changes["torque_constant"] = MOTOR.torque_constant * factor
    return replace(MOTOR, **changes)

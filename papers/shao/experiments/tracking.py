"""Table I and Figs. 2 and 3: the loops simulated as the text reads, all readings searched, and the common plant."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import cache, partial
from typing import Any

import msgspec
import numpy as np

from papers.shao import printed
from papers.shao.experiments.theorem import radius
from papers.shao.method.motor import bandwidth, estimation_error_ratio, estimation_lag, simulate, transient_energy
from papers.shao.method.readings import (
    STRUCTURES,
    BlockResult,
    Column,
    Reading,
    first_estimate,
    merge,
    search_block,
    windowed_errors,
)
from papers.shao.printed import APO, DESIGN, FAST, FREQUENCIES, HELD, PMI, READINGS, RESTARTED, START, literal_loop
from replication.audit.judge.printed import Parameters, spread
from replication.errors import InfeasibleError
from replication.estimation import dualrate
from replication.estimation.dualrate.loop import (
    MARGINAL,
    DualRateLoop,
    Points,
    close_loop,
    monodromy,
    noise_gain,
    period_response,
    reference,
    stability_radius,
    start_state,
    steady_state,
    time_response,
    tracking_error_ratio,
)
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign, Plant, dual_rate_design
from replication.estimation.validation import Array

COMPARED = (PMI, HELD, printed.SINGLE, APO, RESTARTED, FAST, printed.STATE)
DISTURBED = (PMI, HELD, APO, RESTARTED, FAST)
LOW_FREQUENCY = 0.02
"""σ in rad/s, below the frequencies of Table I."""


def table(simulated_periods: int) -> dict[str, Any]:
    """Table I by the lifted form, in percent; the radius of each loop; the check by brute-force simulation.

    ratios: the literal reading, by observer. readings: by column, the literal one first.
    agreement: for each σ the largest difference in position and its estimate, lifted against simulated, rad.
    weak_gain: DRC-PMI with L/M in place of L. slow: percent error at LOW_FREQUENCY. slow_feedback: the
    radius where the state itself is fed back at the slow instants.
    """
    radii = {name: radius(DESIGN, name) for name in OBSERVERS}
    slow_feedback = close_loop(DESIGN, lambda model: replace(OBSERVERS[printed.STATE](model), slow_command=True))
    weak = replace(DESIGN, injection=DESIGN.injection / DESIGN.ratio)
    return {
        "ratios": {name: _percent(Reading(name)) for name in OBSERVERS if radii[name] < 1},
        "readings": {
            column: {name: _percent(reading) for name, reading in read.items()} for column, read in printed.READ.items()
        },
        "weak_gain": {PMI: _percent(Reading(PMI), weak)},
        "slow": {name: 100 * tracking_error_ratio(literal_loop(name, LOW_FREQUENCY)) for name in (PMI, APO)},
        "radius": radii,
        "slow_feedback": stability_radius(slow_feedback),
        "agreement": {name: [_agreement(name, f, simulated_periods) for f in FREQUENCIES] for name in (PMI, HELD, APO)},
        "estimation": {
            name: [100 * estimation_error_ratio(literal_loop(name, f)) for f in FREQUENCIES]
            for name in (PMI, HELD, printed.SINGLE, APO)
        },
    }


def orderings() -> list[dict[str, Any]]:
    """Steady-state percent errors and time constants (s) for every structure and every observer of a column.

    None for an unstable loop.
    """
    names = (*printed.PMI_READINGS, *printed.APO_READINGS)
    return [
        {
            "structure": [structure.feedforward, structure.timing, structure.discrete_gain, structure.current],
            "ratios": {name: T and _percent(Reading(name, structure)) for name, T in constants.items()},
            "time_constants": constants,
        }
        for structure in STRUCTURES
        for constants in [{name: _time_constant(READINGS.loop(name, structure, 1.0)) for name in names}]
    ]


def frequency_sweep(frequencies: Sequence[float], levels: Sequence[float]) -> dict[str, Any]:
    """Percent error against σ, bandwidths (rad/s) at the given error ratios, and noise gains; literal reading."""
    # A bandwidth is looked for on the same grid.
    ratios = {name: cache(lambda f, name=name: tracking_error_ratio(literal_loop(name, f))) for name in COMPARED}
    return {
        "frequencies": list(frequencies),
        "ratios": {name: [100 * at(f) for f in frequencies] for name, at in ratios.items()},
        "levels": list(levels),
        "bandwidth": {name: [bandwidth(at, level, frequencies) for level in levels] for name, at in ratios.items()},
        "noise": {name: noise_gain(literal_loop(name, 1.0)) for name in COMPARED},
    }


def transients(slow_periods: int, substeps: int) -> dict[str, Any]:
    """Responses of Figs. 2 and 3 from the printed x(0) and each reading of ζ(0), and time constants −M T/ln(radius), s.

    energy: integral of the square of what the tracking error is apart from its steady state, rad² s. excited: for each
    observer of SRC and each reference of Table I, the share of the unstable mode in the offset at t = 0.
    """
    sigmas = [float(sigma) for sigma in printed.DATA["frequency"].values()]

    def by_start(names: Sequence[str], value: Callable[[DualRateLoop, str], Any]) -> dict[str, Any]:
        return {
            choice: {name: {str(f): value(literal_loop(name, f), choice) for f in sigmas} for name in names}
            for choice in printed.STARTS
        }

    return {
        "responses": by_start((PMI, APO), partial(_response, slow_periods=slow_periods, substeps=substeps)),
        "energy": by_start((PMI, HELD, printed.SINGLE, APO), _energy),
        "time_constants": {name: _time_constant(literal_loop(name, 1.0)) for name in COMPARED},
        "excited": {
            name: {start: [_excitation(literal_loop(name, f), start) for f in FREQUENCIES] for start in printed.STARTS}
            for name in printed.SINGLE_RATES.values()
        },
    }


def lags(ratios: Sequence[int], frequency: float) -> dict[str, Any]:
    """Mean lag of the estimate (s) at a very slow reference against M, for the literal and the restarted observers."""
    designs = [replace(DESIGN, ratio=ratio) for ratio in ratios]
    delays = {
        name: [estimation_lag(literal_loop(name, frequency, design)) for design in designs]
        for name in (PMI, HELD, APO, RESTARTED)
    }
    return {"ratios": list(ratios), "lags": delays, "period": DESIGN.period}


def robustness(factors: Sequence[float]) -> dict[str, Any]:
    """[radius, percent error or None if unstable] at σ = 1 rad/s when J, Ψ_f (with K_T) or R is off by a factor."""
    result: dict[str, Any] = {"factors": list(factors)}
    for moved in (("inertia",), ("flux", "torque_constant"), ("resistance",)):
        nominal = {name: getattr(printed.MOTOR, name) for name in moved}
        motors = [replace(printed.MOTOR, **{name: n * factor for name, n in nominal.items()}) for factor in factors]
        plants = [motor.system() for motor in motors]
        result[moved[0]] = {name: over_plants(literal_loop(name, 1.0), name, plants) for name in DISTURBED}
    return result


def over_plants(nominal: DualRateLoop, observer: str, plants: Sequence[Plant]) -> list[list[float | None]]:
    """[radius, percent tracking error or None without a steady state] of the nominal loop around each true plant."""
    rows: list[list[float | None]] = []
    for plant in plants:
        loop = close_loop(nominal.design, OBSERVERS[observer], plant=plant, harmonic=reference(nominal))
        size = stability_radius(loop)
        rows.append([size, 100 * tracking_error_ratio(loop) if size < 1.0 - MARGINAL else None])
    return rows


def _percent(reading: Reading, design: DualRateDesign = DESIGN) -> list[float]:
    """A column of Table I under a reading."""
    loops = [replace(READINGS, design=design).loop(reading.observer, reading.structure, f) for f in FREQUENCIES]
    return [100 * tracking_error_ratio(loop, reading.points) for loop in loops]


def _time_constant(loop: DualRateLoop) -> float | None:
    """−M T/ln(radius) in s; None for an unstable loop."""
    size = stability_radius(loop)
    return -loop.design.slow_period / float(np.log(size)) if size < 1.0 - MARGINAL else None


def _estimate(choice: str) -> Array:
    """ζ(0) under a reading of the start of the observer."""
    return first_estimate(printed.STARTS[choice], START, DESIGN.model.C[0])


def _energy(loop: DualRateLoop, choice: str) -> float:
    """`transient_energy` of what the output is apart from its steady state, from a reading of the start."""
    offset = start_state(loop, START, _estimate(choice)) - np.imag(steady_state(loop).states[0])
    return transient_energy(loop, offset)


def _excitation(loop: DualRateLoop, choice: str) -> float:
    """Modulus of the slow periods' largest mode in the offset from the periodic solution, for unit vectors."""
    transition, size = monodromy(loop), loop.size
    gain = period_response(loop, np.zeros(size, complex)).states[-1]
    turn = np.exp(reference(loop).exponent * loop.design.slow_period)
    periodic = np.imag(np.linalg.solve(turn * np.eye(size) - transition, gain))
    offset = start_state(loop, START, _estimate(choice)) - periodic
    values, modes = np.linalg.eig(transition.T)
    mode = modes[:, np.argmax(np.abs(values))]
    return float(np.abs(mode @ offset) / (np.linalg.norm(mode) * np.linalg.norm(offset)))


def _agreement(name: str, frequency: float, periods: int) -> float:
    loop = literal_loop(name, frequency)
    lifted = time_response(loop, START, 0 * START, slow_periods=periods, substeps=5)
    brute = simulate(DESIGN, name, reference(loop), START, 0 * START, slow_periods=periods, substeps=5)
    gaps = lifted.output - brute.output, (lifted.estimate - brute.estimate)[:, 0]
    return float(max(np.abs(gap).max() for gap in gaps))


def _response(loop: DualRateLoop, choice: str, slow_periods: int, substeps: int) -> dict[str, list[float]]:
    response = time_response(loop, START, _estimate(choice), slow_periods=slow_periods, substeps=substeps)
    return {
        "time": response.time.tolist(),
        "output": response.output.tolist(),
        "error": response.error.tolist(),
        "instants": response.instants.tolist(),
        "estimate": response.estimate[:, 0].tolist(),
        "estimation_error": (response.state - response.estimate)[:, 0].tolist(),
    }


SEARCH = tuple(f"readings-{index:02d}" for index in range(len(STRUCTURES)))
"""Names of the blocks of the search."""


def block(structure: int) -> dict[str, Any]:
    """Search all readings of one structure for Table I."""
    return asdict(search_block(READINGS, table_columns(), structure))


def windows() -> dict[str, Any]:
    """For each cell of Table I the largest error over windows of time, under each reading of the cell and each ζ(0).

    long: windows of whole slow periods, at least half a period of the reference, in which every steady state has its
    maximum. nearest: of these the error nearest to the print, percent. hits: how many of these, and of the shorter
    ones, give the print. from_some_time: nearest to the print among the largest errors from a time t₀ on, percent. As
    t₀ grows this maximum falls without a jump from that of the whole run to that of the steady state.
    """
    rows = range(len(FREQUENCIES))
    return {name: [_over_windows(name, column, row) for row in rows] for name, column in table_columns().items()}


def _over_windows(name: str, column: Column, row: int) -> dict[str, Any]:
    frequency, target, half = FREQUENCIES[row], column.values[row], column.half_widths[row]
    tried = [*printed.READ[name].values(), *([Reading(printed.SLOW_INPUT)] if name == "pmi" else [])]
    loops = [(READINGS.loop(reading.observer, reading.structure, frequency), reading.points) for reading in tried]
    errors = np.array([windowed_errors(READINGS, loop)[:, list(Points).index(points)] for loop, points in loops])
    lasting = READINGS.design.slow_period * np.array([end - start for start, end in READINGS.windows])
    long = lasting >= np.pi / frequency
    hit = np.abs(errors - target) <= half
    whole = errors[..., long].ravel()
    run = errors[..., READINGS.windows.index((0, READINGS.horizon))]
    reached = [
        np.clip(target, steady, max(steady, largest))
        for (loop, points), starts in zip(loops, run, strict=True)
        if points is Points.BETWEEN and stability_radius(loop) < 1 - MARGINAL
        for steady in [tracking_error_ratio(loop)]
        for largest in starts
    ]
    return {
        "nearest": float(100 * whole[np.argmin(np.abs(np.log(whole / target)))]),
        "from_some_time": float(100 * min(reached, key=lambda value: abs(np.log(value / target)))),
        "long": whole.size,
        "hits": {"long": int(hit[..., long].sum()), "short": int(hit[..., ~long].sum())},
    }


def table_columns() -> dict[str, Column]:
    """The printed columns as ratios, with half a unit of the last printed place."""
    columns = {}
    for name, observers in (("pmi", printed.PMI_READINGS), ("apo", printed.APO_READINGS)):
        texts = printed.table_1(f"DRC-{name.upper()}")
        values = np.array([float(text) for text in texts]) / 100
        half_widths = np.array([0.5 * 10.0 ** -len(text.split(".")[1]) for text in texts]) / 100
        columns[name] = Column(observers, values, half_widths)
    return columns


def merged(blocks: Iterable[dict[str, Any]]) -> BlockResult:
    """The whole search from the stored results of its blocks."""
    return merge([msgspec.convert(stored, BlockResult) for stored in blocks])


# The common plant with a slow sensor in a loop, and how far Table I moves with the rounding of inputs


PREDICTORS = {
    APO: "in a loop, every m-th instant, predictor as printed",
    RESTARTED: "in a loop, every m-th instant, restarted predictor",
}


def on_common_plant(plant: dict[str, Any], multiples: list[int]) -> dict[str, list[float | None]]:
    """Noise to output of the linear-quadratic loop with each predictor and ratio m; None where it is unstable."""
    model = dualrate.make_plant(plant["A"], plant["B"], plant["C"])
    return {name: [_noise(model, plant, name, m) for m in multiples] for name in PREDICTORS}


def _noise(model: Any, plant: dict[str, Any], observer: str, ratio: int) -> float | None:
    try:
        result = dualrate.design(
            model, period=plant["h"], ratio=ratio, observer=observer, sensor_noise=[[plant["noise"] ** 2]]
        )
    except InfeasibleError:
        return None
    return float(result.fact("noise to output").value)


PRINTS = {
    **{name: printed.DATA[name] for name in printed.PARAMETERS},
    "K": f"[{' '.join(printed.DATA['feedback'])}]",
    "L": f"[{'; '.join(printed.DATA['injection'])}]",
}
"""What Table I was computed from, as printed; T and M are settings, exact as printed."""


def sensitivity(
    prints: Mapping[str, str], pole_pairs: int, period: float, ratio: int, cells: list[dict[str, Any]]
) -> dict[str, Any]:
    """Percent errors of `cells` (observer, frequency, claim); prints: the motor's parameters, K and L."""

    def compute(numbers: Parameters) -> dict[str, float]:
        motor = replace(printed.MOTOR, pole_pairs=pole_pairs, **{name: numbers[name] for name in printed.PARAMETERS})
        gains = {"feedback": numbers["K"], "injection": numbers["L"]}
        design = dual_rate_design(motor.system(), **gains, period=period, ratio=ratio)
        loops = {cell["claim"]: literal_loop(cell["observer"], cell["frequency"], design, motor) for cell in cells}
        return {claim: 100 * tracking_error_ratio(loop) for claim, loop in loops.items()}

    return spread(prints, compute)

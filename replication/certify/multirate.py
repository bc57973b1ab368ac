"""Certificates of the gain of multi-rate observers: Lyapunov matrices from above, disturbances from below."""

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any, NamedTuple

import cvxpy as cp
import numpy as np
import scipy.linalg

from replication.certify import (
    as_floats,
    bracket,
    exact,
    modelled,
    rational,
    rounded_array,
    rounded_down,
    rounded_up,
)
from replication.errors import SolverError
from replication.estimation import multirate
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import PeriodicSystem, Stage, frequency_response, lifted
from replication.estimation.linear.riccati import RiccatiMap, settled, stacked
from replication.estimation.multirate import losses
from replication.estimation.multirate.kalman import state_scales
from replication.estimation.multirate.losses.models import InARow, along, automaton
from replication.estimation.multirate.losses.worst import bracket as worst_case
from replication.estimation.multirate.optimum import Optimum, optimum, riccati_design
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array, ComplexArray
from replication.verify.reading import written

BITS = 24
"""Of the entries of a disturbance of norm one: its ratio is off by the square of that."""
TURN_BITS = 20
NEAR = 1e-7
"""How near to the optimum, relatively, a disturbance of finite length must come."""
MOST_PERIODS = 60


class Turn(NamedTuple):
    """A rational point of the unit circle: the angle per period, and the rational rotation (or 1, or -1)."""

    angle: float
    matrix: list[list[str]]


def rational_turn(angle: float) -> Turn:
    """The rotation by about `angle` in [0, pi] with entries (1 - t^2, 2t) / (1 + t^2), t = tan(angle/2) rounded."""
    if np.sin(angle) < 2.0**-TURN_BITS:
        return Turn(0.0, [["1"]]) if angle < 1 else Turn(np.pi, [["-1"]])
    t = Fraction(round(np.tan(angle / 2) * 2**TURN_BITS), 2**TURN_BITS)
    c, s = (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)
    return Turn(float(2 * np.arctan(float(t))), [[str(c), str(s)], [str(-s), str(c)]])


def peak_disturbance(system: PeriodicSystem, angle: float) -> tuple[list[list[str]], list[Any]]:
    """The turn per period and the inputs v_k (m, r) of the largest singular value of the lifted response there."""
    turn = rational_turn(angle)
    response = frequency_response(system.lift(), turn.angle)
    right = np.linalg.svd(response)[2][0].conj()
    return turn.matrix, _phases(right, [stage.B.shape[1] for stage in system.stages], turn)


def unseen_forever(problem: MultirateProblem, angle: float) -> tuple[list[list[str]], list[Any]]:
    """The turn per period and the d_k (m_d, r) that disturb z most, sensor noise that hides them counted in.

    That noise is w_k = -D_k^+ C_k x_k; a generalised eigenvector of outputs against disturbances.
    """
    turn = rational_turn(angle)
    plant, N = problem.plant, problem.schedule.period
    hidden = [_hidden(plant, rows) for rows in problem.measured_rows()]
    zero = np.zeros((plant.W.shape[0], plant.B_d.shape[1]))
    states = PeriodicSystem(tuple(Stage(plant.A, plant.B_d, plant.W, zero) for _ in range(N)))
    noises = PeriodicSystem(tuple(Stage(plant.A, plant.B_d, H, np.zeros((len(H), plant.B_d.shape[1]))) for H in hidden))
    T_x, T_w = (frequency_response(system.lift(), turn.angle) for system in (states, noises))
    largest = _largest(T_x.conj().T @ T_x, np.eye(T_w.shape[1]) + T_w.conj().T @ T_w)
    return turn.matrix, _phases(largest, [plant.B_d.shape[1]] * N, turn)


def _hidden(plant: MultiratePlant, rows: list[int]) -> Array:
    """From x_k to the noise that hides it."""
    return np.asarray(-np.linalg.pinv(plant.D[rows]) @ plant.C[rows])


def unseen_for_long(problem: MultirateProblem, level: float) -> tuple[int, list[Any], float]:
    """Phase at the start, d_k (m_d, 1) and ratio of a disturbance that no measurement shows until its end.

    Horizons grow until the ratio is within NEAR of `level`; all phases at the start are tried. Raises SolverError if
    MOST_PERIODS do not do.
    """
    N = problem.schedule.period
    for length in range(N, MOST_PERIODS * N, N):
        candidates = [(*_best_of_length(problem, start, length), start) for start in range(N)]
        ratio, d, start = max(candidates, key=lambda candidate: candidate[0])
        if ratio >= level * (1 - NEAR):
            return start, rounded_array(d[:, :, None], BITS), ratio
    raise SolverError(f"no disturbance of {MOST_PERIODS} periods comes within {NEAR:g} of the level {level!r}")


def _best_of_length(problem: MultirateProblem, start: int, length: int) -> tuple[float, Array]:
    """The largest ratio of z(1) .. z(T) to d, w at 0 .. T - 1 without a measurement, and its d (T, m_d)."""
    plant, rows = problem.plant, problem.measured_rows()
    A, B, W, m = plant.A, plant.B_d, plant.W, plant.B_d.shape[1]
    hidden = (_hidden(plant, rows[(start + k) % len(rows)]) for k in range(length))
    Z = lifted([Stage(A, B, W @ A, W @ B)] * length).D
    V = np.vstack([np.eye(length * m), lifted([Stage(A, B, H, np.zeros((len(H), m))) for H in hidden]).D])
    d = np.real(_largest(Z.T @ Z, V.T @ V))
    return float(np.linalg.norm(Z @ d) / np.linalg.norm(V @ d)), d.reshape(length, m)


def _largest(first: ComplexArray | Array, second: ComplexArray | Array) -> ComplexArray:
    """The eigenvector, of norm one, of the largest eigenvalue of a pair of Hermitian matrices."""
    vector = scipy.linalg.eigh(first, second, subset_by_index=[len(first) - 1] * 2)[1][:, 0]
    return np.asarray(vector / np.linalg.norm(vector))


def _phases(vector: ComplexArray, sizes: list[int], turn: Turn) -> list[Any]:
    """A complex signal over one period as v_k (m, r): its parts beside each other, or the real part alone if it is all.

    z v with z = e^{j angle} is then v turned by the matrix of `turn`.
    """
    vector = vector * np.exp(-1j * np.angle(vector[np.argmax(np.abs(vector))]))
    columns = [vector.real, vector.imag][: len(turn.matrix)]
    instants = np.split(np.stack(columns, axis=1), np.cumsum(sizes)[:-1])
    return [rounded_array(part, BITS) for part in instants]


MARGIN = 1e-7
"""Relative distances: of the design to the optimum, of the Lyapunov matrices to the gain, of the bounds to those."""
SLACK = 1e-8
"""Added to every eigenvalue of W'W relative to the largest: the inequality then holds with that much room."""
LEVEL_BITS, STATE_BITS = 40, 40


def gain(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds and witness for the gains of the plant; raises SolverError if rounding leaves no Lyapunov matrices."""
    system = problem_of(theorem).error_system(as_floats(theorem["plant"]["L"]))
    norm = l2_gain(system)
    turn, v = peak_disturbance(system, norm.angle)
    level = norm.upper * (1 + MARGIN)
    return {
        "bound": bracket(norm.lower, level, MARGIN, LEVEL_BITS),
        "witness": {"P": rounded_array(lyapunov_matrices(system, level), STATE_BITS), "turn": turn, "v": v},
    }


def in_units(
    theorem: Mapping[str, Any], level: float, maker: Callable[[Mapping[str, Any]], dict[str, Any]]
) -> dict[str, Any]:
    """What `maker` finds with each state in the unit of its estimation error and a gain, of about `level`, near one.

    With x' = S x and z' = z/g the Lyapunov matrices are P = g^2 S P' S and the bounds g times those found; all units
    are powers of two, so that nothing is rounded.
    """
    error = np.linalg.norm(state_scales(problem_of(theorem)), axis=2).max(axis=0)
    size = rational(2.0 ** round(np.log2(level)))
    states = exact(np.diag(np.exp2(-np.round(np.log2(np.where(error > 0, error, 1.0))))))
    back, plant = states.inv(), theorem["plant"]
    scaled = {
        **plant,
        "A": written(states * exact(plant["A"]) * back),
        "B_d": written(states * exact(plant["B_d"])),
        "C": written(exact(plant["C"]) * back),
        "W": written(exact(plant["W"]) * back * (1 / size)),
        "L": [written(states * exact(L)) for L in plant["L"]],
    }
    certificate = maker({**theorem, "plant": scaled})
    P = [written(states * exact(P_k) * states * size**2) for P_k in certificate["witness"]["P"]]
    return {
        "bound": {side: str(rational(number) * size) for side, number in certificate["bound"].items()},
        "witness": {**certificate["witness"], "P": P},
    }


def optimum_noncausal(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds and witness for an optimum that sits on the non-causal bound."""
    problem = problem_of(theorem)
    best = optimum(problem)
    turn, d = unseen_forever(problem, best.noncausal.angle)
    upper, witness = design(problem, best)
    return {
        "bound": bracket(best.noncausal.lower, upper, MARGIN, LEVEL_BITS),
        "witness": {**witness, "turn": turn, "d": d},
    }


def optimum_causal(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds and witness for an optimum above the non-causal bound."""
    problem = problem_of(theorem)
    best = optimum(problem)
    start, d, lower = unseen_for_long(problem, best.lower)
    upper, witness = design(problem, best)
    return {"bound": bracket(lower, upper, MARGIN, LEVEL_BITS), "witness": {**witness, "start": start, "d": d}}


def feasible_design(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """An upper bound alone: a level of Theorem 2 with P_k and Y_k."""
    problem = problem_of(theorem)
    upper, witness = design(problem, optimum(problem))
    return {"bound": {"upper": bracket(upper, upper, MARGIN, LEVEL_BITS)["upper"]}, "witness": witness}


def design(problem: MultirateProblem, best: Optimum) -> tuple[float, dict[str, Any]]:
    """A level just above the optimum, and P_k, Y_k = P_k L_k that satisfy Theorem 2 there."""
    gains = riccati_design(problem, best.upper * (1 + MARGIN)).gains
    system = problem.error_system(gains)
    level = l2_gain(system).upper * (1 + MARGIN)
    P = lyapunov_matrices(system, level)
    return level, {"P": rounded_array(P, STATE_BITS), "Y": rounded_array(P @ gains, STATE_BITS)}


def problem_of(theorem: Mapping[str, Any]) -> MultirateProblem:
    """The estimation problem of a theorem in floating point; sensors that are not used never measure.

    Their rows are left out, and the columns of their noise stay without effect.
    """
    plant, parameters = theorem["plant"], theorem["parameters"]
    rows = list(parameters["sensors"])
    system = MultiratePlant(
        A=as_floats(plant["A"]),
        B_d=as_floats(plant["B_d"]),
        C=as_floats(plant["C"])[rows],
        D=as_floats(plant["D"])[rows],
        W=as_floats(plant["W"]),
    )
    return MultirateProblem(system, SensingSchedule(tuple(parameters["periods"]), tuple(parameters["offsets"])))


def lyapunov_matrices(system: PeriodicSystem, level: float, slack: float = SLACK) -> Array:
    """P_k (N, n, n) with P_(k-1) = A_k' (I - P_k B_k B_k'/g^2)^-1 P_k A_k + C_k'C_k + slack |C_k|^2, for D_k = 0.

    Raises SolverError if the recursion has no limit at this level g.
    """
    backwards = stacked(
        RiccatiMap(
            stage.A.T,
            -stage.B @ stage.B.T / level**2,
            stage.C.T @ stage.C + slack * np.linalg.norm(stage.C, 2) ** 2 * np.eye(system.order),
        )
        for stage in reversed(system.stages)
    )
    matrices = settled(backwards)
    if matrices is None:
        raise SolverError(f"no Lyapunov matrices at the level {level!r}: rounding spoils the recursion; raise it")
    return matrices[::-1]


LOSS_MARGIN = 1e-6
"""Relative distances of the bounds to the numbers found: room for the rounding of the storage functions."""


def least_gain(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds and witness for the gains that `losses.design` finds, rounded."""
    problem = problem_of(theorem)
    plant, schedule = problem.plant, problem.schedule
    result = losses.design(multirate.design(plant, periods=schedule.periods, offsets=schedule.offsets), _model(theorem))
    return gain_under_losses(theorem, rounded_array(result.gains["L"], STATE_BITS), result.bracket.upper)


def gain_under_losses(theorem: Mapping[str, Any], gains: Any, level: float) -> dict[str, Any]:
    """Bounds and witness for gains that follow the losses, in exact numbers; level: about that which they reach.

    Raises SolverError if no level is proved.
    """
    certificate = in_units({**theorem, "plant": {**theorem["plant"], "L": gains}}, level, _bounded)
    return {**certificate, "witness": {"L": gains, **certificate["witness"]}}


def _model(theorem: Mapping[str, Any]) -> InARow:
    parameters = theorem["parameters"]
    return InARow(parameters["misses"], together=bool(parameters["together"]))


def _bounded(theorem: Mapping[str, Any]) -> dict[str, Any]:
    problem = problem_of(theorem)
    graph = automaton(problem, _model(theorem))
    gains = as_floats(theorem["plant"]["L"])
    worst = worst_case(problem, graph, gains, graph.cycles())
    system = along(problem, gains, worst.word)
    turn, v = peak_disturbance(system, l2_gain(system).angle)
    leaving = [worst.tree.out[node] for node in range(len(worst.P))]
    return {
        "bound": bracket(worst.lower, worst.upper, LOSS_MARGIN, LEVEL_BITS),
        "witness": {
            "at": [graph.edges[worst.tree.edges[out[0]].origin].source for out in leaving],
            "to": [[worst.tree.edges[i].target for i in out] for out in leaving],
            "P": rounded_array(worst.P, STATE_BITS),
            "word": list(worst.word),
            "turn": turn,
            "v": v,
        },
    }


DUAL_BITS = 20
WORSE = 2.0
"""The level that one matrix does not reach, relative to the gain: any above one tells the two apart."""


def shorter_periods(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """A design for the longer periods, and a disturbance that the sensors with the shorter ones see too late."""
    shorter, longer = (_together(theorem, theorem["parameters"][name]) for name in ("shorter", "longer"))
    level, witness = design(longer, optimum(longer))
    start, d, _ = unseen_for_long(shorter, optimum(shorter).lower)
    return {"bound": {}, "witness": {"level": rounded_up(level, LEVEL_BITS), **witness, "start": start, "d": d}}


def _together(theorem: Mapping[str, Any], periods: list[int]) -> Any:
    parameters = {"sensors": theorem["parameters"]["sensors"], "periods": periods, "offsets": [0] * len(periods)}
    return problem_of({**theorem, "parameters": parameters})


def one_matrix(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Multipliers of Theorem 1 with one matrix, as far inside their cone as a level above the gain leaves room for.

    Raises SolverError if the solver finds none.
    """
    system = problem_of(theorem).error_system(as_floats(theorem["plant"]["L"]))
    n, level = system.order, WORSE * l2_gain(system).upper
    steps = [np.hstack([stage.A, stage.B]) for stage in system.stages]
    Z = [cp.Variable((step.shape[1],) * 2, symmetric=True) for step in steps]
    room = cp.Variable()
    gained = sum(step @ Z_k @ step.T - Z_k[:n, :n] for step, Z_k in zip(steps, Z, strict=True))
    states = sum(cp.trace(s.C @ Z_k[:n, :n] @ s.C.T) for s, Z_k in zip(system.stages, Z, strict=True))
    inside = [part - room * np.eye(part.shape[0]) >> 0 for part in (*Z, gained)]
    noises = sum(cp.trace(Z_k[n:, n:]) for Z_k in Z)
    modelled(cp.Problem(cp.Maximize(room), [*inside, noises == 1, states >= level**2]))
    witness = [rounded_array(Z_k.value, DUAL_BITS) for Z_k in Z]
    values = [as_floats(Z_k) for Z_k in witness]
    ratio = sum(np.trace(s.C @ Z_k[:n, :n] @ s.C.T) for s, Z_k in zip(system.stages, values, strict=True))
    reached = np.sqrt(ratio / sum(np.trace(Z_k[n:, n:]) for Z_k in values))
    return {"bound": {"lower": rounded_down(reached * (1 - MARGIN), LEVEL_BITS)}, "witness": {"Z": witness}}

"""The stability result of Sec. IV: condition (18), α₄ λ_max(P) T < 1 whatever the ratio M, and the steps of its proof.

Beside them the inequality (15) that it rests on, counter-examples, and the true slow rates; and the motor: its model,
gains and feedforward, and the eigenvalues of its loop against the period.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from papers.shao.method.motor import Feedforward, feedforward
from papers.shao.printed import APO, COUNTEREXAMPLE, DESIGN, FAST, MOTOR, PMI, RESTARTED
from replication.errors import InfeasibleError
from replication.estimation.dualrate.loop import close_loop, monodromy, stability_radius, time_response
from replication.estimation.dualrate.observers import OBSERVERS, held
from replication.estimation.dualrate.problem import DualRateDesign, make_plant
from replication.estimation.validation import Array, ComplexArray


@dataclass(frozen=True, eq=False)
class TheoremConstants:
    """P (2n, 2n) of ÃᵀP + P Ã = −I, its smallest eigenvalue, α₁ … α₄, and α₄ λ_max(P) T of (18), to be below one."""

    P: Array
    smallest: float
    alpha: tuple[float, float, float, float]
    condition: float


def hurwitz_margins(design: DualRateDesign) -> tuple[float, float]:
    """Largest real parts of the eigenvalues of A + B K and of A − L C, 1/s; negative means Hurwitz."""
    model = design.model
    return _growth(model.A + model.B_u @ design.feedback), _growth(model.A - design.injection @ model.C)


def theorem_constants(design: DualRateDesign) -> TheoremConstants:
    """Evaluate (12) to (18) with spectral norms; raises InfeasibleError unless A + B K and A − L C are Hurwitz."""
    margins = hurwitz_margins(design)
    if max(margins) >= 0.0:
        raise InfeasibleError(
            f"Sec. IV needs A + B K and A − L C Hurwitz; largest real parts are {margins[0]:g} and {margins[1]:g}"
        )
    A, B, C = design.model.A, design.model.B_u, design.model.C
    K, L = design.feedback, design.injection
    guided = A - L @ C
    joint = np.block([[A + B @ K, -B @ K], [np.zeros_like(A), guided]])
    P = scipy.linalg.solve_continuous_lyapunov(joint.T, -np.eye(2 * len(A)))
    P = (P + P.T) / 2
    smallest, *_, largest = map(float, np.linalg.eigvalsh(P))
    root = float(np.sqrt(smallest))
    alpha1 = (norm(C @ A) + 2 * norm(C @ B @ K)) / root
    alpha2 = (2 * norm(K @ guided) + 2 * norm(K @ B @ K) + norm(K @ L @ C)) / root
    alpha3 = norm(C @ A) / root
    total = alpha2 * norm(B) + norm(L) * alpha1 + norm(B) * alpha3 * norm(K @ L) + alpha3 * norm(L)
    alpha4 = 2 * total * largest / root
    return TheoremConstants(P, smallest, (alpha1, alpha2, alpha3, alpha4), float(alpha4 * largest * design.period))


def prediction_gap(design: DualRateDesign, *, restarted: bool = False) -> tuple[float, float]:
    """Both sides of (15) at the first instant after a measurement: the worst |y_p(t_k) − y(t_k)|, and α₃ T.

    By (5) and (6), y_p(t_k) − y(t_k) = −C e^{AT} ξ(t_{k−1}) exactly, so that the left side tends to
    (C [P⁻¹]_ξξ Cᵀ)^½ as T → 0 and not to zero. restarted: with the predictor that starts at the measurement the error
    is −C (e^{AT} − I) ξ(t_{k−1}). Here V(χ(t_{k−1})) = 1, and ξ is the worst one.
    """
    constants = theorem_constants(design)
    change = scipy.linalg.expm(design.model.A * design.period) - np.eye(design.model.order) * restarted
    predicted = design.model.C @ change
    row = np.hstack([np.zeros_like(predicted), predicted])
    worst = np.sqrt(np.max(np.diag(row @ np.linalg.solve(constants.P, row.T))))
    return float(worst), float(constants.alpha[2] * design.period)


def rate_gap(design: DualRateDesign, *, predicted: bool = False) -> float:
    """By how much the change of (6) from C ζ(t_{k−1}) departs over a period from the integral of C A ζ + C B u, over T.

    At the worst, for unit (ζ(t_{k−1}), u, ȳ(t_{k−1})). predicted: with the state ζ_p of (6) in the place of ζ by (3).
    """
    A, B, C, L = design.model.A, design.model.B_u, design.model.C, design.injection
    (n, m), p, T = B.shape, len(C), design.period
    # Over one period: ζ by (3), the model's ζ_p by (6), and the integral of C A ζ + C B u, from held u and ȳ.
    flow = np.zeros((2 * n + p + m + p,) * 2)
    flow[:n, :n], flow[:n, 2 * n + p :] = A - L @ C, np.hstack([B, L])
    flow[n : 2 * n, n : 2 * n], flow[n : 2 * n, 2 * n + p : 2 * n + p + m] = A, B
    state = slice(n, 2 * n) if predicted else slice(0, n)
    flow[2 * n : 2 * n + p, state], flow[2 * n : 2 * n + p, 2 * n + p : 2 * n + p + m] = C @ A, C @ B
    starts = np.zeros((len(flow), n + m + p))
    starts[:n, :n] = starts[n : 2 * n, :n] = np.eye(n)
    starts[2 * n + p :, n:] = np.eye(m + p)
    change = np.asarray((scipy.linalg.expm(flow * T) - np.eye(len(flow))) @ starts)
    return norm(C @ change[n : 2 * n] - change[2 * n : 2 * n + p]) / T


def slow_eigenvalues(design: DualRateDesign, observer: str) -> ComplexArray:
    """The 2n largest eigenvalues of the monodromy matrix, of plant and observer; moduli decrease."""
    eigenvalues = np.linalg.eigvals(monodromy(close_loop(design, OBSERVERS[observer]))).astype(complex)
    return np.asarray(eigenvalues[np.argsort(-np.abs(eigenvalues), kind="stable")[: 2 * design.model.order]])


def slow_rates(design: DualRateDesign, observer: str) -> ComplexArray:
    """ln(λ)/(M T) of the slow eigenvalues λ, 1/s: the continuous rates that the loop stands for."""
    return np.asarray(np.log(slow_eigenvalues(design, observer)) / design.slow_period)


def slow_rate_gap(design: DualRateDesign, observer: str, *, period: float, share: float) -> float:
    """Largest distance from `slow_rates` at the given period to eig(A + B K) ∪ eig(A − share · L C), matched, 1/s.

    As T → 0 it vanishes like T: for share = 1/M under (6), for share = 1 with the running prediction or a fast sensor.
    """
    from scipy.optimize import linear_sum_assignment  # slow to load

    model, rates = design.model, slow_rates(replace(design, period=period), observer)
    joint = model.A + model.B_u @ design.feedback, model.A - share * design.injection @ model.C
    limits = np.concatenate([np.linalg.eigvals(matrix) for matrix in joint])
    distances = np.abs(rates[:, None] - limits)
    return float(np.max(distances[linear_sum_assignment(distances)]))


def _growth(matrix: Array) -> float:
    return float(np.max(np.linalg.eigvals(matrix).real))


def norm(matrix: Array) -> float:
    """The spectral norm."""
    return float(np.linalg.norm(matrix, 2))


COMPARED = (APO, RESTARTED, FAST)
PERIODS = (1e-4, 1e-5, 1e-6)
"""Decreasing T in s, at which both sides of (15) and the slow rates are looked at."""
POINTS = 40
"""Times looked at within a fast period."""


def theorem(periods: Sequence[float], ratios: Sequence[int]) -> dict[str, Any]:
    """Condition (18) for the motor, both sides of (15) at small T, the counter-example, and the slow rates.

    periods: decreasing T in s for the limits. ratios: M of the counter-example. printed_gap, scalar_gap: (15)
    at the T of the loop. restarted_gap: (15) with the restarted predictor. increment_rate_gap: `rate_gap` at
    the largest T, with the model's state too, and at the T of the loop.
    """
    motor, scalar = theorem_constants(DESIGN), theorem_constants(COUNTEREXAMPLE)

    def rate_gaps(name: str, share: float) -> list[float]:
        return [slow_rate_gap(DESIGN, name, period=T, share=share) for T in periods]

    return {
        "motor": {"condition": motor.condition, "smallest": motor.smallest, "alpha4": motor.alpha[3]},
        "scalar": {
            "condition": scalar.condition,
            "period": COUNTEREXAMPLE.period,
            "allowed_period": COUNTEREXAMPLE.period / scalar.condition,
            "radii": {str(M): radius(COUNTEREXAMPLE, APO, ratio=M) for M in ratios},
        },
        "factor_gap": _factor_gap(),
        "periods": list(periods),
        "gap": {"motor": [prediction_gap(replace(DESIGN, period=T)) for T in periods]},
        "printed_gap": prediction_gap(DESIGN),
        "scalar_gap": prediction_gap(COUNTEREXAMPLE),
        "restarted_gap": [prediction_gap(replace(DESIGN, period=T), restarted=True) for T in periods],
        "increment_rate_gap": {
            "estimate": rate_gap(replace(DESIGN, period=periods[0])),
            "estimate, by the model": rate_gap(replace(DESIGN, period=periods[0]), predicted=True),
            "estimate, printed period": rate_gap(DESIGN),
        },
        "radius": {name: radius(COUNTEREXAMPLE, name) for name in COMPARED},
        "rate_gap": {"printed": rate_gaps(APO, 1 / DESIGN.ratio), "printed_full_gain": rate_gaps(APO, 1)},
    }


def radius(design: DualRateDesign, observer: str, **changes: Any) -> float:
    """Monodromy radius of a design with one of `OBSERVERS`, at another period (s) or ratio if one is given."""
    return stability_radius(close_loop(replace(design, **changes), OBSERVERS[observer]))


def slowest_rates(periods: Sequence[float]) -> dict[str, Any]:
    """Largest real part of the rates (1/s) of the counter-example against T: (6), restarted predictor, fast sensor."""
    loops = [replace(COUNTEREXAMPLE, period=T) for T in periods]
    rates = {name: [float(np.max(slow_rates(loop, name).real)) for loop in loops] for name in COMPARED}
    return {"periods": list(periods), "rates": rates}


def longer_ratios(stable: int, unstable: int, beyond: Sequence[int]) -> dict[str, Any]:
    """The counter-example with the restarted predictor: the least M between two ratios at which it is unstable.

    Found by bisection, which needs a stable and an unstable end; radius: at that M and at the one below. beyond: ratios
    from there on, with their radii. (18) has no M: its left side is that of the printed predictor. Raises
    InfeasibleError if the ends do not part.
    """

    def at(ratio: int) -> float:
        return radius(COUNTEREXAMPLE, RESTARTED, ratio=ratio)

    if not at(stable) < 1.0 < at(unstable):
        raise InfeasibleError(f"the loop must be stable at M = {stable} and unstable at M = {unstable}")
    while unstable - stable > 1:
        middle = (stable + unstable) // 2
        stable, unstable = (middle, unstable) if at(middle) < 1.0 else (stable, middle)
    return {"ratio": unstable, "radius": [at(stable), at(unstable)], "beyond": {str(M): at(M) for M in beyond}}


def divergence(ratio: int, length: float, points: int) -> dict[str, Any]:
    """x of the counter-example over `length` s from x(0) = 1 and ζ(0) = 0, at about as many points.

    printed, restarted, fast: by predictor at the M of the counter-example. longer: restarted and fast at `ratio`.
    """
    fast_periods = round(length / COUNTEREXAMPLE.period)
    step = fast_periods // points

    def response(name: str, design: DualRateDesign) -> list[float]:
        loop = close_loop(design, OBSERVERS[name])
        trajectory = time_response(loop, [1.0], [0.0], slow_periods=fast_periods // design.ratio + 1, substeps=1)
        return [float(x) for x in trajectory.output[: fast_periods + 1 : step]]

    longer = replace(COUNTEREXAMPLE, ratio=ratio)
    return {
        "time": [COUNTEREXAMPLE.period * k for k in range(0, fast_periods + 1, step)],
        "ratio": ratio,
        "own": {name: response(name, COUNTEREXAMPLE) for name in COMPARED},
        "longer": {name: response(name, longer) for name in (RESTARTED, FAST)},
    }


def step_bounds(trials: int, seed: int) -> dict[str, Any]:
    """Largest left over right side of (12), (13), (14) over `trials` random loops with Hurwitz A + B K and A − L C.

    Order two; T between 1 ms and 10 s; random x, ζ and prediction error e_p at t_k; exact in time. 14: with
    |e_p| (t − t_k) in the place of e_p. modulus: with |e_p| there. 17: the bracket of (16) over its bound by α₄
    in (17). slow: a scalar loop with rates near 1e-3 1/s, nearly at rest, over a period of two seconds.
    """
    rng = np.random.default_rng(seed)
    worst = dict.fromkeys(("12", "13", "14", "17"), -np.inf)
    for _ in range(trials):
        design, constants = _random_loop(rng)
        start, error = rng.normal(size=4), rng.normal(size=1)
        ratios = _ratios(design, constants, start, error) | {"17": _collected(design, constants)}
        worst = {name: max(worst[name], ratios[name]) for name in worst}
    slow = DualRateDesign(
        make_plant([[1e-3]], [[1]], [[1]]), np.array([[-2e-3]]), np.array([[2e-3]]), period=2.0, ratio=2
    )
    longer = _ratios(slow, theorem_constants(slow), np.full(2, 1e-6), np.ones(1))
    return {"trials": trials, "worst": worst, "slow": {name: longer[name] for name in ("14", "modulus")}}


def _factor_gap() -> float:
    """Largest difference of 1 − φ of (22) and (1 − E)(1 − c), E = e^{−T/(2 λ_max)} and c the left side of (18)."""
    conditions = np.linspace(0.0, 2.0, 41)
    decays = np.exp(-np.geomspace(1e-6, 10, 40))[:, None]
    factors = decays + (1 - decays) * conditions
    return float(np.max(np.abs(1 - factors - (1 - decays) * (1 - conditions))))


def _random_loop(rng: np.random.Generator) -> tuple[DualRateDesign, TheoremConstants]:
    """A loop of order two with Hurwitz A + B K and A − L C, of which alone the theorem speaks; T from 1 ms to 10 s."""
    while True:
        plant = make_plant(rng.normal(size=(2, 2)), rng.normal(size=(2, 1)), rng.normal(size=(1, 2)))
        gains = 2 * rng.normal(size=(1, 2)), 2 * rng.normal(size=(2, 1))
        design = DualRateDesign(plant, *gains, period=float(10 ** rng.uniform(-3, 1)), ratio=2)
        try:
            return design, theorem_constants(design)
        except InfeasibleError:
            continue


def _collected(design: DualRateDesign, constants: TheoremConstants) -> float:
    """What stands with ‖χ‖ V_m in (16), by ‖χ‖ ≤ √V/√λ_min, over α₄ of (17)."""
    B, K, L = design.model.B_u, design.feedback, design.injection
    n = design.model.order
    PB, PL = norm(constants.P[:, :n] @ B), norm(constants.P[:, n:] @ L)
    alpha1, alpha2, alpha3, alpha4 = constants.alpha
    total = alpha2 * PB + alpha1 * PL + alpha3 * PB * norm(K @ L) + alpha3 * PL
    return float(2 * total / np.sqrt(constants.smallest) / alpha4)


def _ratios(design: DualRateDesign, constants: TheoremConstants, start: Array, error: Array) -> dict[str, float]:
    """Left over right side, the largest over the times of one fast period, from (x, ζ) at t_k and e_p(t_k)."""
    P, alpha = constants.P, constants.alpha
    A, B, C = design.model.A, design.model.B_u, design.model.C
    K, L = design.feedback, design.injection
    n = len(A)
    zero = np.zeros_like(A)
    joint = np.block([[A, zero], [zero, A - L @ C]])
    u = K @ start[n:]
    drive = np.concatenate([B @ u, B @ u + L @ (C @ start[:n] + error)])
    width = design.period / POINTS
    step = held(joint, drive[:, None], width)
    states = [start]
    for _ in range(POINTS):
        states.append(step.state @ states[-1] + step.input[:, 0])
    z = np.array(states)
    x, zeta = z[:, :n], z[:, n:]
    chi = np.hstack([x, x - zeta])
    root_v = np.sqrt(np.sum(chi @ P * chi, axis=1))
    root = np.sqrt(np.linalg.eigvalsh(P)[0])
    rate = np.abs(x @ (C @ A).T + C @ B @ u)[:, 0]
    bound12 = (norm(C @ A) * root_v + 2 * norm(C @ B @ K) * root_v[0]) / root
    # The largest V so far on the grid is below the true one, which makes the test stricter.
    elapsed = width * np.arange(1, POINTS + 1)
    moved = np.maximum.accumulate(root_v)[1:] * elapsed
    change_y = np.abs((x[1:] - x[0]) @ C.T)[:, 0]
    change_u = np.abs((zeta[1:] - zeta[0]) @ K.T)[:, 0]
    size = norm(K @ L) * np.abs(error[0])
    return {
        "12": float(np.max(rate / bound12)),
        "13": float(np.max(change_y / (alpha[0] * moved))),
        "14": float(np.max(change_u / (alpha[1] * moved + size * elapsed))),
        "modulus": float(np.max(change_u / (alpha[1] * moved + size))),
    }


# Sec. V: the motor


def motor_model(seed: int) -> dict[str, Any]:
    """(23) against A and B in position coordinates; Hurwitz margins; what the feedforwards leave of the inverse.

    transfer_gap: largest relative difference of the two transfer functions at random points, which draw from `seed`.
    inverse_gap: |P(jσ) ȳ_d/y_d − 1| for each feedforward over the frequencies of Table I, at its largest.
    equation_gap: residual of (9) against (10) at random states; case_gap: of Case 2, with ȳ(t_k) = y(t_k) in (9), and
    (10) without its last term.
    """
    rng = np.random.default_rng(seed)
    points = rng.normal(size=8) + 1j * rng.normal(size=8) * 100
    feedback, observer = hurwitz_margins(DESIGN)
    sigma = 1j * np.linspace(0.5, 3.0, 26)
    return {
        "torque_constant": 1.5 * MOTOR.pole_pairs * MOTOR.flux,
        "transfer_gap": float(max(abs(_physical(s) / _position(s) - 1) for s in points)),
        "feedback_margin": feedback,
        "observer_margin": observer,
        "inverse_gap": {
            form: float(max(abs(_position(s) * feedforward(MOTOR, s, form) - 1) for s in sigma)) for form in Feedforward
        },
        "equation_gap": _equation_gap(rng),
        "case_gap": _equation_gap(rng, measured=True),
        "slow_period": DESIGN.slow_period,
    }


def motor_eigenvalues(periods: Sequence[float]) -> dict[str, Any]:
    """Moduli of the 2n largest eigenvalues of the motor's monodromy matrix against T at the printed M, decreasing."""
    designs = [replace(DESIGN, period=period) for period in periods]
    moduli = {
        name: [np.abs(slow_eigenvalues(design, name)).tolist() for design in designs]
        for name in (PMI, APO, RESTARTED, FAST)
    }
    return {"periods": list(periods), "moduli": moduli}


def _physical(s: complex) -> complex:
    """θ/u_q of (23) by solving its three equations for i_q, ω and θ."""
    m = MOTOR
    matrix = np.array(
        [
            [s + m.resistance / m.inductance, m.pole_pairs * m.flux / m.inductance, 0],
            [-m.torque_constant / m.inertia, s + m.friction / m.inertia, 0],
            [0, -1, s],
        ]
    )
    return complex(np.linalg.solve(matrix, [1 / m.inductance, 0, 0])[2])


def _position(s: complex) -> complex:
    """θ/u_q from the printed A, B and C."""
    model = DESIGN.model
    return complex((model.C @ np.linalg.solve(s * np.eye(3) - model.A, model.B_u))[0, 0])


def _equation_gap(rng: np.random.Generator, *, measured: bool = False) -> float:
    """(9) minus (10) for random x, ξ, ζ(t_k), y(t_k) and y_p(t_k), relative to the size of (9).

    measured: Case 2, with y(t_k) for ȳ(t_k) in (9), and (10) without its last term.
    """
    A, B, C = DESIGN.model.A, DESIGN.model.B_u, DESIGN.model.C
    K, L = DESIGN.feedback, DESIGN.injection
    x, xi, held = (rng.normal(size=3) for _ in range(3))
    measured_output, predicted = rng.normal(size=1), rng.normal(size=1)
    zeta, last = x - xi, predicted - measured_output
    if measured:
        predicted, last = measured_output, 0 * last
    first = np.concatenate([A @ x + B @ (K @ held), A @ xi - L @ (predicted - C @ zeta)])
    joint = np.block([[A + B @ K, -B @ K], [np.zeros((3, 3)), A - L @ C]])
    extra = np.concatenate([B @ (K @ (held - zeta)), -L @ (measured_output - C @ x) - L @ last])
    second = joint @ np.concatenate([x, xi]) + extra
    return float(np.linalg.norm(first - second) / np.linalg.norm(first))

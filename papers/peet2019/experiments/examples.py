"""Computations behind Examples 1-3 and Fig. 1; functions of JSON values that return JSON values."""

from dataclasses import asdict, fields, replace
from itertools import product
from typing import Any

import numpy as np

from papers.peet2019.method import chebyshev_model, lmi_gain, open_loop_gain, pade_model, riccati_gain, without_noise
from replication.audit.judge.numerals import layout
from replication.audit.judge.printed import Parameters, spread
from replication.estimation.conic.program import Program, Solution, solve_clarabel
from replication.estimation.conic.sdpa import ENDLESS, SdpaOptions, one_process
from replication.estimation.delay.plant import DelayPlant, delay_system
from replication.estimation.delay.sos import synthesis
from replication.estimation.delay.sos.certificate import Certificate, certificate_at, minimum_gain
from replication.estimation.delay.sos.cone import DegreeRule
from replication.estimation.delay.sos.observer import Trajectory, assembled, error_system, simulate, spectral_abscissa
from replication.estimation.delay.sos.operators import GainValues, ObserverGains, check, evaluate, observer_gains
from replication.estimation.delay.spectrum import Scheme, grid, rightmost_roots
from replication.estimation.linear.norms import continuous_norm
from replication.estimation.linear.periodic import Stage

Json = dict[str, Any]

CHEBYSHEV_ORDER = 12
LOOSE = SdpaOptions(gap=1e-2, residual=1e-5)
EPSILONS = (1e-5, 1e-3)


def references(plant: Json, order: int, visible: Json | None) -> Json:
    """What does not use Theorem 3: roots, LMI (3) on the Padé model, Riccati on two models, and the exact gain.

    visible: the scalar system whose gain is the optimum where the measurement does not see x_1, or None.
    """
    system = delay_system(**plant)
    root = rightmost_roots(system, 1)[0]
    pade = pade_model(system, order)
    solved = lmi_gain(pade)
    return {
        "root": [float(root.real), float(abs(root.imag))],
        "pade": solved.gamma,
        "pade_states": pade.a.shape[0],
        "pade_status": solved.status,
        "pade_riccati": riccati_gain(pade),
        "chebyshev": _optimum(system),
        "exact": asdict(open_loop_gain(delay_system(**visible))) if visible else None,
    }


def _optimum(system: DelayPlant) -> float:
    return riccati_gain(chebyshev_model(system, CHEBYSHEV_ORDER))


@one_process()
def synthesised(plant: Json, degree: int) -> Json:
    """Least γ of Theorem 3 at one degree, for the rules of Z_2, each with what the solver said.

    At degree 1, where the value depends on it: also the wide rule, with a loose gap, and for the tensor rule ε > 0 and
    Clarabel on the same program.
    """
    record: Json = {}
    system = delay_system(**plant)
    for rule in (DegreeRule.TENSOR, DegreeRule.TOTAL):
        certificate = minimum_gain(system, degree, rule)
        record[rule.value] = {"gamma": certificate.gamma, "solver": certificate.solution.report.to_dict()}
    if degree == 1:
        wide = minimum_gain(system, degree, DegreeRule.WIDE, options=LOOSE)
        record["wide"] = {"gamma": wide.gamma, "solver": wide.solution.report.to_dict()}
        record["clarabel"] = cross_checked(system, degree).objective
        record["epsilon"] = {str(e): minimum_gain(system, degree, epsilon=e, options=LOOSE).gamma for e in EPSILONS}
    return record


def cross_checked(system: DelayPlant, degree: int) -> Solution:
    """The program of Theorem 3, not reduced, solved by Clarabel: for small systems, as a second opinion."""
    task, loose = synthesis.program(synthesis.assemble(system, degree, DegreeRule.TENSOR), 0.0), 1e-8
    return solve_clarabel(task, matrices=True, tol_gap_abs=loose, tol_gap_rel=loose, tol_feas=loose)


def as_printed(plant: Json, degree: int) -> Json:
    """Whether Theorem 3 with the printed signs of S_i(-τ_i) in D and of dS_i/ds in F_i is `refuted`, by ε.

    With those signs the condition asks S_i(-τ_i) <= 0 of a positive S_i: ε > 0 forbids it, by one equality alone; ε = 0
    allows the limit S_i(-τ_i) = 0.
    """
    assembly = synthesis.assemble(delay_system(**plant), degree)
    inner, count = assembly.system, assembly.count
    target = synthesis.derivative_space(inner, count)
    source = synthesis.state_space(inner, count)
    derivative = synthesis.lie_derivative(inner, count).tolil()
    _, _, late = synthesis.point_offsets(inner)
    ends = np.arange(late, target.points)
    first, second = np.meshgrid(ends, ends)
    rows = np.concatenate(
        [np.unique(target.pair(first.ravel(), second.ravel())), np.arange(target.pair_count, target.size)]
    )
    derivative[rows, source.pair_count :] *= -1.0
    printed = replace(assembly, derivative=derivative.tocsr())
    return {str(epsilon): {"refuted": refuted(synthesis.program(printed, epsilon))} for epsilon in (0.0, 1e-3)}


def refuted(task: Program) -> bool:
    """Whether one equality alone, whose matrices are all of one sign, proves that no point meets it (Farkas)."""
    multipliers = np.diag(np.sign(task.b))[task.b != 0.0]
    return any(task.least_trace(multiplier) > ENDLESS for multiplier in multipliers)


def closed_loop(plant: Json, level: float, degree: int, epsilon: float, orders: list[int]) -> Json:
    """A certificate at `level`, its Galerkin check, and the H∞ norm of the error system at two collocation orders."""
    system = delay_system(**plant)
    optimum = _optimum(system)
    certificate = certificate_at(system, level * optimum, degree, epsilon=epsilon)
    gains = observer_gains(certificate)
    verified = check(certificate)
    errors = [error_system(system, gains, order) for order in orders]
    return {
        "optimum": optimum,
        "level": certificate.gamma,
        "norms": [continuous_norm(*error).upper for error in errors],
        "orders": orders,
        "abscissa": spectral_abscissa(errors[-1]),
        "storage": verified.storage,
        "dissipation": verified.dissipation,
        "solver": certificate.solution.report.to_dict(),
    }


def _certificate(system: DelayPlant, level: float, degree: int, epsilon: float) -> Certificate:
    """A certificate at `level` times the optimum."""
    return certificate_at(system, level * _optimum(system), degree, epsilon=epsilon)


def lumped(plant: Json, level: float, degree: int, epsilon: float, states: list[int], reference: int) -> Json:
    """One closed loop by forward difference with N lumped states: H∞ norm against collocation, and the observer alone.

    alone: |z_e| over |z| along the rightmost motion of the plant, which is exact, by an observer with N lumped states.
    """
    system = delay_system(**plant)
    gains = observer_gains(_certificate(system, level, degree, epsilon))
    exact = continuous_norm(*error_system(system, gains, reference)).upper
    norms = [continuous_norm(*error_system(system, gains, count, Scheme.LUMPED)).upper for count in states]
    return {
        "states": states,
        "collocation": exact,
        "relative": [norm / exact - 1.0 for norm in norms],
        "alone": [_lumped_alone(system, gains, count) for count in states],
    }


def _lumped_alone(system: DelayPlant, gains: ObserverGains, count: int) -> float:
    """|z_e| over |z| along x(t) = v e^{rt}, r the rightmost root: an observer of `count` lumped states, exact plant."""
    net = grid(count, Scheme.LUMPED)
    values = evaluate(gains, net.points)
    lumped, model = assembled(system, values, net), assembled(system, _without(values), net)
    root = rightmost_roots(system, 1)[0]
    late = np.exp(-root * np.array(system.delays))
    matrix = system.a0 + sum(a * factor for a, factor in zip(system.a, late, strict=True))
    v = np.linalg.svd(root * np.eye(system.states) - matrix)[2][-1].conj()
    factors = [1.0, *np.exp(root * np.outer(system.delays, net.points[1:])).ravel()]
    motion = np.kron(factors, v)
    # The observer follows its lumped model, corrected by C(x̂ - x): r e = A_lumped e + (A_model - r) x.
    size = len(motion)
    error = np.linalg.solve(root * np.eye(size) - lumped.A, (model.A - root * np.eye(size)) @ motion)
    return float(np.linalg.norm(lumped.C @ error) / np.linalg.norm(model.C @ motion))


def _without(values: GainValues) -> GainValues:
    """All gains zero."""
    return replace(values, **{each.name: np.zeros_like(getattr(values, each.name)) for each in fields(values)})


def without_histories(plant: Json, level: float, degree: int, epsilon: float, order: int) -> Json:
    """The closed loop with e_i ≡ 0, as eq. (2) prints it, where only L_0 and L_4i act; and with all gains.

    norm: H∞ norm from w to z_e, None if the loop is unstable.
    """
    system, net = delay_system(**plant), grid(order, Scheme.CHEBYSHEV)
    certificate = _certificate(system, level, degree, epsilon)
    values = evaluate(observer_gains(certificate), net.points)
    dead = {name: np.zeros_like(getattr(values, name)) for name in ("l2", "l3", "l5", "l6", "l7")}
    printed, meant = assembled(system, replace(values, **dead), net), assembled(system, values, net)
    return {
        "norm": continuous_norm(*printed).upper if spectral_abscissa(printed) < 0.0 else None,
        "level": certificate.gamma,
        "all_gains": continuous_norm(*meant).upper,
    }


def no_gains(plant: Json, level: float, degree: int, epsilon: float, order: int) -> Json:
    """How far the rightmost root of the observer's error lies from that of the plant, with no gains and with all.

    gap, with_gains: |difference| over one plus the size of the plant's root, which solves the exact equation.
    """
    system, net = delay_system(**plant), grid(order, Scheme.CHEBYSHEV)
    values = evaluate(observer_gains(_certificate(system, level, degree, epsilon)), net.points)
    root = rightmost_roots(system, 1)[0]

    def gap(gains: GainValues) -> float:
        roots = np.linalg.eigvals(assembled(system, gains, net).A)
        return float(np.min(np.abs(roots[np.argmax(roots.real)] - [root, root.conjugate()])) / (1.0 + abs(root)))

    return {"gap": gap(_without(values)), "with_gains": gap(values)}


def fig_1(plant: Json, level: float, degree: int, epsilon: float, samples: int, lumps: int) -> Json:
    """Simulated gain for sinc disturbances: shape sin(πx)/(πx) or sin(x)/x, centre, horizon and channels scanned.

    The text leaves all four open. The trajectory kept for the figure is sinc(t - τ) on all channels over [0, 20τ].
    lumped: its gain with `lumps` lumped states in place of collocation.
    """
    system = delay_system(**plant)
    certificate = certificate_at(system, level, degree, epsilon=epsilon)
    gains = observer_gains(certificate)
    collocated, lumped = error_system(system, gains, 20), error_system(system, gains, lumps, Scheme.LUMPED)

    def run(
        unit: float, centre: float, horizon: float, channels: tuple[float, float], error: Stage = collocated
    ) -> Trajectory:
        times = np.linspace(0.0, horizon, samples)
        return simulate(error, times, np.outer(np.sinc((times - centre) / unit), channels), system.states)

    channels = (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)
    settings = product((1.0, float(np.pi)), (0.0, 1.0, 5.0, 10.0), (10.0, 20.0, 40.0), channels)
    simulation = run(1.0, 1.0, 20.0, (1.0, 1.0))
    return {
        "scan": [run(*setting).gain for setting in settings],
        "level": level,
        "t": simulation.times.tolist(),
        "w": simulation.disturbance[:, 0].tolist(),
        "e": simulation.state.T.tolist(),
        "gain": simulation.gain,
        "lumped": run(1.0, 1.0, 20.0, (1.0, 1.0), lumped).gain,
        "solver": certificate.solution.report.to_dict(),
    }


def one_disturbance(plant: Json, level: float, degree: int) -> Json:
    """A certificate at a small level when one disturbance acts on all states alike."""
    changed = {**plant, "b": [[1.0] for _ in plant["a0"]]}
    certificate = certificate_at(delay_system(**changed), level, degree, epsilon=0.0)
    return {"level": level, "solver": certificate.solution.report.to_dict()}


@one_process()
def against_delay(plant: Json, delays: list[float], degree: int) -> Json:
    """Least γ of Theorem 3 and by collocation as the (single) delay varies."""
    sos, chebyshev = [], []
    for delay in delays:
        system = delay_system(**{**plant, "delays": [delay]})
        sos.append(minimum_gain(system, degree, options=SdpaOptions(gap=1e-4)).gamma)
        chebyshev.append(_optimum(system))
    return {"tau": delays, "sos": sos, "chebyshev": chebyshev}


def convergence(plant: Json, orders: list[int]) -> Json:
    """Least γ of the Padé and of the collocated model against their order, by Riccati."""
    system = delay_system(**plant)
    return {
        "orders": orders,
        "pade": [riccati_gain(pade_model(system, order)) for order in orders],
        "chebyshev": [riccati_gain(chebyshev_model(system, order)) for order in orders],
    }


# A late sensor on the common plant. The paper has no delay in the output and no sensor noise: here the sensor is a fast
# lag behind the delay, ours, so that y is a state and its noise acts on it, as the theorem wants.


LATE = (
    "late, in continuous time: by m − 1 base periods; added states model noise and delay of the output, which the "
    "paper's plants lack"
)
LAG = 0.25
"""Time constant of the sensor in base periods."""


@one_process()
def on_common_plant(plant: dict[str, Any], multiples: list[int], degree: int) -> list[list[float]]:
    """Bracket of the least gain from force and noise to the position's error, for each delay (m - 1) h."""
    A, B, C, h = (np.array(plant[name]) for name in ("A", "B", "C", "h"))
    n, lag = len(A), LAG * float(h)
    a0 = np.block([[A, np.zeros((n, 1))], [np.zeros((1, n)), np.array([[-1 / lag]])]])
    coupling = np.block([[np.zeros((n, n + 1))], [C / lag, np.zeros((1, 1))]])
    b = np.block([[B, np.zeros((n, 1))], [np.zeros((1, 1)), np.array([[plant["noise"] / lag]])]])
    c1, c2 = np.hstack([C, [[0.0]]]), np.hstack([np.zeros((1, n)), [[1.0]]])
    levels = []
    for m in multiples:
        if m == 1:
            level = riccati_gain(without_noise(a0 + coupling, b, c1, c2))
            levels.append([level, level])
        else:
            least = minimum_gain(delay_system(a0, [coupling], [(m - 1) * float(h)], b, c1, c2), degree)
            levels.append([least.lower, least.gamma])
    return levels


def pade_level(plant: dict[str, Any], order: int, claim: str) -> dict[str, Any]:
    """The Riccati gain of the Padé model of `plant`; moved are A_0, A_i and the delays."""
    delays = {f"tau_{i + 1}": f"{tau:g}" for i, tau in enumerate(plant["delays"])}
    blocks = {
        f"A_{i}": layout(tuple(map(tuple, block)), "{:g}".format) for i, block in enumerate([plant["a0"], *plant["a"]])
    }

    def compute(numbers: Parameters) -> dict[str, float]:
        a0, *delayed = (numbers[name] for name in blocks)
        taus = [numbers[name] for name in delays]
        moved = delay_system(a0, delayed, taus, plant["b"], plant["c10"], plant["c2"])
        return {claim: float(riccati_gain(pade_model(moved, order)))}

    return spread({**blocks, **delays}, compute)

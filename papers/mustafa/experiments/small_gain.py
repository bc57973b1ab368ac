"""The small-gain argument: its identities on random plants, and condition (8) evaluated directly.

The identities are Lemmas 2 and 3, the map below (7), the congruence behind (10) and eq. (11). With (8) come the ends of
(9) by quadrature, and the filter of the corrected algorithm's grid.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from papers.mustafa import method
from papers.mustafa.experiments.levels import Json, Matrices, crossing, problem
from papers.mustafa.method import delta_block
from replication.estimation.linear.norms import hinf_norm
from replication.estimation.nonuniform.filters import Filter, periodic_gain, riccati_filter
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import design_for_periods
from replication.estimation.nonuniform.worst_case import worst_case_gain
from replication.estimation.validation import Array

MISPRINTED = ("map as printed", "(12) as printed")


def random_case(rng: np.random.Generator, n: int, m: int, r: int, s: int) -> tuple[SampledPlant, Filter]:
    """A stable plant and a stable filter with the given sizes."""
    A = rng.standard_normal((n, n))
    A -= (float(np.max(np.linalg.eigvals(A).real)) + 0.3) * np.eye(n)
    shapes = ((n, m), (r, n), (r, m), (s, n))
    B, C, D, L = (rng.standard_normal(shape) for shape in shapes)
    A_f = rng.standard_normal((n, n))
    A_f *= 0.8 / np.max(np.abs(np.linalg.eigvals(A_f)))
    return SampledPlant(A, B, C, D, L), Filter(A_f, rng.standard_normal((n, r)), rng.standard_normal((s, n)))


def identities(trials: int, seed: int) -> dict[str, Any]:
    """Largest relative residuals over `trials` random cases with n = m = s = r = 2, so that the misprinted maps have
    a value; of these the least."""
    rng = np.random.default_rng(seed)
    residuals = [_residuals(rng) for _ in range(trials)]
    return {name: (min if name in MISPRINTED else max)(case[name] for case in residuals) for name in residuals[0]}


def _residuals(rng: np.random.Generator) -> dict[str, float]:
    plant, filter_ = random_case(rng, 2, 2, 2, 2)
    h, theta = rng.uniform(0.2, 0.6), rng.uniform(-0.15, 0.3)
    mu, (Phi, Gamma) = np.linalg.eigvalsh((plant.A + plant.A.T) / 2)[-1], plant.discretise(h)
    Delta, grown, moved = delta_block(plant, theta), plant.A @ Gamma + plant.B, np.hstack(plant.discretise(h + theta))
    return {
        "lemma 2": _relative(np.hstack([Phi + Delta @ plant.A @ Phi, Gamma + Delta @ grown]), moved),
        **_maps(plant, filter_, h, theta),
        **_theorem_3(rng, plant, filter_, h),
        "lemma 3": float(np.linalg.norm(Phi, 2) / np.exp(mu * h) - 1),
    }


def _relative(got: Array, want: Array) -> float:
    return float(np.linalg.norm(got - want) / np.linalg.norm(want))


def _maps(plant: SampledPlant, filter_: Filter, h: float, theta: float) -> dict[str, float]:
    """Residuals at z = 1.1 of the map as printed, of the linear fractional map in the right order, and of (12).

    And of Sigma_11 of (7) against A Phi (zI - Phi)^-1, which holds no filter.
    """
    n, nf, z = plant.order, len(filter_.A), 1.1
    Phi, Gamma = plant.discretise(h)
    A, B = filter_.error_step(plant, Phi, Gamma)
    C = filter_.error_output(plant)
    B1, C1 = np.eye(n + nf, n), np.hstack([plant.A @ Phi, np.zeros((n, nf))])
    resolvent = np.linalg.inv(z * np.eye(n + nf) - A)
    S11, S12 = C1 @ resolvent @ B1, plant.A @ Gamma + plant.B + C1 @ resolvent @ B
    S21, S22 = C @ resolvent @ B1, C @ resolvent @ B
    Delta, identity = delta_block(plant, theta), np.eye(n)
    A_h, B_h = filter_.error_step(plant, *plant.discretise(h + theta))
    truth = C @ np.linalg.solve(z * np.eye(n + nf) - A_h, B_h)
    reordered = S22 + S21 @ Delta @ np.linalg.solve(identity - S11 @ Delta, S12)
    inner = identity - S11 @ Delta
    printed = np.linalg.solve(S22 + S12 @ Delta @ inner, S21)
    twelve = S22 + S12 @ Delta @ np.linalg.solve(inner, S21)
    return {
        "map as printed": _relative(printed, truth),
        "map reordered": _relative(reordered, truth),
        "(12) as printed": _relative(twelve, truth),
        "sigma 11": _relative(S11, plant.A @ Phi @ np.linalg.inv(z * np.eye(n) - Phi)),
    }


def _transfer(filter_: Filter, z: float) -> Array:
    """C_f (zI - A_f)^-1 B_f."""
    return np.asarray(filter_.C @ np.linalg.solve(z * np.eye(len(filter_.A)) - filter_.A, filter_.B))


def _theorem_3(rng: np.random.Generator, plant: SampledPlant, filter_: Filter, h: float) -> dict[str, float]:
    """Residuals of J' (6) J = (10) for a random P-bar, and of the filter by (11) against the one that went in."""
    from replication.estimation.nonuniform.robust import LmiVariables, lmi10  # slow to load

    n, m, s, delta = plant.order, plant.B.shape[1], len(plant.L), 1.7
    root = rng.standard_normal((2 * n, 2 * n))
    P = root @ root.T + np.eye(2 * n)
    inverse = np.linalg.inv(P)
    X, U, Y, V = P[:n, :n], P[:n, n:], np.asarray(inverse[:n, :n]), inverse[:n, n:]
    A, B = filter_.error_step(plant, *plant.discretise(h))
    C = filter_.error_output(plant)
    corner = np.block([[A @ P, B], [C @ P, np.zeros((s, m))]])
    six = np.block([[-block_diag(P, np.eye(s)), corner], [corner.T, -block_diag(P, delta * np.eye(m))]])
    Z = np.asarray(np.linalg.inv(X))
    J1 = np.block([[Z, Y], [np.zeros((n, n)), V.T]])
    J = block_diag(J1, np.eye(s), J1, np.eye(m))
    v = LmiVariables(Z, Y, V @ filter_.B, filter_.C @ U.T @ Z, V @ filter_.A @ U.T @ Z, np.array(delta))
    shrink = np.linalg.inv(np.eye(n) - np.linalg.solve(Y, Z))
    recovered = Filter(-np.linalg.solve(Y, v.Q) @ shrink, np.asarray(-np.linalg.solve(Y, v.F)), v.G @ shrink)
    return {
        "congruence": _relative(J.T @ six @ J, lmi10(plant, *plant.discretise(h), v)),
        "recovery": _relative(_transfer(recovered, 1.1), _transfer(filter_, 1.1)),
    }


LeftSide = Callable[[float, float], float]
"""The left side of (8) for an element h_0, at a period."""


def condition(plant: Matrices, periods: list[float], nodes: int, centres: int) -> Json:
    """The left side of (8) with the middle of the range for h_0, largest over `nodes` periods of the range.

    constant: for each change held constant, in the coordinates of the plant. modal: for every sequence of changes, in
    modal coordinates; no coordinates have less for constant changes. Each with a bound between the nodes.
    best: the least value of modal over `centres` other h_0. elements: of a grid whose elements cover what
    (8) covers, for constant changes; modal_elements: for every sequence, in modal coordinates. ends: those of (9), with
    what their proof bounds there.
    """
    system, span = problem(plant, periods)
    h, h_0, half = span.nodes(nodes), span.middle, (span.h_u - span.h_l) / (nodes - 1) / 2
    constant = [_left_side(system, h_0, float(t)) for t in h]
    # d/dh Delta = e^{theta A}, so (8) grows by at most alpha |e^{theta A}| <= alpha e^{mu(-A)|theta|} a second.
    steepest = np.exp(
        max(method.logarithmic_norm(system.A), method.logarithmic_norm(-system.A)) * (span.h_u - span.h_l) / 2
    )
    rates = np.linalg.eigvals(system.A)
    modal = _modal(rates, np.array([h_0]), h)[0]
    steep = np.abs(rates) * np.exp(rates.real * span.h_l) / (1 - np.exp(rates.real * h_0))
    return {
        "constant": max(constant),
        "constant_at": float(h[int(np.argmax(constant))]),
        "constant_bound": max(constant) + method.small_gain_alpha(system, h_0) * float(steepest) * half,
        "modal": float(np.max(modal)),
        "modal_bound": float(np.max(modal) + np.max(steep) * half),
        "best": float(np.min(np.max(_modal(rates, span.nodes(centres), h), axis=1))),
        "elements": _elements(partial(_left_side, system), span),
        "modal_elements": _elements(lambda h_0, t: float(_modal(rates, np.array([h_0]), np.array([t]))[0, 0]), span),
        "ends": _ends(system, h_0),
    }


def _left_side(plant: SampledPlant, h_0: float, h: float) -> float:
    """||Sigma_11 Delta(h - h_0)||_inf for a change that is held constant."""
    return hinf_norm(*method.uncertainty_channel(plant, h_0, method.delta_block(plant, h - h_0))).value


def _modal(rates: Any, centres: Any, h: Any) -> Any:
    """max_i |e^{a_i h} - e^{a_i h_0}| / (1 - |e^{a_i h_0}|) over eigenvalues a_i of A, of shape (centres, periods).

    In modal coordinates Sigma_11 and Delta are diagonal, so the gain of their product is that of its largest entry.
    """
    start, stop = np.exp(np.outer(centres, rates)), np.exp(np.outer(h, rates))
    return np.max(np.abs(stop[None] - start[:, None]) / (1 - np.abs(start[:, None])), axis=2)


def _elements(left_side: LeftSide, span: PeriodRange) -> int:
    """Elements of Algorithm 1 if each covers the periods around it at which the left side of (8) is below one."""
    return sum(map(len, method.passes(partial(_around, left_side, span), span)))


def _around(left_side: LeftSide, span: PeriodRange, h_0: float) -> method.Interval:
    """Where (8) holds around h_0, seen at 33 periods of each side; just beyond the range if on all of it."""
    beyond, of_h = 1e-9, partial(left_side, h_0)
    ends = (np.linspace(h_0, end, 33).tolist() for end in (span.h_l - beyond, span.h_u + beyond))
    return method.Interval(*(crossing(of_h, outward, 1.0) for outward in ends))


def _ends(plant: SampledPlant, h_0: float) -> Json:
    """For each end of (9): alpha times what Lemma 3 bounds |Delta| by there.

    The bound is the integral of e^{mu t} by quadrature; size: alpha |Delta| itself, from the matrix exponential.
    """
    from scipy.integrate import quad  # slow to load

    alpha, ends = method.small_gain_alpha(plant, h_0), {}
    for name, sign, reading in (
        ("lower", -1, method.UpperEnd.CORRECTED),
        ("upper, printed", 1, method.UpperEnd.PRINTED),
        ("upper, corrected", 1, method.UpperEnd.CORRECTED),
    ):
        interval = method.covered_interval(plant, h_0, alpha, reading)
        reach = h_0 - interval.lower if sign < 0 else interval.upper - h_0
        mu = method.logarithmic_norm(sign * plant.A)
        ends[name] = {
            "bound": alpha * float(quad(lambda t, mu=mu: np.exp(mu * t), 0.0, reach, epsabs=0.0, epsrel=1e-13)[0]),
            "size": alpha * float(np.linalg.norm(method.delta_block(plant, sign * reach), 2)),
        }
    return ends


def loosest(plant: Matrices, periods: list[float], level: float, leaves: int, **effort: Any) -> Json:
    """The gain over all sequences of the central filter at a level for the middle of the range: a bracket.

    effort: as in `worst_case_gain`.
    """
    system, span = problem(plant, periods)
    design = riccati_filter(system, span.middle, level)
    assert design is not None
    bracket = worst_case_gain(system, design.filter, span, max_leaves=leaves, **effort)
    return {"lower": bracket.lower, "upper": bracket.upper}


def own_grid(plant: Matrices, periods: list[float], nodes: int, leaves: int, **effort: Any) -> Json:
    """The corrected algorithm: its grid, the level of step 2 on it, what its filter has at constant periods and over
    all sequences.

    largest: the gain at the worst of `nodes` constant periods. lower, upper: a bracket of the gain over all sequences.
    """
    system, span = problem(plant, periods)
    grid = list(method.build_grid(system, span).periods)
    design, again = design_for_periods(system, grid), method.printed_design(system, grid)
    gains = {h: periodic_gain(system, design.filter, [h]).value for h in (*grid, *span.nodes(nodes).tolist())}
    worst = max(span.nodes(nodes).tolist(), key=gains.__getitem__)
    bracket = worst_case_gain(system, design.filter, span, max_leaves=leaves, **effort)
    return {
        "periods": grid,
        "level": design.level,
        "level_again": again.level,
        "at_elements": max(gains[h] for h in grid),
        "largest": gains[worst],
        "largest_at": worst,
        "lower": bracket.lower,
        "upper": bracket.upper,
        "solvers": [design.report.to_dict(), again.report.to_dict()],
    }

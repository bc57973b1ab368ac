"""Identities of the text on random plants: Lemmas 2 and 3, the map below (7), the congruence behind (10), eq. (11)."""

from typing import Any

import numpy as np

from papers.mustafa.method import delta_block
from replication.estimation.linear.periodic import block_diagonal
from replication.estimation.nonuniform.filters import Filter
from replication.estimation.nonuniform.plant import SampledPlant
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
    six = np.block([[-block_diagonal([P, np.eye(s)]), corner], [corner.T, -block_diagonal([P, delta * np.eye(m)])]])
    Z = np.asarray(np.linalg.inv(X))
    J1 = np.block([[Z, Y], [np.zeros((n, n)), V.T]])
    J = block_diagonal([J1, np.eye(s), J1, np.eye(m)])
    v = LmiVariables(Z, Y, V @ filter_.B, filter_.C @ U.T @ Z, V @ filter_.A @ U.T @ Z, np.array(delta))
    shrink = np.linalg.inv(np.eye(n) - np.linalg.solve(Y, Z))
    recovered = Filter(-np.linalg.solve(Y, v.Q) @ shrink, np.asarray(-np.linalg.solve(Y, v.F)), v.G @ shrink)
    return {
        "congruence": _relative(J.T @ six @ J, lmi10(plant, *plant.discretise(h), v)),
        "recovery": _relative(_transfer(recovered, 1.1), _transfer(filter_, 1.1)),
    }

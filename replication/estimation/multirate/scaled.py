"""A multi-rate problem in other state coordinates, e(k) = T_k s(k), whitened and stacked over the phases.

Designs depend on the units of the states only by rounding; in coordinates where the error covariance is about the
identity at every phase that rounding is harmless, whatever the units of the plant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.estimation.linear.riccati import RiccatiMap
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array


@dataclass(frozen=True, eq=False)
class ScaledProblem:
    """T (N, n, n); A (N, n, n), B (N, n, m) and W (N, n_z, n) in coordinates s; C: per phase the whitened rows (r, n).

    Whitening: with the triangular `roots` R_k, D_k D_k' = R_k' R_k, the rows are R_k'^-1 C_k T_k, their noise is white
    with unit intensity, and their gain is R_k'-fold that of the measurements.

    Of correlated noise, what the measurements tell is taken out of the plant first: A and B are those of the rest, and
    `injected` (n, r) are the gains of the measurements that do it.
    """

    T: Array
    A: Array
    B: Array
    W: Array
    C: tuple[Array, ...]
    roots: tuple[Array, ...]
    rows: tuple[tuple[int, ...], ...]
    sensors: int
    information: Array
    injected: tuple[Array, ...]

    def maps(self, level: float = np.inf, *, extra_noise: float = 0.0) -> RiccatiMap:
        """Riccati maps of the filter at `level`: G_k = C_k'(D_k D_k')^-1 C_k - W'W/level^2, H = B_d B_d' + extra I.

        At an infinite level they are those of the Kalman filter. extra_noise is in the coordinates e, before scaling.
        """
        W = self.W / level
        G = self.information - W.mT @ W
        H = self.B @ self.B.mT
        if extra_noise:
            inverse = np.linalg.inv(np.roll(self.T, -1, axis=0))
            H = H + extra_noise * inverse @ inverse.mT
        return RiccatiMap(self.A, G, H)

    def corrected(self, states: Array, maps: RiccatiMap) -> Array:
        """(I + X_k G_k)^-1 X_k for each phase, shape (N, n, n)."""
        return np.asarray(np.linalg.solve(np.eye(self.A.shape[-1]) + states @ maps.G, states))

    def closed_loop(self, corrected: Array) -> Array:
        """A_k - L_k C_k for each phase, shape (N, n, n), all gains included."""
        return np.asarray(self.A - self.A @ corrected @ self.information)

    def whitened_gains(self, corrected: Array) -> list[Array]:
        """Gains on the whitened rows, A_k (I + X_k G_k)^-1 X_k C_k', each of shape (n, r)."""
        return [A @ F @ C.T for A, F, C in zip(self.A, corrected, self.C, strict=True)]

    def gains(self, corrected: Array) -> Array:
        """Gains L_k in the coordinates of the plant (N, n, q), zero for sensors that are not measured."""
        gains = np.zeros((len(self.A), self.A.shape[-1], self.sensors))
        for k, gain in enumerate(self.whitened_gains(corrected)):
            following = self.T[(k + 1) % len(self.T)]
            gains[k][:, self.rows[k]] = following @ np.linalg.solve(self.roots[k], gain.T).T + self.injected[k]
        return gains

    def unscaled(self, states: Array) -> Array:
        """T_k X_k T_k' for each phase, shape (N, n, n)."""
        return np.asarray(self.T @ states @ self.T.mT)


def scaled_problem(problem: MultirateProblem, T: Array) -> ScaledProblem:
    """`problem` in the coordinates s(k) = T_k^-1 e(k); T of shape (N, n, n)."""
    plant, rows = problem.plant, [tuple(r) for r in problem.measured_rows()]
    following = np.roll(T, -1, axis=0)
    # The triangular factor of D_k' avoids forming D_k D_k', which would square its condition number.
    distinct = dict.fromkeys(rows)
    roots: dict[tuple[int, ...], Array] = {r: np.asarray(np.linalg.qr(plant.D[list(r)].T, mode="r")) for r in distinct}
    whitened = {r: np.linalg.solve(roots[r].T, plant.C[list(r)]) for r in roots}
    C = tuple(whitened[r] @ T_k for r, T_k in zip(rows, T, strict=True))
    rest = {r: _decorrelated(plant, list(r)) for r in roots}
    A, B = np.stack([rest[r][0] for r in rows]), np.stack([rest[r][1] for r in rows])
    return ScaledProblem(
        T=T,
        A=np.asarray(np.linalg.solve(following, A @ T), dtype=float),
        B=np.asarray(np.linalg.solve(following, B), dtype=float),
        W=plant.W @ T,
        C=C,
        roots=tuple(roots[r] for r in rows),
        rows=tuple(rows),
        sensors=plant.sensors,
        information=np.stack([C_k.T @ C_k for C_k in C]),
        injected=tuple(rest[r][2] for r in rows),
    )


def _decorrelated(plant: MultiratePlant, rows: list[int]) -> tuple[Array, Array, Array]:
    """A and B of what the sensors `rows` do not tell of the noise, and the gains J (n, r) of what they tell.

    J = B_w D_r'(D_r D_r')^-1, A - J C_r, [B_d, B_w - J D_r].
    """
    if not plant.correlated:
        return plant.A, plant.B_d, np.zeros((plant.order, len(rows)))
    factor = np.linalg.qr(plant.D[rows].T)
    J = np.linalg.solve(factor.R, (plant.B_w @ factor.Q).T).T
    return plant.A - J @ plant.C[rows], np.hstack([plant.B_d, plant.B_w - J @ plant.D[rows]]), J

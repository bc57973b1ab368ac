"""Theorems 1 and 2 of the multi-rate paper: their conditions suffice, for plants, signals and periods of any size.

Matrices are letters, so that the identities hold for all sizes; the two weights on the noises stand for gamma^2 I.
"""

from __future__ import annotations

from replication.verify.algebra.symbolic import Symbolic, blocks, letters
from replication.verify.kernel import Identity, decide
from replication.verify.statement import statement

NAMES = ("A", "L", "S", "C", "D", "B_d", "W", "P", "Q", "G_d", "G_w", "e", "d", "w")
SYMMETRIC = ("P", "Q", "G_d", "G_w")


@statement("multirate.theorem-1", source="okajima2023", holds=True, says="Theorem 1")
def theorem_1() -> None:
    """If P_k > 0 of period N make the matrix (20) positive definite at each instant, A_e is Schur and the l2 gain of
    the error system is below gamma, for every N and all sizes.

    The form (20) is the loss in (25), with Q for P_{k-1}. Without noise it says V_{k+1} < V_k for e != 0; as N instants
    have one factor below one, A_e is Schur. One eps > 0 serves all N instants, V_0 = 0 and V_{K+1} >= 0, so that the
    sum of (25) from 0 to K gives sum z'z <= (gamma^2 - eps) sum d_*'d_*.
    """
    _require_loss()


def _require_loss() -> None:
    """The form (20) is the loss in (25)."""
    m, closed, theta = _conditions()
    e, d, w, P, before, W = (m[name] for name in ("e", "d", "w", "P", "Q", "W"))
    xi, following = blocks([[e], [d], [w]]), blocks([closed]) @ blocks([[e], [d], [w]])
    supply = d.T @ m["G_d"] @ d + w.T @ m["G_w"] @ w - (W @ e).T @ (W @ e)
    decide(Identity(xi.T @ theta @ xi, e.T @ before @ e - following.T @ P @ following + supply, "eq. (25)"))


@statement("multirate.theorem-2", source="okajima2023", holds=True, says="Theorem 2")
def theorem_2() -> None:
    """If P_k > 0 and Y_k of period N make the matrix (30) positive definite at each instant, the gains P_k^-1 Y_k make
    A_e Schur and the l2 gain of the error system smaller than gamma, for every N and all sizes.

    With Y = P L the first row of (30) is P F, F = [A_e, B_d, -L S D], so that its Schur complement is the rest less
    F'P F, which is (20): Theorem 1 follows.
    """
    m, closed, theta = _conditions()
    A, L, S, C, D, B_d, W, P, before = (m[name] for name in ("A", "L", "S", "C", "D", "B_d", "W", "P", "Q"))
    Y, F, none = P @ L, blocks([closed]), W * 0
    decide(Identity(blocks([[P @ A - Y @ S @ C, P @ B_d, -(Y @ S @ D)]]), P @ F, "the first row of (30)"))
    rest = blocks([[before - W.T @ W, none, none], [none, m["G_d"], none], [none, none, m["G_w"]]])
    decide(Identity(rest - F.T @ P @ F, theta, "the Schur complement in (30)"))
    _require_loss()


def _conditions() -> tuple[dict[str, Symbolic], list[Symbolic], Symbolic]:
    """The letters, the blocks of F, and the matrix (20), block by block as printed."""
    m = dict(zip(NAMES, letters(*NAMES, symmetric=SYMMETRIC), strict=True))
    A, L, S, C, D, B_d, W, P, before = (m[name] for name in ("A", "L", "S", "C", "D", "B_d", "W", "P", "Q"))
    A_e, M = A - L @ S @ C, L @ S @ D
    theta = blocks(
        [
            [before - A_e.T @ P @ A_e - W.T @ W, -(A_e.T @ P @ B_d), A_e.T @ P @ M],
            [-(B_d.T @ P @ A_e), m["G_d"] - B_d.T @ P @ B_d, B_d.T @ P @ M],
            [M.T @ P @ A_e, M.T @ P @ B_d, m["G_w"] - M.T @ P @ M],
        ]
    )
    return m, [A_e, B_d, -M], theta

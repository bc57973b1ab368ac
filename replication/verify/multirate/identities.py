"""Identities of the multi-rate paper, and that the conditions of its Theorems 1 and 2 suffice.

Matrices are letters, so that the identities hold for plants, signals and periods of any size; the two weights on the
noises stand for gamma^2 I.
"""

from replication.verify.algebra.symbolic import Symbolic, blocks, letters
from replication.verify.kernel import Identity, decide
from replication.verify.reading import integer, sized
from replication.verify.statement import statement
from replication.verify.theorem import Found

SIZES = dict.fromkeys(("states", "sensors", "disturbances", "inputs"), sized(integer, 1))
NAMES = ("A", "L", "S", "C", "D", "B_d", "W", "P", "Q", "G_d", "G_w", "e", "d", "w")
SYMMETRIC = ("P", "Q", "G_d", "G_w")


@statement("multirate.error-system", source="okajima2023", parameters=SIZES, holds=True, says="error system (16)")
def error_system(**sizes: int) -> Found:
    """The error of the observer (15) obeys eq. (16) for all entries of all matrices ({sizes})."""
    A, B_u, B_d, C, D, L, S, x, o, u, d, w = letters("A", "B_u", "B_d", "C", "D", "L", "S", *"xoudw")
    plant, measured = A @ x + B_u @ u + B_d @ d, S @ C @ x + S @ D @ w
    observer = A @ o + B_u @ u + L @ (measured - S @ C @ o)
    expected = (A - L @ S @ C) @ (x - o) + B_d @ d - L @ S @ D @ w
    decide(Identity(plant - observer, expected, "eq. (16)"))
    return _counted(sizes)


@statement("multirate.dissipation", source="okajima2023", parameters=SIZES, holds=True, says="identity (23)")
def dissipation(**sizes: int) -> Found:
    """The quadratic form of the matrix (20) is the left-hand side of eq. (23) ({sizes})."""
    _require_loss()
    return _counted(sizes)


@statement("multirate.schur", source="okajima2023", parameters=SIZES, holds=True, says="Schur complement (32)")
def schur(**sizes: int) -> Found:
    """With Y = P L, the Schur complement of P in the matrix (30) is the matrix (20) ({sizes}).

    The blocks beside P are P F with F = [A_e, B_d, -L S D], so that the complement is the rest less F'P F.
    """
    _require_complement()
    return _counted(sizes)


def _counted(sizes: dict[str, int]) -> Found:
    """The sizes in words."""
    phrases = (f"{size} {name if size > 1 else name.removesuffix('s')}" for name, size in sizes.items())
    return Found(words={"sizes": ", ".join(phrases)})


@statement("multirate.theorem-1", source="okajima2023", holds=True, says="Theorem 1")
def theorem_1() -> None:
    """If P_k > 0 of period N make the matrix (20) positive definite at each instant, A_e is Schur and the l2 gain of
    the error system is below gamma, for every N and all sizes.

    The form (20) is the loss in (25), with Q for P_{k-1}. Without noise it says V_{k+1} < V_k for e != 0; as N instants
    have one factor below one, A_e is Schur. One eps > 0 serves all N instants, V_0 = 0 and V_{K+1} >= 0, so that the
    sum of (25) from 0 to K gives sum z'z <= (gamma^2 - eps) sum d_*'d_*.
    """
    _require_loss()


@statement("multirate.theorem-2", source="okajima2023", holds=True, says="Theorem 2")
def theorem_2() -> None:
    """If P_k > 0 and Y_k of period N make the matrix (30) positive definite at each instant, the gains P_k^-1 Y_k make
    A_e Schur and the l2 gain of the error system smaller than gamma, for every N and all sizes.

    With Y = P L the first row of (30) is P F, F = [A_e, B_d, -L S D], so that its Schur complement is the rest less
    F'P F, which is (20): Theorem 1 follows.
    """
    _require_complement()
    _require_loss()


def _require_loss() -> None:
    """The form (20) is the loss in (25), and so the left-hand side of (23)."""
    m, closed, theta = _conditions()
    e, d, w, P, before, W = (m[name] for name in ("e", "d", "w", "P", "Q", "W"))
    xi, following = blocks([[e], [d], [w]]), blocks([closed]) @ blocks([[e], [d], [w]])
    supply = d.T @ m["G_d"] @ d + w.T @ m["G_w"] @ w - (W @ e).T @ (W @ e)
    decide(Identity(xi.T @ theta @ xi, e.T @ before @ e - following.T @ P @ following + supply, "eq. (25)"))


def _require_complement() -> None:
    """The Schur complement of P in (30) is (20)."""
    m, closed, theta = _conditions()
    A, L, S, C, D, B_d, W, P, before = (m[name] for name in ("A", "L", "S", "C", "D", "B_d", "W", "P", "Q"))
    Y, F, none = P @ L, blocks([closed]), W * 0
    decide(Identity(blocks([[P @ A - Y @ S @ C, P @ B_d, -(Y @ S @ D)]]), P @ F, "the first row of (30)"))
    rest = blocks([[before - W.T @ W, none, none], [none, m["G_d"], none], [none, none, m["G_w"]]])
    decide(Identity(rest - F.T @ P @ F, theta, "the Schur complement in (30)"))


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

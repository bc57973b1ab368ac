"""Identities of the multi-rate paper, checked with a symbol for each entry of each matrix, at the size asked for."""

from __future__ import annotations

from replication.verify.algebra.symbolic import Symbolic, blocks, letters, symbols, unit
from replication.verify.kernel import Identity, decide
from replication.verify.reading import integer, sized
from replication.verify.statement import statement
from replication.verify.theorem import Found, require

LARGEST_SIZE = 6
"""Of a vector, and so of a matrix: the polynomials grow with its fourth power."""
SIZES = dict.fromkeys(("states", "sensors", "disturbances", "inputs"), sized(integer, 1))


@statement("multirate.error-system", source="okajima2023", parameters=SIZES, holds=True, says="error system (16)")
def error_system(states: int, sensors: int, disturbances: int, inputs: int) -> Found:
    """The error of the observer (15) obeys eq. (16) for all entries of all matrices ({sizes})."""
    n, q, m, p = _limited(states, sensors, disturbances, inputs)
    shapes = {
        "A": (n, n), "B_u": (n, p), "B_d": (n, m), "C": (q, n), "D": (q, q), "L": (n, q), "S": (q, q),
        "x": (n, 1), "o": (n, 1), "u": (p, 1), "d": (m, 1), "w": (q, 1),
    }  # fmt: skip
    A, B_u, B_d, C, D, L, S, x, o, u, d, w = symbols(shapes, diagonal=("S",)).values()
    plant, measured = A @ x + B_u @ u + B_d @ d, S @ C @ x + S @ D @ w
    observer = A @ o + B_u @ u + L @ (measured - S @ C @ o)
    wanted = (A - L @ S @ C) @ (x - o) + B_d @ d - L @ S @ D @ w
    decide(Identity(plant - observer, wanted, "eq. (16)"))
    return _counted(states, sensors, disturbances, inputs)


@statement("multirate.dissipation", source="okajima2023", parameters=SIZES, holds=True, says="identity (23)")
def dissipation(states: int, sensors: int, disturbances: int, inputs: int) -> Found:
    """The quadratic form of the matrix (20) is the left-hand side of eq. (23) ({sizes})."""
    m, closed, level = _closed_loop(*_limited(states, sensors, disturbances, inputs))
    P, before, e, d, w = (m[name] for name in ("P", "Q", "e", "d", "w"))
    xi, noise, z = blocks([[e], [d], [w]]), blocks([[d], [w]]), m["W"] @ e
    following = blocks([closed]) @ xi
    loss = e.T @ before @ e + noise.T @ level @ noise - following.T @ P @ following - z.T @ z
    decide(Identity(xi.T @ _theta(m, closed) @ xi, loss, "eq. (23)"))
    return _counted(states, sensors, disturbances, inputs)


@statement("multirate.schur", source="okajima2023", parameters=SIZES, holds=True, says="Schur complement (32)")
def schur(states: int, sensors: int, disturbances: int, inputs: int) -> Found:
    """With Y = P L, the Schur complement of P in the matrix (30) is the matrix (20) ({sizes}).

    The blocks beside P are P F with F = [A_e, B_d, -L S D], so that the complement is the rest less F'P F.
    """
    m, closed, level = _closed_loop(*_limited(states, sensors, disturbances, inputs))
    A, B_d, C, D, L, S, W, P, before = (m[name] for name in ("A", "B_d", "C", "D", "L", "S", *"WPQ"))
    Y, none, F = P @ L, blocks([closed[1:]]) * 0, blocks([closed])
    decide(Identity(blocks([[P @ A - Y @ S @ C, P @ B_d, -(Y @ S @ D)]]), P @ F, "the first row of (30)"))
    rest = blocks([[before - W.T @ W, none], [none.T, level]])
    decide(Identity(rest - F.T @ P @ F, _theta(m, closed), "the Schur complement in (30)"))
    return _counted(states, sensors, disturbances, inputs)


def _closed_loop(n: int, q: int, m: int, _: int) -> tuple[dict[str, Symbolic], list[Symbolic], Symbolic]:
    """All symbols of Theorems 1 and 2 at one phase (Q is P_(k-1)); A_e, B_d, -L S D; and gamma^2 I."""
    shapes = {
        "A": (n, n), "B_d": (n, m), "C": (q, n), "D": (q, q), "L": (n, q), "S": (q, q), "W": (n, n),
        "P": (n, n), "Q": (n, n), "e": (n, 1), "d": (m, 1), "w": (q, 1), "g2": (1, 1),
    }  # fmt: skip
    named = symbols(shapes, symmetric=("P", "Q"), diagonal=("S",))
    A, B_d, C, D, L, S, *_others = named.values()
    return named, [A - L @ S @ C, B_d, -(L @ S @ D)], unit(m + q, named["g2"].entry)


def _theta(m: dict[str, Symbolic], closed: list[Symbolic]) -> Symbolic:
    """The matrix (20), block by block as printed."""
    A_e, B_d, negative = closed
    P, before, W, M, g2 = m["P"], m["Q"], m["W"], -negative, m["g2"].entry
    d, w = len(B_d.T.rows), len(M.T.rows)
    return blocks(
        [
            [before - A_e.T @ P @ A_e - W.T @ W, -(A_e.T @ P @ B_d), A_e.T @ P @ M],
            [-(B_d.T @ P @ A_e), unit(d, g2) - B_d.T @ P @ B_d, B_d.T @ P @ M],
            [M.T @ P @ A_e, M.T @ P @ B_d, unit(w, g2) - M.T @ P @ M],
        ]
    )


def _counted(*sizes: int) -> Found:
    """The sizes in words."""
    told = (f"{size} {name if size > 1 else name.removesuffix('s')}" for size, name in zip(sizes, SIZES, strict=True))
    return Found(words={"sizes": ", ".join(told)})


def _limited(*sizes: int) -> tuple[int, ...]:
    require(max(sizes) <= LARGEST_SIZE, f"parameters: the largest size is {max(sizes)}, more than {LARGEST_SIZE}")
    return sizes


# Theorems 1 and 2 of the multi-rate paper: their conditions suffice, for plants, signals and periods of any size.
#
# Matrices are letters, so that the identities hold for all sizes; the two weights on the noises stand for gamma^2 I.


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

"""Lemmas 2 and 3, the map of eq. (7), the congruence behind (10) and the recovery (11), with a symbol for every entry.

Sizes: two states of plant and filter, one disturbance, measurement and estimate as in both examples, two components of
each signal where the order of factors matters.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq

from replication.verify.algebra.symbols import Matrix, add, product, require_equal, scale, symbols
from replication.verify.theorem import require

SIZE = "two states of plant and filter and one disturbance, measurement and estimate"
"""Of the identities below, but for those that hold for all sizes, and the map, with two components of each signal."""
SQUARE, COLUMN, ROW, ONE = (2, 2), (2, 1), (1, 2), (1, 1)


def require_lemma_2() -> None:
    """Phi and Gamma at h_0 + theta are those at h_0 with Delta(theta) in a loop, for every A.

    All factors are functions of A and commute, so one symbol stands for each: a for A, p for e^{h_0 A}, d and e for the
    integrals of e^{tA} from 0 to h_0 and to theta. Then e^{theta A} = 1 + a e, and with p it gives h_0 + theta; the
    integral to there is e + (1 + a e) d. Gamma = (integral) B, with b for B.
    """
    ((a, p, d, e, b),) = symbols(v=(1, 5))["v"]
    moved = 1 + a * e
    require(moved * p == p + e * a * p, "Phi(h_0 + theta) is not (I + Delta A) Phi(h_0)")
    require((e + moved * d) * b == d * b + e * (a * d * b + b), "Gamma(h_0 + theta) is not as in Lemma 2")


def require_lemma_3() -> None:
    """d|x|^2/dt = 2 x'Sx <= 2 mu |x|^2 along x' = Ax, S = (A + A')/2, for every A of order two.

    mu = (tr S + r)/2 with r = ((s_11 - s_22)^2 + 4 s_12^2)^(1/2) is the larger root of det(S - mu I). The matrix
    mu I - S has the trace r >= 0 and the determinant zero, so it is positive semidefinite.
    """
    s = symbols(A=SQUARE, x=COLUMN, r=ONE)
    A, x, ((r,),) = s["A"], s["x"], s["r"]
    S = scale(fmpq(1, 2), add(A, transposed(A)))
    twice = scale(2, product(transposed(x), S, x))
    require_equal(add(product(transposed(x), A, x), product(transposed(product(A, x)), x)), twice, "the rate of |x|^2")
    (s_11, s_12), (_, s_22) = S
    mu = (s_11 + s_22 + r) / 2
    require((mu - s_11) + (mu - s_22) == r, "the trace of mu I - S is not r")
    determinant = (mu - s_11) * (mu - s_22) - s_12 * s_12
    require(4 * determinant == r * r - ((s_11 - s_22) * (s_11 - s_22) + 4 * s_12 * s_12), "det(mu I - S) is not zero")


def require_map() -> None:
    """Sigma_22 + Sigma_21 Delta (I - Sigma_11 Delta)^{-1} Sigma_12 is the map from w to e at a constant Delta.

    With the state v, W = zI - A-bar(h_0) and its inverse R: eta = C_1 v + D w and xi = Delta eta close the loop (7).
    First, (W - B_1 Delta C_1) v = (B + B_1 Delta D) w: the loop is the error system at h_0 + theta. Then, with
    v = R (B_1 xi + B w), (I - Sigma_11 Delta) eta = Sigma_12 w and e = Sigma_21 Delta eta + Sigma_22 w.
    """
    names = ("W", "R", "B_1", "C_1", "Delta", "B", "C", "D")
    s = symbols(**dict.fromkeys(names, SQUARE), v=COLUMN, w=COLUMN, eta=COLUMN)
    W, R, B_1, C_1, Delta, B, C, D = (s[name] for name in names)
    v, w, eta = s["v"], s["w"], s["eta"]
    looped = product(Delta, add(product(C_1, v), product(D, w)))
    residual = add(product(W, v), minus(product(B_1, looped)), minus(product(B, w)))
    A_h, B_h = add(W, minus(product(B_1, Delta, C_1))), add(B, product(B_1, Delta, D))
    there = add(product(A_h, v), minus(product(B_h, w)))
    require_equal(residual, there, "the loop (7)")
    S_11, S_12 = product(C_1, R, B_1), add(D, product(C_1, R, B))
    S_21, S_22 = product(C, R, B_1), product(C, R, B)
    reached = product(R, add(product(B_1, Delta, eta), product(B, w)))
    left = add(eta, minus(product(C_1, reached)), minus(product(D, w)))
    require_equal(left, add(eta, minus(product(S_11, Delta, eta)), minus(product(S_12, w))), "the equation of eta")
    require_equal(product(C, reached), add(product(S_21, Delta, eta), product(S_22, w)), "the output e")


def require_congruence() -> None:
    """The blocks of (10) are those of (6) after the congruence with diag(J_1, I, J_1, I).

    P-bar = [X U; U' X^] and its inverse [Y V; V' Y^] give XY + UV' = I and U'Y + X^V' = 0, so with Z = X^{-1}:
    Y = Z (I - UV') = (I - VU')Z, and T = P-bar J_1 = [I I; U'Z 0] for J_1 = [Z Y; 0 V'].
    """
    s = symbols(
        Z=(1, 3), U=SQUARE, V=SQUARE, Phi=SQUARE, Gamma=COLUMN, A_f=SQUARE, B_f=COLUMN, C_f=ROW, C=ROW, D=ONE, L=ROW
    )
    ((z_11, z_12, z_22),) = s["Z"]
    U, V, Phi, Gamma, A_f, B_f, C_f, C, D, L = (
        s[name] for name in ("U", "V", "Phi", "Gamma", "A_f", "B_f", "C_f", "C", "D", "L")
    )
    Z = [[z_11, z_12], [z_12, z_22]]
    zero, one = scale(0, Z), constant_identity(Z)
    below = product(transposed(U), Z)
    Y = add(Z, minus(product(V, below)))
    F, G, Q = product(V, B_f), product(C_f, below), product(V, A_f, below)
    J_1, T = stacked([[Z, zero], [Y, V]]), stacked([[one, one], [below, zero]])
    A_bar = stacked([[Phi, zero], [product(B_f, C), A_f]])
    B_bar = stacked([[Gamma], [product(B_f, D)]])
    Y_Phi, F_C = product(Y, Phi), product(F, C)
    require_equal(product(J_1, T), stacked([[Z, Z], [Z, Y]]), "J_1'PJ_1 = [Z Z; Z Y]")
    moved = stacked([[product(Z, Phi), product(Z, Phi)], [add(Y_Phi, F_C, Q), add(Y_Phi, F_C)]])
    require_equal(product(J_1, A_bar, T), moved, "J_1'APJ_1 in (10)")
    driven = stacked([[product(Z, Gamma)], [add(product(Y, Gamma), product(F, D))]])
    require_equal(product(J_1, B_bar), driven, "J_1'B in (10)")
    seen = product(stacked([[L, minus(C_f)]]), T)
    require_equal(seen, stacked([[add(L, minus(G)), L]]), "CPJ_1 = [L - G, L]")


def require_recovery() -> None:
    """The filter by (11) from the unknowns of (10) is the one behind them, in other coordinates of its state.

    S = -Y^{-1}V is the change of coordinates and W = U'Z. With V = -YS and Z = Y + VW (the relation of the congruence),
    I - Y^{-1}Z = SW, so (11) reads A = S A_f W (SW)^{-1} = S A_f S^{-1}, B = S B_f, C = C_f W (SW)^{-1} = C_f S^{-1}.
    """
    s = symbols(Y=SQUARE, S=SQUARE, W=SQUARE, A_f=SQUARE, B_f=COLUMN)
    Y, S, W, A_f, B_f = (s[name] for name in ("Y", "S", "W", "A_f", "B_f"))
    V = minus(product(Y, S))
    Z = add(Y, product(V, W))
    require_equal(add(Y, minus(Z)), product(Y, S, W), "Y (I - Y^{-1}Z) = Y S W")
    require_equal(minus(product(V, A_f, W)), product(Y, S, A_f, W), "-Q = Y S A_f W")
    require_equal(minus(product(V, B_f)), product(Y, S, B_f), "-F = Y S B_f")


def require_sharp_ends() -> None:
    """f(theta) = alpha (e^{m theta} - 1)/m is one at theta = log(1 + m/alpha)/m, the distance of an end of (9).

    E = e^{m theta} has the rate m E, so f grows at the rate alpha + m f. The time log(1 + m f/alpha)/m has the rate
    1/(alpha + m f) in f. Both are zero at f = 0, so each is the inverse function of the other: f = 1 at the end.
    """
    ((alpha, m, E, f),) = symbols(v=(1, 4))["v"]
    m_f, inside = alpha * (E - 1), alpha + m * f
    require(m_f.derivative(2) * m * E == m * (alpha + m_f), "the bound of Lemma 3 does not grow at this rate")
    require(inside.derivative(3) == m, "the logarithm of (9) is not the time to reach a level at this rate")


def stacked(rows: Sequence[Sequence[Matrix]]) -> Matrix:
    """The matrix made of these blocks."""
    return [[entry for part in parts for entry in part] for row in rows for parts in zip(*row, strict=True)]


def constant_identity(like: Matrix) -> Matrix:
    """The identity of the size of a matrix, as polynomials in its symbols."""
    return [[entry * 0 + int(i == j) for j, entry in enumerate(row)] for i, row in enumerate(like)]


def transposed(M: Matrix) -> Matrix:
    """M'."""
    return [list(column) for column in zip(*M, strict=True)]


def minus(M: Matrix) -> Matrix:
    """-M."""
    return scale(-1, M)

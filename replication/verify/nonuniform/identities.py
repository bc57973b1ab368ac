"""Lemmas 2 and 3, the map of eq. (7), the congruence behind (10) and the recovery (11).

Matrices are letters, so that the identities hold for plants, filters and signals of all sizes; numbers are symbols.
"""

from flint import arb, fmpq, fmpq_mat

from replication.verify.algebra.symbolic import IDENTITY, blocks, letters, number
from replication.verify.kernel import decide, equal, identical
from replication.verify.nonuniform.system import Plant, on_plant
from replication.verify.predicate import Says
from replication.verify.statement import statement
from replication.verify.theorem import Found, require


@statement("nonuniform.lemma-2", source="mustafa", holds=True, says="Lemma 2")
def lemma_2() -> None:
    """Phi and Gamma at h_0 + theta are those at h_0 with Delta(theta) in a loop, for every A and B.

    All factors are functions of A and commute, so one symbol stands for each: a for A, p for e^{h_0 A}, d and e for the
    integrals of e^{tA} from 0 to h_0 and to theta. Then e^{theta A} = 1 + a e, and with p it gives h_0 + theta; the
    integral to there is e + (1 + a e) d. Gamma = (integral) B, with b for B.
    """
    a, p, d, e, b = map(number, "apdeb")
    moved = 1 + a * e
    decide(equal(moved * p, p + e * a * p, "Phi(h_0 + theta) is not (I + Delta A) Phi(h_0)"))
    decide(equal((e + moved * d) * b, d * b + e * (a * d * b + b), "Gamma(h_0 + theta) is not as in Lemma 2"))


def logarithmic_norm(A: fmpq_mat) -> arb:
    """mu(A), the larger eigenvalue of (A + A')/2, for A of order two."""
    require(A.nrows() == 2, "the logarithmic norm is written out for two states")
    S = (A + A.transpose()) / 2
    mean, half = (S[0, 0] + S[1, 1]) / 2, (S[0, 0] - S[1, 1]) / 2
    return arb(mean) + arb(half * half + S[0, 1] * S[0, 1]).sqrt()


@on_plant("nonuniform.lemma-3", holds=True, says=Says(quantity="Lemma 3", universal=True))
def lemma_3(plant: Plant) -> Found:
    """|e^(At)| <= e^(mu t) for all t >= 0 and every A; here mu(A) lies in {mu:ball 10}.

    d|x|^2/dt = 2 x'Sx along x' = Ax, S = (A + A')/2, which is at most 2 mu |x|^2, mu the largest eigenvalue of S.

    For A of order two mu = (tr S + r)/2 with r = ((s_11 - s_22)^2 + 4 s_12^2)^(1/2), the larger root of det(S - mu I):
    the matrix mu I - S has the trace r >= 0 and the determinant zero, so it is positive semidefinite.
    """
    A, x = letters("A", "x")
    decide(identical(x.T @ (A @ x) + (A @ x).T @ x, x.T @ ((A + A.T) * fmpq(1, 2)) @ x * 2, "the rate of |x|^2"))
    s_11, s_12, s_22, r = map(number, ("s_11", "s_12", "s_22", "r"))
    mu = (s_11 + s_22 + r) / 2
    decide(equal((mu - s_11) + (mu - s_22), r, "the trace of mu I - S is not r"))
    determinant = (mu - s_11) * (mu - s_22) - s_12 * s_12
    square = (s_11 - s_22) * (s_11 - s_22) + 4 * s_12 * s_12
    decide(equal(4 * determinant, r * r - square, "det(mu I - S) is not zero"))
    return Found(words={"mu": logarithmic_norm(plant.A)})


@on_plant("nonuniform.map", holds=True, says="map of the error system")
def loop_map(plant: Plant) -> Found:
    """For signals of any size w -> e at a constant Delta is Sigma_22 + Sigma_21 Delta (I - Sigma_11 Delta)^-1 Sigma_12.
    As printed, Sigma_12 ({n} x {m}) would be multiplied by Delta ({n} x {n}), and ({n} x {n}) by Sigma_21
    ({s} x {n}).

    With the state v, W = zI - A-bar(h_0) and its inverse R: eta = C_1 v + D w and xi = Delta eta close the loop (7).
    First, (W - B_1 Delta C_1) v = (B + B_1 Delta D) w: the loop is the error system at h_0 + theta. Then, with
    v = R (B_1 xi + B w), (I - Sigma_11 Delta) eta = Sigma_12 w and e = Sigma_21 Delta eta + Sigma_22 w.
    """
    W, R, B_1, C_1, Delta, B, C, D, v, w, eta = letters("W", "R", "B_1", "C_1", "Delta", "B", "C", "D", "v", "w", "eta")
    residual = W @ v - B_1 @ Delta @ (C_1 @ v + D @ w) - B @ w
    expected = (W - B_1 @ Delta @ C_1) @ v - (B + B_1 @ Delta @ D) @ w
    decide(identical(residual, expected, "the loop (7)"))
    S_11, S_12, S_21, S_22 = C_1 @ R @ B_1, D + C_1 @ R @ B, C @ R @ B_1, C @ R @ B
    reached = R @ (B_1 @ Delta @ eta + B @ w)
    decide(identical(eta - C_1 @ reached - D @ w, eta - S_11 @ Delta @ eta - S_12 @ w, "the equation of eta"))
    decide(identical(C @ reached, S_21 @ Delta @ eta + S_22 @ w, "the output e"))
    n, m, s = plant.A.nrows(), plant.B.ncols(), plant.L.nrows()
    require(m != n and s != n, "the printed order of the factors has a value here: m = n or s = n")
    return Found(words={"n": n, "m": m, "s": s})


@statement("nonuniform.congruence", source="mustafa", holds=True, says="congruence (10)")
def congruence() -> None:
    """(10) is the congruence of (6) by diag(J_1, I, J_1, I), block by block, for plants and signals of
    any size and filters of the plant's order.

    P-bar = [X U; U' X^] and its inverse [Y V; V' Y^] give XY + UV' = I and U'Y + X^V' = 0, so with Z = X^{-1}:
    Y = Z (I - UV') = (I - VU')Z, and T = P-bar J_1 = [I I; U'Z 0] for J_1 = [Z Y; 0 V'].
    """
    names = ("Z", "U", "V", "Phi", "A_f", "Gamma", "B_f", "C_f", "C", "D", "L")
    Z, U, V, Phi, A_f, Gamma, B_f, C_f, C, D, L = letters(*names, symmetric=("Z",))
    zero, same = Z * 0, IDENTITY
    below = U.T @ Z
    Y = Z - V @ below
    F, G, Q = V @ B_f, C_f @ below, V @ A_f @ below
    J_1, T = blocks([[Z, zero], [Y, V]]), blocks([[same, same], [below, zero]])
    A_bar = blocks([[Phi, zero], [B_f @ C, A_f]])
    B_bar = blocks([[Gamma], [B_f @ D]])
    decide(identical(J_1 @ T, blocks([[Z, Z], [Z, Y]]), "J_1'PJ_1 = [Z Z; Z Y]"))
    moved = blocks([[Z @ Phi, Z @ Phi], [Y @ Phi + F @ C + Q, Y @ Phi + F @ C]])
    decide(identical(J_1 @ A_bar @ T, moved, "J_1'APJ_1 in (10)"))
    decide(identical(J_1 @ B_bar, blocks([[Z @ Gamma], [Y @ Gamma + F @ D]]), "J_1'B in (10)"))
    decide(identical(blocks([[L, -C_f]]) @ T, blocks([[L - G, L]]), "CPJ_1 = [L - G, L]"))


@statement("nonuniform.recovery", source="mustafa", holds=True, says="recovery (11)")
def recovery() -> None:
    """The filter by (11) is the one behind the unknowns of (10), in other coordinates of its state, for any
    size of plant and signals and filters of its order.

    S = -Y^{-1}V is the change of coordinates and W = U'Z. With V = -YS and Z = Y + VW (the relation of the congruence),
    I - Y^{-1}Z = SW, so (11) reads A = S A_f W (SW)^{-1} = S A_f S^{-1}, B = S B_f, C = C_f W (SW)^{-1} = C_f S^{-1}.
    """
    Y, S, W, A_f, B_f = letters("Y", "S", "W", "A_f", "B_f")
    V = -(Y @ S)
    Z = Y + V @ W
    decide(identical(Y - Z, Y @ S @ W, "Y (I - Y^{-1}Z) = Y S W"))
    decide(identical(-(V @ A_f @ W), Y @ S @ A_f @ W, "-Q = Y S A_f W"))
    decide(identical(-(V @ B_f), Y @ S @ B_f, "-F = Y S B_f"))


def require_sharp_ends() -> None:
    """f(theta) = alpha (e^{m theta} - 1)/m is one at theta = log(1 + m/alpha)/m, the distance of an end of (9).

    E = e^{m theta} has the rate m E, so f grows at the rate alpha + m f. The time log(1 + m f/alpha)/m has the rate
    1/(alpha + m f) in f. Both are zero at f = 0, so each is the inverse function of the other: f = 1 at the end.
    """
    alpha, m, E, f = map(number, ("alpha", "m", "E", "f"))
    m_f, inside = alpha * (E - 1), alpha + m * f
    decide(equal(m_f.derivative("E") * m * E, m * (alpha + m_f), "the bound of Lemma 3 does not grow at this rate"))
    decide(equal(inside.derivative("f"), m, "the logarithm of (9) is not the time to reach a level at this rate"))


# Lemma 1, the stability of Theorems 1 to 3 and the level of Theorem 3, for plants, filters and signals of any size.


@statement("nonuniform.lemma-1", source="mustafa", holds=True, says="Lemma 1")
def lemma_1() -> None:
    """If one P-bar > 0 satisfies (6) at all sampling periods of a range, the error system is asymptotically stable with
    the level gamma for every sampling sequence of the range.

    Along the error system the form of (6) is V(x_{k+1}) - V(x_k) + e'e - gamma^2 w'w with V(x) = x'P-bar^{-1}x. It is
    negative: without w, V falls by one factor over the compact range; its sum from x_0 = 0 gives the level.
    """
    _dissipation()


@statement("nonuniform.stability", source="mustafa", holds=True, says="stability of Theorems 1 to 3")
def stability() -> None:
    """If the plant is stable and (6) holds at one sampling period, the error system is asymptotically stable for every
    sampling sequence with periods of at least h_l > 0; neither (8) nor a grid is needed.

    (6) at one period h_0 without w says that V falls there, so that A-bar(h_0) is Schur; products of A-bar keep its
    zero block and multiply the diagonal ones, so A_f is Schur. The exponentials of A commute: the state of the plant is
    e^(A tau_k) x_0, with tau_k >= k h_l, and tends to zero exponentially, and so does that of the filter, which it
    drives.
    """
    _dissipation()
    first, second, A_f, driven = letters("Phi", "Psi", "A_f", "driven")
    A_bar, following = (blocks([[Phi, Phi * 0], [driven, A_f]]) for Phi in (first, second))
    beside = driven @ second + A_f @ driven
    decide(
        identical(A_bar @ following, blocks([[first @ second, first * 0], [beside, A_f @ A_f]]), "a product of A-bar")
    )


@statement("nonuniform.level", source="mustafa", holds=True, says="level of Theorem 3")
def level() -> None:
    """If (10) holds, without its repeated row and with F of size n x r, the filter (11) has the level gamma at each
    element of the grid, and for every sequence of elements.

    (10) is (6) after a congruence with an invertible matrix, as (10) gives Y > Z > 0; (11) gives back the filter, in
    other coordinates. P-bar is one for all elements, so Lemma 1 holds on the grid.
    """
    congruence.prove()
    recovery.prove()
    _dissipation()


def _dissipation() -> None:
    """The form of (6) at (p, q, r, w), where P r = x_k, P p = x_{k+1} and q = e_k; G stands for gamma^2 I.

    Then B w = P p - A P r, p'P p = V(x_{k+1}) and r'P r = V(x_k).
    """
    P, A, C, G, p, r, w = letters("P", "A", "C", "G", "p", "r", "w", symmetric=("P", "G"))
    driven, q = P @ p - A @ P @ r, C @ P @ r
    diagonal = p.T @ P @ p + q.T @ q + r.T @ P @ r + w.T @ G @ w
    beside = p.T @ (A @ P @ r + driven) + q.T @ (C @ P @ r)
    loss = p.T @ P @ p - r.T @ P @ r + q.T @ q - w.T @ G @ w
    decide(identical(beside + beside.T - diagonal, loss, "the form of (6)"))

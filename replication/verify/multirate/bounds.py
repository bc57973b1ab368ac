"""Bounds of gains in exact arithmetic: Theorem 1 from above; disturbances, seen and unseen, from below.

All functions return or take squares of ratios of l2 norms, which are rational where the ratios are not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import (
    block,
    characteristic_polynomial,
    identity,
    product,
    solved,
    submatrix,
    zeros,
)
from replication.verify.kernel import AtMost, Below, Equal, Positive, Within, decide
from replication.verify.multirate.sensing import Sensing

Steps = Sequence[fmpq_mat]
"""[A_k B_k] of each phase, (n, n + m): x(k+1) = A_k x(k) + B_k v(k)."""
Hiding = Callable[[int, fmpq_mat], fmpq_mat]
"""The sensor noise at a phase that hides the states (n, r) there."""


def require_theorem_1(steps: Steps, W: fmpq_mat, P: list[fmpq_mat], level: fmpq) -> None:
    """Refuse unless P_k > 0 and diag(P_(k-1) - W'W, g^2 I) - [A_k B_k]' P_k [A_k B_k] > 0 at every phase.

    P_k weighs the error after the step at k, P_(k-1) the one before it. The second inequality says that the weighted
    square, which is never negative, falls by more than |We|^2 - g^2 |v|^2 in the step; summed from e(0) = 0 that is
    ||We|| <= g ||v||. Without disturbance it falls, so that the error system is stable.
    """
    for k, step in enumerate(steps):
        decide(Positive(P[k], f"P_{k}"))
        require_fall(step, W, (P[k - 1], P[k]), level, f"phase {k}")


def require_fall(step: fmpq_mat, W: fmpq_mat, P: tuple[fmpq_mat, fmpq_mat], level: fmpq, where: str) -> None:
    """Refuse unless diag(P - W'W, g^2 I) - [A B]' P+ [A B] > 0 for P before and P+ after the step."""
    before, after = P
    n, m = W.ncols(), step.ncols() - W.ncols()
    room = block([[before - W.transpose() * W, zeros(n, m)], [zeros(m, n), identity(m) * level**2]])
    decide(Positive(room - product(step.transpose(), product(after, step)), f"the matrix of Theorem 1 at {where}"))


def monodromy(steps: Steps) -> fmpq_mat:
    """The transition over one period from phase 0, A_(N-1) .. A_0."""
    total, *others = (submatrix(step, range(step.nrows()), range(step.nrows())) for step in steps)
    for A in others:
        total = product(A, total)
    return total


def advanced(step: fmpq_mat, x: fmpq_mat, v: fmpq_mat) -> fmpq_mat:
    """The next state, A x + B v."""
    return product(step, block([[x], [v]]))


def require_stable(transition: fmpq_mat, what: str) -> None:
    """Refuse unless all eigenvalues of the transition over one period are inside the unit circle."""
    decide(Within(characteristic_polynomial(transition), f"the poles of {what}"))


def squares(M: fmpq_mat) -> fmpq:
    """The sum of the squares of all entries."""
    return sum((entry**2 for entry in M.entries()), fmpq(0))


def require_turn(turn: fmpq_mat) -> None:
    """Refuse unless R is an orthogonal matrix of order 1 or 2: how a signal changes from one period to the next."""
    decide(AtMost(turn.nrows(), 2, "witness.turn must be of order 1 or 2"))
    decide(Equal(turn * turn.transpose(), identity(turn.nrows()), "witness.turn is not orthogonal"))


def recurrent(transition: fmpq_mat, driven: fmpq_mat, turn: fmpq_mat) -> fmpq_mat:
    """The X (n, r) with transition X + driven = X turn: states that after one period are themselves, turned."""
    n, r = driven.nrows(), driven.ncols()
    # Column j of X turn is the sum over i of turn[i, j] X_i; all columns stacked make one linear system.
    eye = identity(n)
    rows = [[eye * turn[i, j] - (transition if i == j else zeros(n, n)) for i in range(r)] for j in range(r)]
    stacked = fmpq_mat(n * r, 1, [driven[i, j] for j in range(r) for i in range(n)])
    X = solved(block(rows), stacked, "the disturbance is in resonance with the system")
    return fmpq_mat(n, r, [X[j * n + i, 0] for i in range(n) for j in range(r)])


def attained(
    steps: Steps,
    W: fmpq_mat,
    turn: fmpq_mat,
    v: list[fmpq_mat],
    hiding: Hiding | None = None,
    what: str = "error system",
) -> fmpq:
    """The square of a ratio that the gain of a stable system is not below.

    The input v_k R^j u at phase k of period j has, with a unit vector u, the steady state x_k R^j u. Averaged over the
    periods (R turns by an angle, or changes the sign at most) its squares are those of v_k and x_k; ended after many
    periods, it has finite energy, and start and end no longer count in the ratio. hiding: further noise at (k, x_k).
    """
    total = monodromy(steps)
    require_stable(total, f"the {what}")
    require_turn(turn)
    driven = zeros(total.nrows(), turn.nrows())
    for step, v_k in zip(steps, v, strict=True):
        driven = advanced(step, driven, v_k)
    x, output, noise = recurrent(total, driven, turn), fmpq(0), fmpq(0)
    for k, (step, v_k) in enumerate(zip(steps, v, strict=True)):
        output += squares(W * x)
        noise += squares(v_k) + (squares(hiding(k, x)) if hiding else 0)
        x = advanced(step, x, v_k)
    return ratio(output, noise)


def unseen_forever(system: Sensing, turn: fmpq_mat, d: list[fmpq_mat]) -> fmpq:
    """The square of a ratio below which no estimator gets, not even a smoother; for a stable plant.

    d_k R^j u disturbs the plant as in `attained`, and the sensor noise makes all measurements zero. Whatever the
    estimator says then, it says the same to the opposite disturbance, and in one of the two it errs by ||Wx|| or more.
    """
    step = block([[system.A, system.B_d]])
    return attained([step for _ in system.measured], system.W, turn, d, system.concealing, "plant")


def unseen_for_long(system: Sensing, start: int, d: list[fmpq_mat]) -> fmpq:
    """The square of a ratio below which no causal estimator gets: of z(1) .. z(T) to the noise at 0 .. T - 1.

    From x = 0 at phase `start` on, d_k disturbs the plant, and until T - 1 the sensor noise makes all measurements
    zero. An estimate of z(k) that uses the measurements up to k - 1 is the same for the opposite disturbance until T.
    """
    step = block([[system.A, system.B_d]])
    x, output, noise = zeros(system.order, 1), fmpq(0), fmpq(0)
    for k, d_k in enumerate(d):
        noise += squares(d_k) + squares(system.concealing((start + k) % len(system.C), x))
        x = advanced(step, x, d_k)
        output += squares(system.W * x)
    return ratio(output, noise)


def ratio(output: fmpq, noise: fmpq) -> fmpq:
    """Output to noise; refused without noise."""
    decide(Below(0, noise, "the disturbance is zero"))
    return output / noise

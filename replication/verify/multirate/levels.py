"""Two-sided bounds of the gain of given gains, and of the smallest gain of any observer (Theorems 1 and 2)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.decimals import above, below
from replication.verify.algebra.linear import block, identity, require_positive_definite, zeros
from replication.verify.multirate.bounds import attained, require_theorem_1, unseen_for_long, unseen_forever
from replication.verify.multirate.sensing import Sensing, of_certificate, schedule_in_words
from replication.verify.reading import fields, integer, matrices, matrix, positive, sequence, symmetric
from replication.verify.theorem import Theorem, require

Certificate = Mapping[str, Any]


def gain(certificate: Certificate) -> Theorem:
    """The gain of the given gains L_k: Theorem 1 from above, a disturbance from below."""
    system, relative = of_certificate(certificate, "L")
    lower, upper = bracket(certificate, relative)
    P, turn, v = fields(certificate["witness"], "witness", "P", "turn", "v")
    count, n = len(system.C), system.order
    L = matrices(certificate["plant"]["L"], "plant.L", n, system.sensors, count)
    steps = system.error_system(L)
    require_theorem_1(steps, system.W, _symmetric(P, n, count), upper)
    R = _turn(turn)
    disturbance = matrices(v, "witness.v", system.noises, R.nrows(), count)
    require_lower(lower, attained(steps, system.W, R, disturbance))
    return Theorem(
        sentence=f"{schedule_in_words(certificate)}, the error system of the given gains is stable, with an l2 gain "
        f"between {below(lower)} and {above(upper)}; the upper bound is one of Theorem 1.",
        lower=lower,
        upper=upper,
        holds=True,
    )


def optimum_noncausal(certificate: Certificate) -> Theorem:
    """The smallest gain where smoothers do no better: Theorem 2 from above, a disturbance that is never seen below."""
    system, relative = of_certificate(certificate)
    lower, upper = bracket(certificate, relative)
    P, Y, turn, d = fields(certificate["witness"], "witness", "P", "Y", "turn", "d")
    require_theorem_2(system, P, Y, upper)
    R = _turn(turn)
    disturbance = matrices(d, "witness.d", system.B_d.ncols(), R.nrows(), len(system.C))
    require_lower(lower, unseen_forever(system, R, disturbance))
    return Theorem(
        sentence=f"{schedule_in_words(certificate)}, by Theorem 2 some observer has a gain of at most {above(upper)}; "
        f"no estimator, not even a smoother, has one below {below(lower)}.",
        lower=lower,
        upper=upper,
        holds=True,
    )


def optimum_causal(certificate: Certificate) -> Theorem:
    """The smallest gain: Theorem 2 from above, a disturbance of finite length that is seen too late from below."""
    system, relative = of_certificate(certificate)
    lower, upper = bracket(certificate, relative)
    P, Y, start, d = fields(certificate["witness"], "witness", "P", "Y", "start", "d")
    require_theorem_2(system, P, Y, upper)
    disturbance = matrices(d, "witness.d", system.B_d.ncols(), 1)
    require_lower(lower, unseen_for_long(system, integer(start, "witness.start"), disturbance))
    return Theorem(
        sentence=f"{schedule_in_words(certificate)}, by Theorem 2 some observer has a gain of at most {above(upper)}; "
        f"no observer has one below {below(lower)}.",
        lower=lower,
        upper=upper,
        holds=True,
    )


def require_theorem_2(system: Sensing, P: Any, Y: Any, level: fmpq) -> None:
    """Refuse unless P_k and Y_k satisfy inequality (30) as printed, at every phase.

    By a Schur complement with its first block it is the inequality of Theorem 1 for the gains L_k = P_k^-1 Y_k; and its
    diagonal blocks are positive definite, so P_k > 0.
    """
    n, count = system.order, len(system.C)
    P_k = _symmetric(P, n, count)
    weight = system.W.transpose() * system.W
    for k, Y_k in enumerate(matrices(Y, "witness.Y", n, system.sensors, count)):
        driven, seen = system.open_loop(k)
        step = P_k[k] * driven - system.acting(k, Y_k) * seen
        m = step.ncols() - n
        rest = block([[P_k[k - 1] - weight, zeros(n, m)], [zeros(m, n), identity(m) * level**2]])
        whole = block([[P_k[k], step], [step.transpose(), rest]])
        require_positive_definite(whole, f"the matrix (30) of Theorem 2 at phase {k}")


def _turn(value: Any) -> fmpq_mat:
    """The square matrix witness.turn; that it is orthogonal is for the bound to check."""
    turn = matrix(value, "witness.turn")
    return matrix(value, "witness.turn", turn.ncols(), turn.ncols())


def _symmetric(value: Any, size: int, count: int) -> list[fmpq_mat]:
    return sequence(value, "witness.P", lambda entry, path: symmetric(entry, path, size), count)


def bracket(certificate: Certificate, relative: Any) -> tuple[fmpq, fmpq]:
    """The stated bounds, no farther apart than the theorem that is wanted allows."""
    stated = fields(certificate["bound"], "bound", "lower", "upper")
    lower, upper = positive(stated[0], "bound.lower"), positive(stated[1], "bound.upper")
    width = positive(relative, "parameters.relative")
    require(lower <= upper <= lower * (1 + width), f"the bounds are not within the relative width {relative}")
    return lower, upper


def require_lower(lower: fmpq, squared: fmpq) -> None:
    """Refuse unless the square of a proved ratio is not below that of the bound."""
    require(squared >= lower**2, "the disturbance of the witness does not reach the lower bound")


STATEMENTS: Mapping[str, Callable[[Certificate], Theorem]] = {
    "multirate.gain": gain,
    "multirate.optimum-noncausal": optimum_noncausal,
    "multirate.optimum-causal": optimum_causal,
}

"""A level that no filter of form (4) attains at a constant period: disturbances that the measurements do not show.

A filter that has seen only zero measurements estimates zero. If w_k for k <= 0, from rest in the distant past, gives
y_k = 0 for all k <= 0, the errors are e_k = L x_k for k <= 1, whatever the filter; so its gain is at least
(sum_{k <= 1} |L x_k|^2 / sum_{k <= 0} |w_k|^2)^(1/2).
"""

from __future__ import annotations

from flint import arb, arb_mat, fmpq

from replication.verify.algebra.balls import energy, hold
from replication.verify.algebra.linear import identity, solved
from replication.verify.algebra.work import BALL, spend
from replication.verify.kernel import Hurwitz, Positive, decide
from replication.verify.nonuniform.gain import require_ratio
from replication.verify.nonuniform.system import Plant, Time, seconds
from replication.verify.theorem import require


def require_no_filter_below(plant: Plant, period: Time, level: fmpq, start: list[fmpq]) -> None:
    """Refuse unless every filter of form (4) with A_f Schur has a gain above `level` at this constant period.

    D = 0: nothing is seen of w_0 = start before k = 1. D invertible: `start` is x_0, reached by w_k = -D^{-1} C x_k,
    x_{k+1} = F x_k, F = Phi - Gamma D^{-1} C; this motion comes from rest if F^{-1} is Schur, that is if all zeros of
    w -> y lie outside the unit circle. Truncated in the distant past it keeps its ratio up to any small number,
    because what the truncation shows decays with the plant, and a filter with A_f Schur answers little to it.
    """
    n = plant.A.nrows()
    Phi, Gamma = hold(plant.A, plant.B, seconds(period))
    L = arb_mat(plant.L)
    x = arb_mat(len(start), 1, [arb(entry) for entry in start])
    if plant.D.rank() == 0:
        require(len(start) == plant.B.ncols(), "witness.start must be a disturbance")
        supplied, seen = energy(x), energy(L * Gamma * x)
    else:
        require(len(start) == n, "witness.start must be a state")
        require(plant.D.nrows() == plant.D.ncols(), "D is neither zero nor square")
        require(plant.D.det() != 0, "D is neither zero nor invertible")
        decide(Hurwitz(plant.A, "the plant"))
        ratio = plant.D.inv() * plant.C
        back = solved(Phi - Gamma * arb_mat(ratio), arb_mat(identity(n)), "Phi - Gamma D^-1 C is not proved invertible")
        require_schur(back)
        following = (Phi - Gamma * arb_mat(ratio)) * x
        supplied = _quadratic(energy_before(back, arb_mat(ratio.transpose() * ratio)), x)
        seen = _quadratic(energy_before(back, L.transpose() * L), following)
    require_ratio(seen, supplied, level, "the hidden disturbance")


def require_schur(J: arb_mat) -> None:
    """Refuse unless X = I + J'XJ has a positive definite solution: J is then Schur (Lyapunov)."""
    X = energy_before(J, arb_mat(identity(J.nrows())))
    decide(Positive(X, "the energy of the zeros of w -> y, which must lie outside the unit circle,"))


def energy_before(J: arb_mat, Q: arb_mat) -> arb_mat:
    """X = Q + J'XJ, for a Schur J the sum of (J^k)'Q J^k over k >= 0, by the linear equation for its entries."""
    # Before the equation is set up: its entries alone, the fourth power of the states, fill the memory first.
    spend(J.nrows() ** 6 * BALL, "the energy of a motion")
    places = [(i, j) for i in range(J.nrows()) for j in range(J.nrows())]
    equation = [[arb(int(p == q)) - J[q[0], p[0]] * J[q[1], p[1]] for q in places] for p in places]
    X = solved(arb_mat(equation), arb_mat([[entry] for entry in Q.entries()]), "the energy is not proved finite")
    return arb_mat(J.nrows(), J.nrows(), X.entries())


def _quadratic(Q: arb_mat, x: arb_mat) -> arb:
    return (x.transpose() * Q * x).trace()

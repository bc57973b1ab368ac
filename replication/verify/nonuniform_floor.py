"""A level that no filter of form (4) attains at a constant period: disturbances that the measurements do not show.

A filter that has seen only zero measurements estimates zero. If w_k for k <= 0, from rest in the distant past, gives
y_k = 0 for all k <= 0, the errors are e_k = L x_k for k <= 1, whatever the filter; so its gain is at least
(sum_{k <= 1} |L x_k|^2 / sum_{k <= 0} |w_k|^2)^(1/2).
"""

from __future__ import annotations

from flint import arb, arb_mat, fmpq

from replication.verify.nonuniform_system import Plant, Time, seconds, step_at
from replication.verify.theorem import require

SQUARINGS = 12
"""Powers of two of a matrix that are tried for a norm below one."""


def require_no_filter_below(plant: Plant, period: Time, level: fmpq, start: list[fmpq]) -> None:
    """Refuse unless every filter of form (4) with A_f Schur has a gain above `level` at this constant period.

    D = 0: nothing is seen of w_0 = start before k = 1. D invertible: `start` is x_0, reached by w_k = -D^{-1} C x_k,
    x_{k+1} = F x_k, F = Phi - Gamma D^{-1} C; this motion comes from rest if F^{-1} is Schur, that is if all zeros of
    w -> y lie outside the unit circle. Truncated in the distant past it keeps its ratio up to any small number,
    because a filter with A_f Schur answers little to what the truncation shows.
    """
    n = plant.A.nrows()
    rows = step_at(plant, seconds(period)).tolist()
    Phi, Gamma = arb_mat([row[:n] for row in rows]), arb_mat([row[n:] for row in rows])
    L = arb_mat(plant.L)
    x = arb_mat(len(start), 1, [arb(entry) for entry in start])
    if plant.D == 0 * plant.D:
        require(len(start) == plant.B.ncols(), "witness.start must be a disturbance")
        supplied, seen = _square(x), _square(L * Gamma * x)
    else:
        require(len(start) == n, "witness.start must be a state")
        require(plant.D.nrows() == plant.D.ncols() and plant.D.det() != 0, "D is neither zero nor invertible")
        ratio = plant.D.inv() * plant.C
        back = (Phi - Gamma * arb_mat(ratio)).inv()
        require_schur(back)
        following = back.solve(x)
        supplied = _quadratic(energy_before(back, arb_mat(ratio.transpose() * ratio)), x)
        seen = _quadratic(energy_before(back, L.transpose() * L), following)
    require(supplied > 0, "witness.start must not be zero")
    require(seen > level**2 * supplied, f"the hidden disturbance does not attain {level}: {(seen / supplied).sqrt()}")


def require_schur(J: arb_mat) -> None:
    """Refuse unless a power of J has a Frobenius norm below one."""
    power = J
    for _ in range(SQUARINGS):
        if sum((entry * entry for entry in power.entries()), arb(0)) < 1:
            return
        power = power * power
    require(False, "the zeros of w -> y are not proved to lie outside the unit circle")


def energy_before(J: arb_mat, Q: arb_mat) -> arb_mat:
    """X = Q + J'XJ = sum_{k >= 0} (J^k)'Q J^k of a Schur J, by the linear equation for its entries."""
    n = J.nrows()
    pairs = [(i, j) for i in range(n) for j in range(n)]
    equation = [[arb(int(p == q)) - J[q[0], p[0]] * J[q[1], p[1]] for q in pairs] for p in pairs]
    return arb_mat(n, n, arb_mat(equation).solve(arb_mat(n * n, 1, Q.entries())).entries())


def _square(column: arb_mat) -> arb:
    return sum((entry * entry for entry in column.entries()), arb(0))


def _quadratic(Q: arb_mat, x: arb_mat) -> arb:
    return (x.transpose() * Q * x)[0, 0]

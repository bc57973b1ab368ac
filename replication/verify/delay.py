"""Observers of systems with delayed states (Peet and Gu): levels from both sides, and characteristic roots."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flint import acb, acb_mat, arb, ctx, fmpq, fmpq_mat

from replication.verify.delay_plant import DelayPlant, read_plant
from replication.verify.delay_sos import require_level
from replication.verify.linear import submatrix, zeros
from replication.verify.printed import above, below
from replication.verify.reading import fields, integer, matrix, positive, rational, sequence
from replication.verify.theorem import Theorem, require

BITS = 128
"""Working precision of the balls."""


def gain_upper(certificate: Mapping[str, Any]) -> Theorem:
    """delay.gain-upper: Theorem 3 at `degree` gives an observer whose error has L2 gain below the bound."""
    (degree_value,) = fields(certificate["parameters"], "parameters", "degree")
    degree = integer(degree_value, "parameters.degree", 1)
    (upper,) = fields(certificate["bound"], "bound", "upper")
    gamma = positive(upper, "bound.upper")
    require_level(read_plant(certificate["plant"]), gamma, degree, certificate["witness"])
    return Theorem(
        sentence=f"{_name(certificate)}: Theorem 3, from degree {degree} on, is feasible at the level {above(gamma)}, "
        "and the observer with the gains of its storage has an L2 gain from w to the error of z below it.",
        upper=gamma,
    )


def gain_lower(certificate: Mapping[str, Any]) -> Theorem:
    """delay.gain-lower: every observer that knows y only has at least the gain of the bound."""
    fields(certificate["parameters"], "parameters")
    (lower,) = fields(certificate["bound"], "bound", "lower")
    gamma = positive(lower, "bound.lower")
    frequency = _require_hidden(read_plant(certificate["plant"]), gamma, certificate["witness"])
    return Theorem(
        sentence=f"{_name(certificate)}: no observer, causal or not, has an L2 gain from w to the error of z below "
        f"{below(gamma)}: near {below(frequency, 6)} rad/s a disturbance with y = 0 has that gain to z.",
        lower=gamma,
    )


def near_optimal(certificate: Mapping[str, Any]) -> Theorem:
    """delay.near-optimal: the observer of Theorem 3 at `degree` is within `factor` of the least gain there is."""
    degree_value, factor_value = fields(certificate["parameters"], "parameters", "degree", "factor")
    degree = integer(degree_value, "parameters.degree", 1)
    factor = positive(factor_value, "parameters.factor")
    fields(certificate["bound"], "bound")
    level, hidden, sos = fields(certificate["witness"], "witness", "level", "hidden", "sos")
    gamma = positive(level, "witness.level")
    plant = read_plant(certificate["plant"])
    require_level(plant, gamma, degree, sos)
    _require_hidden(plant, gamma / factor, hidden)
    return Theorem(
        sentence=f"{_name(certificate)}: the observer with the gains of a storage of degree {degree} has an L2 gain "
        f"below its level {above(gamma)}, which is at most {factor} times what any observer has.",
        holds=True,
    )


def _require_hidden(plant: DelayPlant, gamma: fmpq, witness: Any) -> fmpq:
    """Refuse unless some x with C2 x = 0 has |C(iw) x| >= gamma |B^-1 M(iw) x| at the frequency w of the witness.

    M(s) = s I - A0 - sum A_i exp(-s tau_i) and C(s) = C10 + sum C1_i exp(-s tau_i); B must have an inverse. Returns w.
    """
    frequency_value, direction_value = fields(witness, "witness", "frequency", "state")
    frequency = rational(frequency_value, "witness.frequency")
    n = plant.states
    x = matrix(direction_value, "witness.state", n, 1)
    require(plant.C2 * x == zeros(plant.C2.nrows(), 1), "witness.state is seen by y: C2 x is not zero")
    require(plant.B.ncols() == n and plant.B.det() != 0, "B has no inverse, so that the disturbance is not known")
    ctx.prec = BITS
    s = acb(0, arb(frequency))
    turns = [(-s * acb(arb(delay))).exp() for delay in plant.delays]
    back = plant.B.inv()
    w = acb_mat(back * x) * s - acb_mat(back * plant.A0 * x) - _delayed(back * plant.late, turns, x)
    z = acb_mat(plant.C10 * x) + _delayed(plant.late_output, turns, x)
    excess = _energy(z) - arb(gamma) ** 2 * _energy(w)
    require(bool(excess >= 0), f"the gain at this frequency is not proved to reach {below(gamma)}")
    return frequency


def _delayed(late: fmpq_mat, turns: list[acb], x: fmpq_mat) -> acb_mat:
    """sum over the delays of turn_i late_i x."""
    n = x.nrows()
    rows = range(late.nrows())
    result = acb_mat(late.nrows(), 1)
    for i, turn in enumerate(turns):
        result += acb_mat(submatrix(late, rows, range(i * n, (i + 1) * n)) * x) * turn
    return result


def _energy(vector: acb_mat) -> arb:
    return sum((entry.real**2 + entry.imag**2 for entry in vector.entries()), arb(0))


def unstable(certificate: Mapping[str, Any]) -> Theorem:
    """delay.unstable: det M(s) changes its sign between two positive s, so that it has a positive real root."""
    fields(certificate["parameters"], "parameters")
    fields(certificate["bound"], "bound")
    first, second = fields(certificate["witness"], "witness", "left", "right")
    left, right = positive(first, "witness.left"), positive(second, "witness.right")
    require(left < right, "witness.left must be below witness.right")
    plant = read_plant(certificate["plant"])
    ends = [_characteristic(plant, point) for point in (left, right)]
    require(bool(ends[0] * ends[1] < 0), "det M does not change its sign between the two points")
    return Theorem(
        sentence=f"{_name(certificate)} is unstable: it has a characteristic root between {below(left, 6)} and "
        f"{above(right, 6)} per second.",
        holds=True,
    )


def _characteristic(plant: DelayPlant, point: fmpq) -> arb:
    """det(s I - A0 - sum A_i exp(-s tau_i)) at a real s."""
    ctx.prec = BITS
    n = plant.states
    matrix_at = [[acb(int(i == j)) * arb(point) - arb(plant.A0[i, j]) for j in range(n)] for i in range(n)]
    for k, delay in enumerate(plant.delays):
        decay = (-arb(point) * arb(delay)).exp()
        for i in range(n):
            for j in range(n):
                matrix_at[i][j] -= arb(plant.late[i, k * n + j]) * decay
    return acb_mat(matrix_at).det().real


def not_unstable(certificate: Mapping[str, Any]) -> Theorem:
    """delay.not-unstable: Example 4 has no root in the open right half-plane, for these eigenvalues of J.

    Its roots are those of s + (a/K) sum exp(-s i/K), i = 1..K, with a the eigenvalue. If a = 0 that is s = 0. If
    0 < a < pi/2, a root with Re s >= 0 has |s| <= a, so that |Im s| i/K < pi/2 and the real part is positive.
    """
    (eigenvalues,) = fields(certificate["parameters"], "parameters", "eigenvalues")
    fields(certificate["bound"], "bound")
    fields(certificate["witness"], "witness")
    for i, value in enumerate(sequence(eigenvalues, "parameters.eigenvalues", rational)):
        require(value >= 0, f"eigenvalue {i} is negative")
        require(bool(2 * arb(value) < arb.pi()), f"eigenvalue {i} is not below pi/2")
    return Theorem(
        sentence="Example 4 has no characteristic root with positive real part, for any number of states and delays, "
        f"if J has an eigenvalue among {', '.join(eigenvalues)}.",
        holds=False,
    )


def _name(certificate: Mapping[str, Any]) -> str:
    return f"The plant {certificate['plant']['name']}"


STATEMENTS: Mapping[str, Callable[[Mapping[str, Any]], Theorem]] = {
    "delay.gain-upper": gain_upper,
    "delay.gain-lower": gain_lower,
    "delay.near-optimal": near_optimal,
    "delay.unstable": unstable,
    "delay.not-unstable": not_unstable,
}

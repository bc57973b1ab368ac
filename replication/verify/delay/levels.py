"""Observers of systems with delayed states (Peet and Gu): levels from both sides, and characteristic roots."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flint import acb, acb_mat, arb, fmpq

from replication.verify.algebra.decimals import above, below
from replication.verify.delay.hidden import exponential, require_hidden
from replication.verify.delay.plant import DelayPlant, read_plant
from replication.verify.delay.sos import require_level
from replication.verify.reading import fields, integer, positive, rational, sequence
from replication.verify.theorem import Theorem, require


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
    frequency = require_hidden(read_plant(certificate["plant"]), gamma, certificate["witness"], exponential)
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
    require_hidden(plant, gamma / factor, hidden, exponential)
    return Theorem(
        sentence=f"{_name(certificate)}: the observer with the gains of a storage of degree {degree} has an L2 gain "
        f"below its level {above(gamma)}, which is at most {factor} times what any observer has.",
        holds=True,
    )


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
    n = plant.states
    matrix_at = [[acb(int(i == j)) * arb(point) - arb(plant.A0[i, j]) for j in range(n)] for i in range(n)]
    for k, delay in enumerate(plant.delays):
        decay = (-arb(point) * arb(delay)).exp()
        for i in range(n):
            for j in range(n):
                matrix_at[i][j] -= arb(plant.late[i, k * n + j]) * decay
    return acb_mat(matrix_at).det().real


def not_unstable(certificate: Mapping[str, Any]) -> Theorem:
    """delay.not-unstable: Example 4 has no root in the open right half-plane, if J has no other eigenvalues than these.

    Its roots are those of s + (a/K) sum exp(-s i/K), i = 1..K, for each eigenvalue a of J (in a basis in which J is
    triangular, det M is the product of these). If a = 0 that is s = 0. If
    0 < a <= 1, a root with Re s >= 0 has |s| <= 1, so that |Im s| i/K <= 1 < pi/2 and the real part is positive.
    """
    (eigenvalues,) = fields(certificate["parameters"], "parameters", "eigenvalues")
    fields(certificate["bound"], "bound")
    fields(certificate["witness"], "witness")
    read = sequence(eigenvalues, "parameters.eigenvalues", rational)
    require(bool(read), "parameters.eigenvalues is empty")
    for i, value in enumerate(read):
        require(0 <= value <= 1, f"eigenvalue {i} is not between 0 and 1")
    return Theorem(
        sentence="Example 4 is not unstable: it has no characteristic root with positive real part, for any number of "
        f"states and delays, if all eigenvalues of J are among {', '.join(eigenvalues)}.",
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

"""Certificates of observers of systems with delays: levels of Theorem 3 from above, of any observer from below."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
from flint import fmpq_mat
from scipy.optimize import minimize_scalar

from replication.certify.delay.forms import Dynamics
from replication.certify.delay.gram import SOLVED, centred, exact_grams
from replication.certify.rounding import as_floats, exact, floats, rational, rounded, rounded_down, rounded_up, stepwise
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.delay import DelaySystem, delay_system, minimum_gain, rightmost_roots
from replication.estimation.delay.units import natural_units
from replication.verify.algebra.linear import block, identity, take_rows
from replication.verify.reading import written

STEPS = (1.2e-6, 5e-6, 2e-5, 1e-4)
"""Relative distances of a level from the least one, tried in turn until there is room for rounding."""
TRACE, WIDE_TRACE = 30.0, 1e4
"""Bound on the traces of the Gram matrices: small numbers close to the least level; more of it for small levels, and
where the kernels have few powers."""
LEVEL_BITS, FREQUENCY_BITS, ROOT_BITS = 40, 20, 20
BELOW = 1e-8
"""Relative distance of a lower bound from the gain that floating point finds."""
FREQUENCIES = 4001
"""Grid of the search for the frequency of a lower bound."""


def change_of(plant: Mapping[str, Any]) -> fmpq_mat:
    """Rational coordinates in which the last states are the measurements: unit rows above C_2, the first that serve."""
    sensor = exact(plant["C2"])
    q, n = sensor.nrows(), sensor.ncols()
    if all(sensor[i, j] == 0 for i in range(q) for j in range(n - q)):
        return identity(n)
    for kept in combinations(range(n), n - q):
        change = block([[take_rows(identity(n), kept)], [sensor]])
        if change.det() != 0:
            return change
    raise InvalidInputError("the rows of C_2 are dependent; drop redundant measurements")


def dynamics_of(plant: Mapping[str, Any], change: fmpq_mat) -> Dynamics:
    """The plant in the coordinates `change`, in exact numbers."""
    back = change.inv()
    return Dynamics(
        A0=change * exact(plant["A0"]) * back,
        late=block([[change * exact(matrix) * back for matrix in plant["A"]]]),
        delays=tuple(rational(delay) for delay in plant["delays"]),
        B=change * exact(plant["B"]),
        C10=exact(plant["C10"]) * back,
        late_output=block([[exact(matrix) * back for matrix in plant["C1"]]]),
        measured=len(plant["C2"]),
    )


def floating(plant: Mapping[str, Any], change: fmpq_mat | None = None) -> DelaySystem:
    """The plant in floating point, each number rounded once; in the coordinates `change` if they are given."""
    change = identity(len(plant["A0"])) if change is None else change
    dynamics, sensor = dynamics_of(plant, change), floats(exact(plant["C2"]) * change.inv())
    parts = len(dynamics.delays)
    return delay_system(
        floats(dynamics.A0),
        np.split(floats(dynamics.late), parts, axis=1),
        [float(Fraction(str(delay))) for delay in dynamics.delays],
        floats(dynamics.B),
        floats(dynamics.C10),
        sensor,
        np.split(floats(dynamics.late_output), parts, axis=1),
    )


def grams(
    plant: Mapping[str, Any], gamma: str, degree: int, trace: float = TRACE, rule: str = "each"
) -> dict[str, Any]:
    """Witness of Theorem 3 at the level gamma; raises InfeasibleError if there is no room for rounding."""
    change = change_of(plant)
    point = centred(floating(plant, change), float(Fraction(gamma)), degree, trace, rule)
    found = exact_grams(dynamics_of(plant, change), rational(gamma), degree, point, rule)
    made = {name: [written(gram) for gram in pair] for name, pair in found.items()}
    least = min(float(np.linalg.eigvalsh(as_floats(gram))[0]) for pair in made.values() for gram in pair)
    if not least > 0.0:
        raise InfeasibleError(f"no room for rounding at the level {gamma}: exact matrices reach {least:.1e}; raise it")
    return {"change": written(change), **made}


def grams_in_units(plant: Mapping[str, Any], gamma: str, degree: int) -> dict[str, Any]:
    """`grams`, found in the natural units of the plant and with a level of about one, written in its own units.

    With x' = S x, t' = t/T, w' = sqrt(T) w, v' = sqrt(T) v and z' = sqrt(T) z/g the identity of Theorem 3 is multiplied
    by T/g: V' = V/g and N' = (T/g) N. All units are powers of two, T of four, so that nothing is rounded.
    """
    units, size = natural_units(floating(plant)), round(np.log2(float(Fraction(gamma))))
    time, root, gain = (rational(unit) for unit in (units.time, units.time**0.5, 2.0**size))
    states = exact(units.change)
    back = states.inv()
    scaled = {
        "A0": written(states * exact(plant["A0"]) * back * time),
        "A": [written(states * exact(matrix) * back * time) for matrix in plant["A"]],
        "delays": [str(rational(delay) / time) for delay in plant["delays"]],
        "B": written(states * exact(plant["B"]) * root),
        "C10": written(exact(plant["C10"]) * back * (root / gain)),
        "C1": [written(exact(matrix) * back * (root / gain)) for matrix in plant["C1"]],
        "C2": written(exact(plant["C2"]) * back),
    }
    made = grams(scaled, str(rational(gamma) / gain), degree, WIDE_TRACE)
    inputs = len(plant["B"][0]) + len(plant["C10"])

    def restored(gram: Any) -> Any:
        unit = identity(len(gram))
        for i in range(inputs):
            unit[i, i] = root
        return written(unit * exact(gram) * unit * (gain / time))

    return {
        "change": written(exact(made["change"]) * states),
        "storage": [written(exact(gram) * gain) for gram in made["storage"]],
        "dissipation": [restored(gram) for gram in made["dissipation"]],
    }


def gain_upper(theorem: Mapping[str, Any], level: str | None = None) -> dict[str, Any]:
    """Bound and witness of a level that Theorem 3 reaches at the degree of the theorem: `level`, or close to the least.

    Raises InfeasibleError if no level that is tried leaves room for rounding.
    """
    plant, degree = theorem["plant"], theorem["parameters"]["degree"]
    if level is not None:
        gamma = str(Fraction(level))
        return {"bound": {"upper": gamma}, "witness": grams(plant, gamma, degree, WIDE_TRACE)}
    return _upper(theorem, "each")


def total_upper(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """The same by the rule of the total degree."""
    return _upper(theorem, "total")


def narrow_upper(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """The same with kernels in the variable that the theorem names."""
    return _upper(theorem, theorem["parameters"]["rule"], WIDE_TRACE)


def _upper(theorem: Mapping[str, Any], rule: str, trace: float = TRACE) -> dict[str, Any]:
    plant, degree = theorem["plant"], theorem["parameters"]["degree"]
    least = minimum_gain(floating(plant), degree, rule=SOLVED[rule]).gamma
    return stepwise(least, STEPS, LEVEL_BITS, lambda gamma: grams(plant, gamma, degree, trace, rule))


def gain_lower(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bound and witness of the gain that no observer can go below."""
    gamma, witness = hidden_gain(theorem["plant"])
    return {"bound": {"lower": gamma}, "witness": witness}


def hidden_gain(
    plant: Mapping[str, Any], lag: Callable[[complex], complex] = lambda s: np.exp(-s)
) -> tuple[str, dict[str, Any]]:
    """The largest gain of a disturbance that leaves y at zero, and the frequency and the state that show it.

    lag: the transfer function of a delay tau as a function of s tau; another one than exp(-s) for an approximation.
    For plants with one unmeasured state, so that C_2x = 0 leaves one direction; raises InvalidInputError for others.
    """
    sensor = exact(plant["C2"])
    q, n = sensor.nrows(), sensor.ncols()
    if n - q != 1:
        raise InvalidInputError(f"exactly one state may be unmeasured, got {n - q}")
    back = change_of(plant).inv()
    state = [[str(back[i, 0])] for i in range(n)]
    system, x = floating(plant), as_floats(state)

    def gain(frequency: float) -> float:
        s = 1j * frequency
        turns = [lag(s * delay) for delay in system.delays]
        output = system.c10 + sum(turn * c for turn, c in zip(turns, system.c1, strict=True))
        rate = s * np.eye(n) - system.a0 - sum(turn * a for turn, a in zip(turns, system.a, strict=True))
        return float(np.linalg.norm(output @ x) / np.linalg.norm(np.linalg.solve(system.b, rate @ x)))

    reach = 2.0 * float(np.linalg.norm(system.a0, 2) + sum(np.linalg.norm(a, 2) for a in system.a))
    grid = np.linspace(0.0, reach, FREQUENCIES)
    best = int(np.argmax([gain(float(frequency)) for frequency in grid]))
    ends = grid[max(0, best - 1)], grid[min(FREQUENCIES - 1, best + 1)]
    found = minimize_scalar(lambda frequency: -gain(frequency), bounds=ends, method="bounded", options={"xatol": 1e-8})
    candidates = [rounded(float(frequency), FREQUENCY_BITS) for frequency in (0.0, found.x)]
    frequency = max(candidates, key=lambda text: gain(float(Fraction(text))))
    lower = gain(float(Fraction(frequency))) * (1.0 - BELOW)
    return rounded_down(lower, LEVEL_BITS), {"frequency": frequency, "state": state}


def near_optimal(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Witness of a level of Theorem 3 within a factor of what any observer reaches; nine tenths of the way."""
    plant, parameters = theorem["plant"], theorem["parameters"]
    lower, hidden = hidden_gain(plant)
    factor = 1.0 + 0.9 * float(Fraction(parameters["factor"]) - 1)
    gamma = rounded_up(float(Fraction(lower)) * factor, LEVEL_BITS)
    return {
        "bound": {},
        "witness": {"level": gamma, "hidden": hidden, "sos": grams(plant, gamma, parameters["degree"])},
    }


def unstable(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Witness of a positive real root: two points close to it. Raises InvalidInputError if the root is not one."""
    root = complex(rightmost_roots(floating(theorem["plant"]), 1)[0])
    if root.real <= 0.0 or abs(root.imag) > 1e-9:
        raise InvalidInputError(f"the rightmost root {root:.6g} is not real and positive")
    width = 2.0**-ROOT_BITS
    left, right = rounded_down(root.real - width, ROOT_BITS), rounded_up(root.real + width, ROOT_BITS)
    return {"bound": {}, "witness": {"left": left, "right": right}}


def no_witness(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """For theorems that the verifier proves from their parameters alone."""
    return {"bound": {}, "witness": {}}

"""Makes the certificates of the wanted theorems of this paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from papers.shao.problem import COUNTEREXAMPLE, DESIGN, literal_loop
from replication.certify import dualrate
from replication.estimation.dualrate.loop import DualRateLoop, close_loop
from replication.estimation.dualrate.observers import OBSERVERS
from replication.verify.subjects import subject, theorems

KEY = "shao"
DESIGNS = {"motor": DESIGN, "motor-from-start": DESIGN, "scalar": COUNTEREXAMPLE}

Theorem = Mapping[str, Any]


def make(name: str) -> dict[str, Any]:
    """The certificate of one entry of theorems.json."""
    theorem = subject(KEY, name)
    return {**theorem, **MAKERS[theorem["statement"].removeprefix("dualrate.")](theorem)}


def parameters(name: str) -> Mapping[str, Any]:
    """The parameters of one entry of theorems.json."""
    return theorems(KEY)[0][name].parameters


def _loop(theorem: Theorem) -> DualRateLoop:
    """The loop that a theorem is about, with its reference if there is one."""
    return _loop_of(theorem, theorem["parameters"])


def _loop_of(theorem: Theorem, parameters: Mapping[str, Any]) -> DualRateLoop:
    design, observer = DESIGNS[theorem["plant"]["name"]], parameters["observer"]
    if "frequency" in parameters:
        return literal_loop(observer, float(Fraction(parameters["frequency"])), design)
    return close_loop(design, OBSERVERS[observer])


def _bare(theorem: Theorem) -> dict[str, Any]:
    """What the verifier proves from the plant and the parameters alone."""
    return {"bound": {}, "witness": {}}


def _number(value: Fraction) -> dict[str, Any]:
    """A quantity that is a rational number."""
    return {"bound": {"lower": str(value), "upper": str(value)}, "witness": {}}


def _torque_constant(theorem: Theorem) -> dict[str, Any]:
    return _number(Fraction(3, 2) * Fraction(theorem["plant"]["p"]) * Fraction(theorem["plant"]["Psi"]))


def _slow_period(theorem: Theorem) -> dict[str, Any]:
    return _number(Fraction(theorem["plant"]["M"]) * Fraction(theorem["plant"]["T"]))


def _solution(theorem: Theorem) -> dict[str, Any]:
    return {"bound": {}, "witness": {"P": dualrate.lyapunov_solution(theorem["plant"])}}


def _constants(theorem: Theorem) -> dict[str, Any]:
    return {"bound": {}, "witness": {"lyapunov": dualrate.lyapunov(theorem["plant"])}}


def _prediction(theorem: Theorem) -> dict[str, Any]:
    plant = theorem["plant"]
    return {"bound": {}, "witness": {"lyapunov": dualrate.lyapunov(plant), "chi": dualrate.worst_error(plant)}}


def _ordered(theorem: Theorem) -> dict[str, Any]:
    pairs = [[_loop_of(theorem, setting) for setting in pair] for pair in theorem["parameters"]["pairs"]]
    return {"bound": {}, "witness": {"places": [dualrate.between_errors(*pair) for pair in pairs]}}


def _slower(theorem: Theorem) -> dict[str, Any]:
    other = {"observer": theorem["parameters"]["than"]}
    return {"bound": {}, "witness": dualrate.between_radii(_loop(theorem), _loop_of(theorem, other))}


MAKERS: Mapping[str, Callable[[Theorem], dict[str, Any]]] = {
    "sampled-observer": _bare,
    "error-equations": _bare,
    "contraction": _bare,
    "estimates-ordered": _bare,
    "step-bound": _bare,
    "coordinates": _bare,
    "hurwitz": _bare,
    "feedforward": _bare,
    "torque-constant": _torque_constant,
    "slow-period": _slow_period,
    "lyapunov": _solution,
    "condition": _constants,
    "counterexample": _constants,
    "prediction-bound": _prediction,
    "radius": lambda theorem: dualrate.spectral_radius(_loop(theorem)),
    "stable": lambda theorem: dualrate.stable(_loop(theorem)),
    "unstable": lambda theorem: dualrate.unstable(_loop(theorem)),
    "no-bounded-error": lambda theorem: dualrate.excited(_loop(theorem)),
    "errors-ordered": _ordered,
    "as-fast": _slower,
    "tracking-error": lambda theorem: dualrate.tracking_error(_loop(theorem)),
}

"""Makes the certificates of the wanted theorems of this paper."""

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

from papers._common import Maker, certificate
from papers.shao.method.motor import Feedforward
from papers.shao.method.readings import Structure
from papers.shao.plants import LONGER
from papers.shao.printed import COUNTEREXAMPLE, DESIGN, READINGS, literal_loop
from replication.certify import dualrate
from replication.estimation.dualrate.loop import DualRateLoop, Points, close_loop
from replication.estimation.dualrate.observers import OBSERVERS

DESIGNS = {
    **{"motor": DESIGN, "motor-from-start": DESIGN, "scalar": COUNTEREXAMPLE},
    **{f"scalar-{ratio}": replace(COUNTEREXAMPLE, ratio=ratio) for ratio in LONGER},
}
Theorem = Mapping[str, Any]


def _loop(theorem: Theorem) -> DualRateLoop:
    """The loop that a theorem is about; with its reference if there is one."""
    parameters = theorem["parameters"]
    design, observer = DESIGNS[theorem["plant"]["name"]], parameters["observer"]
    if "frequency" in parameters:
        return literal_loop(observer, float(Fraction(parameters["frequency"])), design)
    return close_loop(design, OBSERVERS[observer])


def _exactly(value: Fraction) -> dict[str, Any]:
    """A quantity that is a rational number."""
    return {"bound": {"lower": str(value), "upper": str(value)}}


def _errors(theorem: Theorem) -> dict[str, Any]:
    fields = theorem["parameters"]
    structure = Structure(feedforward=Feedforward(fields["feedforward"]))
    points = {"all": Points.BETWEEN, "fast": Points.FAST}[fields["instants"]]
    loops = (READINGS.loop(fields["observer"], structure, float(Fraction(each))) for each in fields["frequencies"])
    return {"witness": {"errors": [dualrate.tracking_error(loop, points) for loop in loops]}}


def _constants(theorem: Theorem) -> dict[str, Any]:
    return {"witness": {"lyapunov": dualrate.lyapunov(theorem["plant"])}}


MAKERS: Mapping[str, Maker] = {
    "torque-constant": lambda theorem: _exactly(
        Fraction(3, 2) * Fraction(theorem["plant"]["p"]) * Fraction(theorem["plant"]["Psi"])
    ),
    "slow-period": lambda theorem: _exactly(Fraction(theorem["plant"]["M"]) * Fraction(theorem["plant"]["T"])),
    "lyapunov": lambda theorem: {"witness": {"P": dualrate.lyapunov_solution(theorem["plant"])}},
    "condition": _constants,
    "counterexample": _constants,
    "prediction-bound": lambda theorem: {
        "witness": {**_constants(theorem)["witness"], "chi": dualrate.worst_error(theorem["plant"])}
    },
    "radius": lambda theorem: dualrate.spectral_radius(_loop(theorem)),
    "stable": lambda theorem: dualrate.stable(_loop(theorem)),
    "no-bounded-error": lambda theorem: dualrate.excited(_loop(theorem)),
    "tracking-errors": _errors,
}
make = partial(certificate, "shao", MAKERS)
"""The certificate of one entry of theorems.json."""

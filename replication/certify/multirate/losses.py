"""Certificates of gains under losses: storage functions on all that may happen, and the worst pattern found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from replication.certify.multirate.disturbances import peak_disturbance
from replication.certify.multirate.levels import LEVEL_BITS, STATE_BITS, in_units, problem_of
from replication.certify.rounding import as_floats, bracket, rounded_array
from replication.estimation import multirate
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate import losses
from replication.estimation.multirate.losses.automaton import along, automaton
from replication.estimation.multirate.losses.models import InARow
from replication.estimation.multirate.losses.worst import bracket as worst_case

LOSS_MARGIN = 1e-6
"""Relative distances of the bounds to the numbers found: room for the rounding of the storage functions."""


def least_gain(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds and witness for the gains that `losses.design` finds, rounded."""
    problem = problem_of(theorem)
    plant, schedule = problem.plant, problem.schedule
    found = losses.design(multirate.design(plant, periods=schedule.periods, offsets=schedule.offsets), _model(theorem))
    return gain_under_losses(theorem, rounded_array(found.gains["L"], STATE_BITS), found.bracket.upper)


def gain_under_losses(theorem: Mapping[str, Any], gains: Any, level: float) -> dict[str, Any]:
    """Bounds and witness for gains that follow the losses, in exact numbers; level: about that which they reach.

    Raises SolverError if no level is proved.
    """
    made = in_units({**theorem, "plant": {**theorem["plant"], "L": gains}}, level, _bounded)
    return {**made, "witness": {"L": gains, **made["witness"]}}


def _model(theorem: Mapping[str, Any]) -> InARow:
    parameters = theorem["parameters"]
    return InARow(parameters["misses"], together=bool(parameters["together"]))


def _bounded(theorem: Mapping[str, Any]) -> dict[str, Any]:
    problem = problem_of(theorem)
    given = automaton(problem, _model(theorem))
    gains = as_floats(theorem["plant"]["L"])
    worst = worst_case(problem, given, gains, given.cycles())
    system = along(problem, gains, worst.word)
    turn, v = peak_disturbance(system, l2_gain(system).angle)
    leaving = [worst.tree.out[node] for node in range(len(worst.P))]
    return {
        "bound": bracket(worst.lower, worst.upper, LOSS_MARGIN, LEVEL_BITS),
        "witness": {
            "at": [given.edges[worst.tree.edges[out[0]].origin].source for out in leaving],
            "to": [[worst.tree.edges[i].target for i in out] for out in leaving],
            "P": rounded_array(worst.P, STATE_BITS),
            "word": list(worst.word),
            "turn": turn,
            "v": v,
        },
    }

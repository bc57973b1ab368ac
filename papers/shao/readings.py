"""Readings: what is assumed where the manuscript leaves a choice. A claim or an outcome refers to one by its name."""

from __future__ import annotations

from collections.abc import Mapping

from papers.shao.method.motor import Feedforward
from papers.shao.method.readings import Start, Structure
from papers.shao.printed import HELD, PMI, SINGLE, SLOW_INPUT
from replication.audit.model import Policy, Reading
from replication.estimation.dualrate.response import Points

TABLE, FIGURES = "Sec. V and Table I", "Sec. V and Figs. 2 and 3"
LITERAL = "literal"
MEASURES: Mapping[str, tuple[Structure, Points]] = {
    LITERAL: (Structure(), Points.BETWEEN),
    "fast-instants": (Structure(), Points.FAST),
    "corrected-feedforward": (Structure(feedforward=Feedforward.CORRECTED), Points.BETWEEN),
    "corrected-feedforward-fast-instants": (Structure(feedforward=Feedforward.CORRECTED), Points.FAST),
}
"""Readings of the command and of the maximum in Table I."""
INTERPOLATIONS: Mapping[str, str] = {
    LITERAL: PMI,
    "pmi-held": HELD,
    "pmi-one-correction": SINGLE,
    "pmi-slow-input": SLOW_INPUT,
}
"""Observers that may be meant by DRC-PMI, by reading."""
STARTS: Mapping[str, Start] = {
    "start-zero": Start.ZERO,
    "start-output": Start.OUTPUT,
    "start-true": Start.TRUE,
}
"""Readings of ζ(0), which is not printed."""
SLOWEST = "slowest-mode"
EVERY = "every-open-choice"
ESTIMATES: Mapping[str, str] = {
    f"estimate-{reading}": observer for reading, observer in INTERPOLATIONS.items() if observer != SLOW_INPUT
}
"""Observers that may be meant by DRC-PMI and have a steady state, by the reading of the estimation error."""

_SETTINGS = (
    "The command is as printed and held over T; L is a gain in continuous time; all parameters are exactly the printed "
    "decimals. DRC-PMI reads observer (2), with y held over M T, at the slow instants, and the model alone carries the "
    "estimate between them."
)
_MAXIMUM = "The largest error is taken over {} of the steady state."


SHORT = {
    LITERAL: "commands as printed, DRC-PMI with a slow observer, errors over all times of the steady state",
    "estimate-literal": "DRC-PMI with a slow observer, steady state",
    SLOWEST: "the slowest mode decides",
    "elapsed-period": "the time elapsed is the whole period T",
    "surface-magnets": "a machine with surface magnets",
    "inverse-feedforward": "the feedforward is meant to invert the motor",
    "searched": "any one of the settings searched",
    "window": "any window of half a period or more",
}
"""Readings that claims lead with, in a few words."""


def _reading(name: str, place: str, text: str, policy: Policy | None = None, *, inference: bool = False) -> Reading:
    short = SHORT.get(name, "")
    return Reading(name=name, place=place, text=text, short=short, inference=inference, policy=policy)


READINGS = (
    _reading(LITERAL, TABLE, f"{_SETTINGS} {_MAXIMUM.format('all times')}"),
    _reading("fast-instants", TABLE, f"As literal, but: {_MAXIMUM.format('the fast instants').lower()}"),
    _reading(
        "corrected-feedforward",
        TABLE,
        "As literal, but ȳ_d inverts the motor: third derivative in its first term, second in its last.",
    ),
    _reading(
        "corrected-feedforward-fast-instants",
        TABLE,
        "As literal, but ȳ_d inverts the motor, and the largest error is taken over the fast instants.",
    ),
    _reading("pmi-held", TABLE, "As literal, but DRC-PMI reads observer (2) at every T, with y held over M T."),
    _reading(
        "pmi-one-correction",
        TABLE,
        "As literal, but DRC-PMI corrects by (7) once in M T, and the model alone carries the estimate between.",
    ),
    _reading(
        "pmi-slow-input",
        TABLE,
        "As literal, but the observer of DRC-PMI runs with u frozen over M T. The loop is unstable then; below (2) the "
        "text says that u is updated at each instant k T.",
        policy=Policy.RULED_OUT,
    ),
    *(
        _reading(
            f"estimate-{name}",
            FIGURES,
            f"DRC-PMI as {name}; the largest |θ − θ̂| is taken over the fast instants of the steady state.",
        )
        for name in (LITERAL, "pmi-held", "pmi-one-correction")
    ),
    *(
        _reading(name, FIGURES, f"The observer starts at ζ(0) = {start}; the rest as literal (SRC: held over M T).")
        for name, start in (("start-zero", "0"), ("start-output", "[y(0), 0, 0]"), ("start-true", "x(0)"))
    ),
    _reading(
        SLOWEST,
        "Secs. I and V, Figs. 2 and 3",
        "Transients are compared by their slowest mode, which almost every start excites: the better "
        "one decays faster, and one that is alike no slower.",
    ),
    _reading(
        EVERY,
        TABLE,
        "All stable loops together over what the text leaves open: the feedforward and the observer of DRC-PMI. "
        "Predictor (6), the forms (7) and (8), L in continuous time and an input, with its reference, that is held "
        "over T (Sec. II) are as printed. What holds must hold for each.",
    ),
    _reading(
        "steady-errors",
        "Sec. I",
        "To work alike means here: steady-state errors within five per cent at every frequency of Table I.",
    ),
    _reading(
        "bandwidths",
        "Sec. I",
        "To work alike means here: bandwidths within five per cent, at errors of 10, 29.3 and 50 per cent.",
    ),
    _reading(
        "window",
        TABLE,
        "Each number by itself, under any reading of its cell and any of the three ζ(0): the largest error is taken "
        "over a window of whole slow periods within the first hundred, half a period of the reference long or longer.",
        inference=True,
    ),
    _reading(
        "elapsed-period",
        "eq. (15)",
        "The time elapsed in (15) is the whole period T, the most that V_m allows; at t_k itself V_m is zero.",
    ),
    _reading(
        "surface-magnets",
        "Sec. V, parameters",
        "The torque constant is that of a machine with surface magnets, 1.5 p Ψ_f, which the text does not say.",
        inference=True,
    ),
    _reading(
        "inverse-feedforward",
        "Sec. V, ȳ_d",
        "The purpose of ȳ_d is to invert the motor, which the text does not say.",
        inference=True,
    ),
    _reading(
        "searched",
        TABLE,
        "Any one of the readings searched: feedforward, timing of the reference, kind of gain, form of the observer, "
        "which observers stand for the columns, ζ(0), window of time, and instants of the error.",
    ),
)

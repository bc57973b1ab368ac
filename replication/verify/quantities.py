"""What can be spoken of: quantities with their units, classes of estimators; and how two terms differ, in words."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from replication.verify.predicate import YES_NO, Exported, Term, same

QUANTITIES: Mapping[str, tuple[str, str]] = {
    # Measurements at several rates.
    "smallest gain": ("1", "the smallest worst-case gain"),
    "gain": ("1", "the worst-case gain of given gains"),
    "stable error system": (YES_NO, "the stability of the error system"),
    "excess of Theorem 1": ("1", "the relative excess of the level of Theorem 1 over the gain"),
    "excess of Theorem 2": ("1", "the relative excess of the level of Theorem 2 over the smallest gain"),
    "excess over gains of Theorem 2": ("1", "the relative excess of the level of Theorem 2 over what its gains reach"),
    "measured sensors": ("1", "which sensors are measured at each instant"),
    "common period": ("instants", "the period of the schedule"),
    "longest time unmeasured": ("instants", "the longest time without a measurement"),
    "dual-rate schedule": (YES_NO, "all sensors at the first instant of the period and none at any other"),
    "unknowns of Theorem 2": ("1", "the number of unknowns of Theorem 2"),
    "rows of Theorem 2": ("1", "the number of rows of each inequality of Theorem 2"),
    "rows of the cyclic inequality": ("1", "the number of rows of the inequality of the cyclic reformulation"),
    "unmeasured columns are zero": (YES_NO, "zero gains of the sensors that are not measured"),
    "observability": (YES_NO, "the observability of (C, A)"),
    "same poles from the next instant": (YES_NO, "the poles of A_e over a period that starts an instant later"),
    "error system (16)": (YES_NO, "the error system (16)"),
    "identity (23)": (YES_NO, "the identity (23)"),
    "Schur complement (32)": (YES_NO, "the Schur complement of (30)"),
    "poles": ("1", "the poles of A"),
    "unstable plant": (YES_NO, "a pole of A outside the unit circle"),
    "error poles": ("1", "the poles of A_e"),
    "design by Theorem 2": (YES_NO, "an observer by Theorem 2"),
}
"""Unit and words of each quantity that can be spoken of."""

ESTIMATORS: Mapping[str, str] = {
    "periodic one-step observers": "observer that predicts one step",
    "one-step predictors": "predicts one step",
    "all estimators": "no estimator, not even a smoother",
}
"""Each class of estimators, with the words by which the sentence of a theorem on it names it."""


def unit_of(quantity: str) -> str:
    """The unit of a quantity; empty for one that is not known."""
    return QUANTITIES.get(quantity, ("", ""))[0]


def differences(wanted: Term, reading: str, proved: Exported) -> list[str]:
    """How a theorem falls short of speaking of a term under a reading, in words; empty if it does speak of it."""
    found = []
    of = proved.of
    if of.quantity != wanted.quantity:
        found.append(f"it is about {_words(of.quantity)}, not {_words(wanted.quantity)}")
    if of.plant != wanted.plant:
        found.append(f"another plant: {of.plant or 'all'}, not {wanted.plant or 'all'}")
    for name in sorted(of.setting.keys() | wanted.setting.keys()):
        there, asked = of.setting.get(name), wanted.setting.get(name)
        if not same(there, asked):
            instance = name in of.setting and name not in wanted.setting
            told = "of all" if instance else f"not {_shown(asked)}" if name in wanted.setting else ""
            found.append(f"for {name} {_shown(there)} {told}" if name in of.setting else f"not for {name} {told[4:]}")
    if of.estimators != wanted.estimators:
        found.append(f"for {of.estimators or 'no class of estimators'}, not for {wanted.estimators or 'none'}")
    if reading not in proved.readings:
        found.append(f"under the reading {' or '.join(proved.readings)} only, not {reading}")
    return found


def _words(quantity: str) -> str:
    return QUANTITIES.get(quantity, ("", quantity))[1]


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)

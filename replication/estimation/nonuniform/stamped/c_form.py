"""Estimators with time stamps as one C99 file: the transition over any period, no allocation, no globals."""

from __future__ import annotations

from collections.abc import Mapping
from string import Template

from replication.estimation.api.export import c_array, c_name, comment_text
from replication.estimation.nonuniform.stamped.c_parts import FIXED, RUNNING, SOURCE
from replication.estimation.nonuniform.stamped.transition import DEGREE, SHORT, Transition
from replication.estimation.validation import Array

PARTS = ("kept", "begun", "places", "refused", "moved", "corrected")


def c_form(
    name: str,
    comment: str,
    transition: Transition,
    output: Array,
    inputs: int,
    own: Mapping[str, Array],
) -> str:
    """The C99 source; `name` begins every name in it, `comment` stands at the top.

    output: C; inputs: how many of those of `transition` are known. own: "gain" and "edges", G of a filter by the
    period before; or "noise" and "start", R and P0 of a Kalman filter. Raises InvalidInputError if `name` is no C
    identifier.
    """
    n, held = transition.order, transition.inputs - inputs
    parts = FIXED if "gain" in own else RUNNING
    arrays = {"table": transition.table, "output": output, **own}
    names = {"n": c_name(name), "M": name.upper()}
    return SOURCE.substitute(
        **names,
        comment=comment_text(comment),
        missing=Template(parts["missing"]).substitute(names),
        order=n,
        inputs=inputs,
        held=held,
        cells=len(own["gain"]) if "gain" in own else 1,
        measurements=len(output),
        degree=DEGREE,
        columns=transition.table.shape[2],
        arrays="\n".join(c_array(f"{name}_{key}", array) for key, array in arrays.items()),
        rate=repr(transition.rate),
        short=repr(SHORT),
        **{key: Template(parts[key]).substitute(names) for key in PARTS},
    )

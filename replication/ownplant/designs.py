"""From a plant file to a design: one function for each method, which calls the library's `design` or `analyse`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from replication.errors import InvalidInputError
from replication.estimation import delay, dualrate, multirate, nonuniform
from replication.estimation.api.results import GainResult
from replication.ownplant.reading import PlantFile
from replication.ownplant.searching import every_core


def design_multirate(
    plant: PlantFile,
    *,
    periods: Sequence[int],
    offsets: Sequence[int] | Literal["best"] = (),
    level: float | None = None,
    timings: Path | None = None,
) -> GainResult:
    """`multirate.design` of the plant in a file; all timings are searched on every core, and kept in `timings`."""
    made = multirate.MultiratePlant(**plant.values)
    if offsets == "best":
        offsets = multirate.search_timing(made, periods, apply=partial(every_core, store=timings)).best
    return _named(plant, multirate.design(made, periods=periods, offsets=offsets, level=level))


def design_nonuniform(plant: PlantFile, *, periods: Sequence[float], **effort: Any) -> GainResult:
    """`nonuniform.design` of the plant in a file; effort: goal, leaves, horizon."""
    made = nonuniform.SampledPlant(**plant.values)
    return _named(plant, nonuniform.design(made, periods=periods, **effort))


def design_dualrate(plant: PlantFile, **loop: Any) -> GainResult:
    """`dualrate.analyse` with the gains K and L of the file, `dualrate.design` if it has none; loop: its arguments."""
    values = plant.values
    made = dualrate.make_plant(values["A"], values["B"], values["C"])
    if ("K" in values) != ("L" in values):
        raise InvalidInputError("the file has one of K and L; give both gains, or none to have them designed")
    if "K" in values:
        return _named(plant, dualrate.analyse(made, feedback=values["K"], injection=values["L"], **loop))
    return _named(plant, dualrate.design(made, **loop))


def design_delay(plant: PlantFile, **options: Any) -> GainResult:
    """`delay.design` of the plant in a file; options: its arguments."""
    values = plant.values
    made = delay.delay_system(
        values["A0"], values["A"], values["delays"], values["B"], values["C10"], values["C2"], values.get("C1")
    )
    return _named(plant, delay.design(made, **options))


DESIGNS = {
    "multirate": design_multirate,
    "nonuniform": design_nonuniform,
    "dualrate": design_dualrate,
    "delay": design_delay,
}


def _named(plant: PlantFile, result: GainResult) -> GainResult:
    """The result with the names that the file gives; estimated outputs that are the states are called like them."""
    own, given = result.signals, plant.names
    states = given.get("states", own.states)
    signals = replace(
        own,
        states=states,
        inputs=given.get("inputs", own.inputs),
        measurements=given.get("measurements", own.measurements),
        outputs=given.get("outputs", states if own.outputs == own.states else own.outputs),
    )
    return replace(result, signals=signals)

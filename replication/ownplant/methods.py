"""The four methods: what a plant file holds, the options of the command line, how plant and design are made.

One `Method` describes each, its keys and options in `methods.toml`; the reader of plant files, the parser of the
command line and its help derive from it. Nothing heavy is imported before a design is made.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from replication.errors import InvalidInputError
from replication.estimation import delay, dualrate, multirate, nonuniform
from replication.estimation.multirate import losses
from replication.ownplant.fields import Field, Option
from replication.ownplant.searching import every_core

if TYPE_CHECKING:
    from replication.estimation.api.results import GainResult

Values = Mapping[str, Any]


@dataclass(frozen=True)
class Method:
    """Keys of the plant file, options of the command line; design: called with the values of both, by name."""

    name: str
    summary: str
    fields: tuple[Field, ...]
    options: tuple[Option, ...]
    design: Callable[..., GainResult]

    def described(self) -> str:
        """The keys of the plant file, one line each, for the help of the command line."""
        width = max(len(field.name) for field in self.fields)
        return "\n".join(f"  {field.name:<{width}}{field.described()}" for field in self.fields)


COVARIANCES = {"Q", "R", "S"}
"""Keys of a plant whose noise is given by covariances."""


LOSSES = ("misses", "lost", "burst", "packets")
"""Options that make a model of losses, for which `multirate.losses.design` finds gains."""


def _multirate(values: Values, *, timings: Any = None, **options: Any) -> GainResult:
    """All timings are searched on every core, and kept in the directory `timings`."""
    model = _losses(options)
    options = {name: value for name, value in options.items() if name not in LOSSES}
    plant = _sampled(values)
    # What the command line says counts more than the file.
    options = {name: values[name] for name in ("P0", "goal") if name in values} | options
    if "latency" in values:
        options.setdefault("latency", [age / values.get("dt", 1.0) for age in values["latency"]])
    if options.get("offsets") == "best" and options.get("goal") != "h2" and "latency" not in options:
        apply = partial(every_core, store=timings)
        options["offsets"] = multirate.search_timing(plant, options["periods"], apply=apply).best
    best = multirate.design(plant, **options)
    return best if model is None else losses.design(best, model)


def _sampled(values: Values) -> Any:
    """The plant of the file, in discrete time or, with A_c, in continuous time."""
    fields = {name: value for name, value in values.items() if name not in ("P0", "goal", "latency")}
    if "A_c" in fields:
        if "A" in fields or "dt" not in fields or "S" in fields:
            raise InvalidInputError("A_c needs the base period dt (s), and takes the place of A; S goes with A alone")
        return multirate.ContinuousPlant(A=fields.pop("A_c"), **fields)
    return multirate.MultiratePlant.from_covariances(**fields)


def _losses(options: Values) -> Any:
    """The model of losses that the options give; None without one."""
    misses, lost, burst = (options.get(name) for name in LOSSES[:3])
    together = options.get("packets") == "together"
    if misses is not None and (lost is not None or burst is not None):
        raise InvalidInputError("give misses, for the worst case, or lost, for the mean error, but not both")
    if burst is not None and lost is None:
        raise InvalidInputError(
            "burst is the probability of a loss after a loss; give lost, that after an arrival, too"
        )
    if misses is not None:
        return losses.InARow(misses, together=together)
    if lost is None:
        return None
    return (
        losses.Independent(lost, together=together) if burst is None else losses.Markov(lost, burst, together=together)
    )


KNOWN, UNKNOWN = "known", "unknown"
"""Whether the filter knows the periods, by the time stamps of the samples."""


def _nonuniform(values: Values, **options: Any) -> GainResult:
    """The filter of form (4), or where the time stamps of the samples are known the one that takes them."""
    # What the command line says counts more than the file.
    stamps = options.pop("stamps", values.get("stamps", UNKNOWN))
    if stamps not in (KNOWN, UNKNOWN):
        raise InvalidInputError(f'stamps: must be "{KNOWN}" or "{UNKNOWN}", got {stamps!r}')
    plant = {name: values[name] for name in "ABCDL"}
    if stamps == KNOWN:
        if unused := [*{"goal", "leaves"} & options.keys()]:
            raise InvalidInputError(
                f"{', '.join(sorted(unused))}: for a filter that takes no time stamps; leave either out"
            )
        return nonuniform.design_stamped(nonuniform.StampedPlant(**plant), B_u=values.get("B_u"), **options)
    if unused := [*{"B_u", "cells"} & {*values, *options}]:
        raise InvalidInputError(
            f"{', '.join(sorted(unused))}: for a filter that takes time stamps; leave either out, or write stamps = "
            f'"{KNOWN}" in the file if each sample has one'
        )
    return nonuniform.design(nonuniform.SampledPlant(**plant), **options)


WEIGHTS = ("state_weight", "input_weight", "process_noise", "sensor_noise")


def _dualrate(values: Values, **options: Any) -> GainResult:
    """The loop with the gains K and L of the file, or with designed ones if it has none."""
    plant = dualrate.make_plant(values["A"], values["B"], values["C"])
    weights = {name: values[name] for name in WEIGHTS if name in values}
    if len(options["ratio"]) == 1:
        (options["ratio"],) = options["ratio"]
    if ("K" in values) != ("L" in values):
        raise InvalidInputError("the file has one of K and L; give both gains, or none to have them designed")
    if "K" not in values:
        return dualrate.design(plant, **weights, **options)
    if unused := [*weights, *(name for name in ("at", "goal", "level", "hold") if name in options)]:
        raise InvalidInputError(f"{', '.join(unused)}: for a design; the file has gains K and L, so leave either out")
    return dualrate.analyse(plant, feedback=values["K"], injection=values["L"], **options)


PLAIN = {"A0", "A", "delays", "B", "C10", "C1", "C2"}
"""Keys of a plant with delayed states alone, whose measurements are free of noise."""


def _delay(values: Values, **options: Any) -> GainResult:
    """The observer of Peet and Gu, or with noise, delayed measurements or known inputs the one on the innovation."""
    fields = {name if name in COVARIANCES else name.lower(): value for name, value in values.items() if name != "goal"}
    if "goal" in values:
        options.setdefault("goal", values["goal"])
    make: Callable[..., Any] = delay.delay_system if PLAIN.issuperset(values) else delay.DelayPlant
    if not COVARIANCES.isdisjoint(values):
        if missing := COVARIANCES - {"S"} - values.keys():
            raise InvalidInputError(f"{missing.pop()} is missing; Q and R, the intensities of the noise, go together")
        make = delay.DelayPlant.from_covariances
    return delay.design(make(**fields), **options)


def _methods(designs: Mapping[str, Callable[..., GainResult]]) -> Iterator[Method]:
    """As `methods.toml` describes them."""
    tables = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    for name, design in designs.items():
        fields = tuple(Field.of(key, **row) for key, row in tables[name]["fields"].items())
        options = tuple(Option.of(key, **row) for key, row in tables[name]["options"].items())
        yield Method(name, tables[name]["summary"], fields, options, design)


METHODS: Mapping[str, Method] = {
    method.name: method
    for method in _methods({"multirate": _multirate, "nonuniform": _nonuniform, "dualrate": _dualrate, "delay": _delay})
}

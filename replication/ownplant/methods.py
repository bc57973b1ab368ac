"""The four methods as data: what a plant file holds, the options of the command line, how plant and design are made.

One `Method` describes each; the reader of plant files, the parser of the command line and its help derive from it.
Nothing heavy is imported before a design is made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from replication.errors import InvalidInputError
from replication.estimation import delay, dualrate, multirate, nonuniform
from replication.estimation.multirate import losses
from replication.ownplant.fields import (
    Field,
    Kind,
    Option,
    age,
    listed,
    matrix,
    natural,
    offsets,
    positive,
    probability,
    two,
    up_to,
    whole,
)
from replication.ownplant.searching import every_core

if TYPE_CHECKING:
    from replication.estimation.api.results import GainResult

Values = Mapping[str, Any]


@dataclass(frozen=True)
class Method:
    """One method as a user of files meets it.

    fields: keys of the plant file; options: of the command line; design: called with the values of the file by field
    and with the options that were given, by name.
    """

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


AIMS = "least worst-case gain, least mean error (Kalman), or between both (hinf)"
"""What the option goal is."""

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
    given = {name: value for name, value in values.items() if name not in ("P0", "goal", "latency")}
    if "A_c" in given:
        if "A" in given or "dt" not in given or "S" in given:
            raise InvalidInputError("A_c needs the base period dt (s), and takes the place of A; S goes with A alone")
        return multirate.ContinuousPlant(A=given.pop("A_c"), **given)
    if COVARIANCES.isdisjoint(values) and {"B_d", "D"} <= values.keys():
        return multirate.MultiratePlant(**given)
    return multirate.MultiratePlant.from_covariances(**given)


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
    given = {name if name in COVARIANCES else name.lower(): value for name, value in values.items() if name != "goal"}
    if "goal" in values:
        options.setdefault("goal", values["goal"])
    make: Callable[..., Any] = delay.delay_system if PLAIN.issuperset(values) else delay.DelayPlant
    if not COVARIANCES.isdisjoint(values):
        if missing := COVARIANCES - {"S"} - values.keys():
            raise InvalidInputError(f"{missing.pop()} is missing; Q and R, the intensities of the noise, go together")
        make = delay.DelayPlant.from_covariances
    return delay.design(make(**given), **options)


def _late(name: str, rows: str, columns: str, meaning: str) -> Field:
    """One matrix for each delay."""
    return Field(name, Kind.MATRICES, ("k", rows, columns), required=False, meaning=meaning)


METHODS: Mapping[str, Method] = {
    method.name: method
    for method in (
        Method(
            "multirate",
            "sensors with different periods, in discrete time",
            (
                matrix("A", "n", "n", "x+ = A x + B_u u + B_d d", instead="A_c"),
                matrix(
                    "A_c", "n", "n", "x' = A_c x + B_u u + B_d d, in place of A: inputs held over dt", required=False
                ),
                matrix("B_d", "n", "m", "process noise d (the identity if Q is given)", instead="Q"),
                matrix("C", "q", "n", "sensors, y = C x + D_u u + D w"),
                matrix("D", "q", "w", "sensor noise w, or give R", instead="R"),
                matrix("Q", "m", "m", "covariance of d (the identity)", required=False),
                Field("R", Kind.COVARIANCE, ("q", "q"), False, "covariance of the sensor noise, in place of D"),
                matrix("S", "m", "q", "covariance of d and the sensor noise (zero)", required=False),
                matrix("P0", "n", "n", "covariance of the error of the start, for the goal h2", required=False),
                matrix("W", "z", "n", "weight of the error (identity)", required=False),
                matrix("B_u", "n", "u", "known inputs (none)", required=False),
                matrix("D_u", "q", "u", "known inputs in the measurements (zero)", required=False),
                Field("latency", Kind.AGES, ("q",), False, "age of a sample when it is used, in s (zeros)"),
                Field("dt", Kind.TIME, (), required=False, meaning="base period in s (1)"),
                Field("goal", Kind.WORD, (), required=False, meaning="hinf, h2 or mixed (hinf); as the option"),
            ),
            (
                Option("periods", listed(whole), "N,N", "of each sensor, in base periods: 2,3", required=True),
                Option("offsets", offsets, "K,K", "of each sensor (default: zeros), or: best"),
                Option("level", positive, "G", "a level to keep (default: the least)"),
                Option("goal", str, None, AIMS, choices=("hinf", "h2", "mixed")),
                Option("latency", listed(age), "L,L", "age of the samples of each sensor when used, in base periods"),
                Option("misses", listed(natural), "M,M", "samples lost in a row at most: gains and level for them"),
                Option("lost", listed(probability), "P,P", "probability of a loss (after an arrival, with --burst)"),
                Option("burst", listed(probability), "P,P", "probability of a loss after a loss"),
                Option("packets", str, None, "how samples of one instant travel", choices=("separate", "together")),
            ),
            _multirate,
        ),
        Method(
            "nonuniform",
            "sampling periods that vary within a range",
            (
                matrix("A", "n", "n", "x' = A x + B w"),
                matrix("B", "n", "m", "disturbance, held between samples"),
                matrix("C", "q", "n", "sensors, y = C x + D w"),
                matrix("D", "q", "m", "sensor noise"),
                matrix("L", "z", "n", "what is estimated, z = L x"),
                Field("stamps", Kind.WORD, (), required=False, meaning="known or unknown; as the option"),
                matrix("B_u", "n", "u", "known inputs in x', held; with stamps (none)", required=False),
            ),
            (
                Option("periods", two(positive), "H,H", "shortest and longest period in s: 0.1,0.3", required=True),
                Option(
                    "stamps",
                    str,
                    None,
                    "whether each sample has a time stamp that the filter takes (unknown)",
                    choices=(KNOWN, UNKNOWN),
                ),
                Option("cells", up_to(64), "N", "with stamps: parts of the range, each with a gain (8)"),
                Option("goal", str, None, "for the range, or for its middle (robust)", choices=("robust", "nominal")),
                Option("leaves", up_to(200), "N", "Lyapunov matrices of the guarantee"),
                Option("horizon", up_to(20_000), "N", "samples of the worst sequence searched for"),
            ),
            _nonuniform,
        ),
        Method(
            "dualrate",
            "output feedback with a slow sensor",
            (
                matrix("A", "n", "n", "x' = A x + B u"),
                matrix("B", "n", "u", "input, held over the fast period"),
                matrix("C", "q", "n", "sensor, y = C x"),
                matrix("K", "u", "n", "feedback u = K x^ (linear-quadratic)", required=False),
                matrix("L", "n", "q", "observer gain (Kalman)", required=False),
                matrix("state_weight", "n", "n", "Q of x'Qx + u'Ru (C'C)", required=False),
                matrix("input_weight", "u", "u", "R of x'Qx + u'Ru (identity)", required=False),
                matrix("process_noise", "n", "n", "its intensity (BB')", required=False),
                matrix("sensor_noise", "q", "q", "intensity, or --at slow: covariance of a reading", required=False),
            ),
            (
                Option("period", positive, "T", "fast period of the input in s", required=True),
                Option("ratio", listed(up_to(2_000)), "M", "the sensor delivers every M T; or M,M", required=True),
                Option("at", str, None, "where gains are designed (continuous)", choices=("continuous", "slow")),
                Option("goal", str, None, "of a design at the slow rate (h2)", choices=("h2", "hinf", "mixed")),
                Option("level", positive, "G", "a level to keep, with --goal hinf (1 % above the least) or mixed"),
                Option("hold", listed(up_to(2_000)), "M,M", "--at slow: inputs change every M T (1)"),
                Option("tracked", listed(natural), "I,I", "outputs, from 0, at set-points; at rest under loads (all)"),
                Option("observer", str, "NAME", "what fills the instants between (running_prediction)"),
            ),
            _dualrate,
        ),
        Method(
            "delay",
            "states, measurements or inputs that act with a delay",
            (
                matrix("A0", "n", "n", "x' = A0 x + sum of A[i] x(t - delays[i]) + B w"),
                Field("A", Kind.MATRICES, ("k", "n", "n"), meaning="one matrix for each delay"),
                Field("delays", Kind.TIMES, ("k",), meaning="increasing, in s"),
                matrix("B", "n", "m", "disturbance"),
                matrix("C10", "z", "n", "what is estimated, z = C10 x + sum of C1[i] x(t - delays[i])"),
                Field("C1", Kind.MATRICES, ("k", "z", "n"), required=False, meaning="one matrix for each delay (zero)"),
                matrix("C2", "q", "n", "sensors, y = C2 x + sum of C2_delayed[i] x(t - delays[i]) + D21 w + .."),
                _late("C2_delayed", "q", "n", "delayed measurements (zero)"),
                matrix("D21", "q", "m", "sensor noise (zero)", required=False),
                _late("D21_delayed", "q", "m", "delayed sensor noise (zero)"),
                matrix("Q", "m", "m", "intensity of the disturbance, with R (the identity)", required=False),
                Field("R", Kind.COVARIANCE, ("q", "q"), False, "intensity of the sensor noise, in place of D21"),
                matrix("S", "m", "q", "intensity of both together (zero)", required=False),
                _late("B_delayed", "n", "m", "delayed disturbances in x' (zero)"),
                matrix("D11", "z", "m", "disturbance in what is estimated (zero)", required=False),
                matrix("B_u", "n", "u", "known inputs in x' (none)", required=False),
                _late("B_u_delayed", "n", "u", "delayed known inputs in x' (none)"),
                _late("A_spread", "n", "n", "in x', times the mean of x over the last delays[i] (zero)"),
                _late("C1_spread", "z", "n", "in what is estimated, times that mean (zero)"),
                _late("C2_spread", "q", "n", "in the measurements, times that mean (zero)"),
                matrix("ranges", "k", "ends", "shortest and longest delays, where they are uncertain", required=False),
                Field("goal", Kind.WORD, (), required=False, meaning="hinf, h2 or mixed (hinf); as the option"),
            ),
            (
                Option("goal", str, None, AIMS, choices=("hinf", "h2", "mixed")),
                Option("degree", up_to(20), "D", "of the polynomials of the proof (3, less for large plants)"),
                Option(
                    "rule",
                    str,
                    "NAME",
                    "of the degrees without noise: bessel, tensor, total, outer, inner or wide (bessel)",
                ),
                Option("margin", positive, "R", "distance from the least level (0.05)"),
                Option("level", positive, "G", "a level to keep, in place of the margin; of the design with mixed"),
                Option("order", up_to(400), "N", "points of each history less one (24)"),
            ),
            _delay,
        ),
    )
}

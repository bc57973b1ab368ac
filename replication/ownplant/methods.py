"""The four methods: what a plant file holds, the options of the command line, how plant and design are made.

One `Method` describes each, its keys and options in `methods.toml`; the reader of plant files, the parser of the
command line and its help derive from it. Nothing heavy is imported before a design is made. The letters of a shape
stand for numbers that must agree within a file: n states, u known inputs, q sensors, and so on.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar, get_type_hints

from replication import __version__
from replication.errors import InvalidInputError
from replication.estimation import delay, dualrate, multirate, nonuniform
from replication.estimation.multirate import losses
from replication.files import sha256, write_atomically

if TYPE_CHECKING:
    from replication.estimation.api.results import GainResult

T = TypeVar("T")
U = TypeVar("U")
Values = Mapping[str, Any]
LARGEST = 1e60
"""Of an entry; the methods take powers of entries, which must stay in the range of floating point."""


class Kind(StrEnum):
    """How a value is written in the file; the text is the advice."""

    TIME = "a positive number, such as 0.1"
    TIMES = "a list of positive numbers, such as [0.1, 0.2]"
    AGES = "a list of numbers from 0 on, such as [0, 0.15]"
    MATRIX = "a list of rows, such as [[1, 0], [0, 1]]"
    WORD = 'a word in quotes, such as "h2"'
    COVARIANCE = "a list of rows, such as [[1, 0], [0, 1]], or of variances, such as [1, 1]"
    MATRICES = "a list of matrices, such as [[[1, 0], [0, 1]]]"


@dataclass(frozen=True)
class Field:
    """One key of a plant file; shape: its letters, (rows, columns) for a matrix, with the count first for several.

    instead: a key that may stand in the place of a required one.
    """

    name: str
    kind: Kind
    shape: tuple[str, ...] = ()
    required: bool = True
    meaning: str = ""
    instead: str = ""

    @classmethod
    def of(cls, name: str, *, shape: str = "", kind: str = "", optional: bool = False, **attributes: str) -> Self:
        """From a row of `methods.toml`; a matrix, or several if there are three letters, unless it says otherwise."""
        letters = tuple(shape.split())
        kind = kind or ("matrices" if len(letters) == 3 else "matrix")
        return cls(name, Kind[kind.upper()], letters, not optional, **attributes)


NAMES = {"states": "n", "inputs": "u", "measurements": "q", "outputs": "z"}
"""Lists of the table [names], and the letter that says how many there are."""


def argument(*, read: str = "word", most: int = 0, several: bool = False, **settings: Any) -> dict[str, Any]:
    """What `ArgumentParser.add_argument` takes, from a row of `methods.toml`."""
    reader = partial(whole, most=most) if most else READERS[read]
    return {"type": partial(listed, reader=reader) if several else reader, **settings}


def listed(text: str, reader: Callable[[str], T]) -> list[T]:
    """Values that commas separate."""
    return [reader(part.strip()) for part in text.split(",")]


def offsets(text: str) -> list[int] | str:
    """A list of whole numbers from zero on, or the word `best`."""
    return text if text == "best" else listed(text, partial(whole, least=0))


def age(text: str) -> float:
    """A number from zero on."""
    return 0.0 if text.strip("0.") == "" and "0" in text else positive(text)


def probability(text: str) -> float:
    """A number from zero to one."""
    if age(text) > 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a probability from 0 to 1")
    return age(text)


def whole(text: str, least: int = 1, most: int | None = None) -> int:
    """A whole number from `least` on, and to `most`, beyond which a design takes hours."""
    if not text.isascii() or not text.isdecimal() or len(text) > 9 or int(text) < least:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from {least} on")
    if most is not None and int(text) > most:
        raise argparse.ArgumentTypeError(f"{text!r} is more than {most}; the library takes what the memory allows")
    return int(text)


def positive(text: str) -> float:
    """A positive number whose powers stay in the range of floating point."""
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    if not 1 / LARGEST <= number <= LARGEST:
        raise argparse.ArgumentTypeError(f"{text!r} is not from {1 / LARGEST:g} to {LARGEST:g}; choose other units")
    return number


READERS: dict[str, Callable[[str], Any]] = {
    "word": str, "offsets": offsets, "age": age, "probability": probability, "natural": partial(whole, least=0),
    "whole": whole, "positive": positive,
}  # fmt: skip
"""Of one value, by the name that `methods.toml` has for them."""


KEPT = "kept"
"""The folder of a store that holds the values; what else lies in the store is not ours."""
FEW = 8
"""Up to so many the processes would take longer to start than to compute."""


def every_core(function: Callable[[T], U], items: Sequence[T], *, store: Path | None = None) -> Iterator[U]:
    """The values of `function` in the order of `items`, as `map` gives them, by one process per core.

    store: a directory in which each value is kept as soon as it is there; what an earlier run with the same version of
    this package left there is not computed again. Those of a partial function are kept, whose return type is declared.
    On a terminal a bar on standard error shows how many are done, and an estimate of the time left.
    """
    import joblib
    from rich.console import Console
    from rich.progress import track

    value: Callable[[T], U] = function
    if store is not None and isinstance(function, partial):
        value = partial(_kept, store / KEPT, function)
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        yield from track(
            joblib.Parallel(-1 if len(items) > FEW else 1, return_as="generator")(
                joblib.delayed(value)(item) for item in items
            ),
            "timings",
            total=len(items),
            console=Console(stderr=True),
            transient=True,
            disable=not sys.stderr.isatty(),
        )


def forget(store: Path) -> None:
    """Remove what `every_core` kept in a store, and the directory if nothing else lies there."""
    shutil.rmtree(store / KEPT, ignore_errors=True)
    if store.is_dir() and not any(store.iterdir()):
        store.rmdir()


def _kept(folder: Path, function: partial[U], item: Any) -> U:
    """The value from its file, else computed and written there.

    The folder may be a stranger's: its files are read as JSON of the type that the function returns, never as objects
    that bring code along, and one that is not whole is computed again.
    """
    import msgspec

    called = [__version__, function.func.__module__, function.func.__qualname__, function.args, item]
    key = sha256(msgspec.json.encode(called, enc_hook=_plain, order="deterministic"))
    path = folder / f"{key}.json"
    try:
        checksum, _, text = path.read_bytes().partition(b"\n")
        if checksum == sha256(key.encode() + text).encode():
            result: U = msgspec.json.decode(text, type=get_type_hints(function.func)["return"])
            return result
    except (OSError, msgspec.DecodeError):
        pass
    value = function(item)
    text = msgspec.json.encode(value)
    write_atomically(path, sha256(key.encode() + text).encode() + b"\n" + text)
    return value


def _plain(argument: Any) -> Any:
    """An array or a path among the arguments as JSON can hold it."""
    return argument.tolist() if hasattr(argument, "tolist") else str(argument)


@dataclass(frozen=True)
class Method:
    """Keys of the plant file; options of the command line by name, each with the settings of its argument.

    design: called with the values of both, by name.
    """

    name: str
    summary: str
    fields: tuple[Field, ...]
    options: Mapping[str, Mapping[str, Any]]
    design: Callable[..., GainResult]

    def described(self) -> str:
        """The keys of the plant file, one line each, for the help of the command line."""
        width, lines = max(len(field.name) for field in self.fields), []
        for field in self.fields:
            shape = f" ({', '.join(field.shape)})" if field.shape else ""
            lines.append(f"  {field.name:<{width}}{shape}  {field.meaning}{'' if field.required else ', optional'}")
        return "\n".join(lines)


COVARIANCES = {"Q", "R", "S"}
"""Keys of a plant whose noise is given by covariances."""


LOSSES = ("misses", "lost", "burst", "packets")
"""Options that make a model of losses, for which `multirate.losses.design` finds gains."""


def _multirate(values: Values, *, timings: Any = None, **options: Any) -> GainResult:
    """All timings are searched on every core, and kept in the directory `timings`."""
    model, plant = _losses(*(options.pop(name, None) for name in LOSSES)), _sampled(values)
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


def _losses(misses: Any, lost: Any, burst: Any, packets: Any) -> Any:
    """The model of losses that the options give; None without one."""
    if misses is not None and (lost is not None or burst is not None):
        raise InvalidInputError("give misses, for the worst case, or lost, for the mean error, but not both")
    if burst is not None and lost is None:
        raise InvalidInputError(
            "burst is the probability of a loss after a loss; give lost, that after an arrival, too"
        )
    model = losses.InARow if misses is not None else losses.Independent if burst is None else losses.Markov
    given = [part for part in (misses, lost, burst) if part is not None]
    return model(*given, together=packets == "together") if given else None


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


TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
DESIGNS = {"multirate": _multirate, "nonuniform": _nonuniform, "dualrate": _dualrate, "delay": _delay}
METHODS: Mapping[str, Method] = {
    name: Method(
        name,
        TABLES[name]["summary"],
        tuple(Field.of(key, **row) for key, row in TABLES[name]["fields"].items()),
        {key: argument(**row) for key, row in TABLES[name]["options"].items()},
        design,
    )
    for name, design in DESIGNS.items()
}

"""`replication design`: an estimator for a plant of one's own, from a file, with the level that it guarantees."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from replication.commands.shared import FAILED, FINE, say
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.ownplant.fields import FIELDS, described

if TYPE_CHECKING:
    from replication.estimation.api.results import GainResult
    from replication.ownplant.reading import PlantFile

TEXT = "design an estimator for a plant of your own, given in a file"
NOTES = """The plant file is TOML; `replication design METHOD --help` lists its keys. Gains (JSON, MATLAB, C), a figure
and a page go to ./NAME-METHOD/, NAME being that of the file; they appear at once or not at all. If no estimator is
found the exit code is 3. With --certificate the verifier proves what it can of the design, and
NAME-METHOD.certificate.json lies beside the gains; `python -m replication verify FILE` checks it again.

"""
T = TypeVar("T")
SUMMARIES = {
    "multirate": "sensors with different periods, in discrete time",
    "nonuniform": "sampling periods that vary within a range",
    "dualrate": "output feedback with a slow sensor",
    "delay": "states that act with a delay",
}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add a parser for each method."""
    methods = parser.add_subparsers(required=True, metavar="METHOD", dest="method")
    for method, add in zip(FIELDS, (_multirate, _nonuniform, _dualrate, _delay), strict=True):
        added = methods.add_parser(
            method,
            help=SUMMARIES[method],
            description=f"{SUMMARIES[method][0].upper()}{SUMMARIES[method][1:]}.",
            epilog=f"keys of the plant file:\n{described(method)}\n\n{parser.epilog}",
            formatter_class=parser.formatter_class,
        )
        added.add_argument("plant", type=Path, metavar="FILE", help="the plant, a TOML file")
        add(added)
        added.add_argument("--output", type=Path, metavar="DIR", help="where the design goes (default: ./NAME-METHOD)")
        added.add_argument("--certificate", action="store_true", help="prove the design, and write what proves it")
        added.add_argument("--force", action="store_true", help="replace an earlier design there")


def command(chosen: argparse.Namespace) -> int:
    """Read, design, print what is guaranteed, write."""
    from replication.ownplant.designs import DESIGNS
    from replication.ownplant.reading import read_plant
    from replication.ownplant.searching import forget
    from replication.ownplant.writing import require_free, write_design

    plant = read_plant(chosen.plant, chosen.method)
    directory = chosen.output or Path(f"{plant.name}-{plant.method}")
    certificate = f"{plant.name}-{plant.method}.certificate.json"
    require_free(directory, replace=chosen.force, proof=certificate)
    options = {name: value for name, value in vars(chosen).items() if name in OPTIONS[chosen.method]}
    given = {name: value for name, value in options.items() if value is not None}
    # A search that was killed goes on from here.
    timings = directory.with_name(f"{directory.name}.timings")
    if searched := given.get("offsets") == "best":
        given["timings"] = timings
    try:
        result = DESIGNS[chosen.method](plant, **given)
        proof, proved = _proof(plant, result, certificate) if chosen.certificate else ({}, [])
    except InvalidInputError as error:
        raise InvalidInputError(f"{chosen.plant}: {error}") from None
    except (InfeasibleError, SolverError) as error:
        print(f"replication: {chosen.plant}: {error}", file=sys.stderr)
        return FAILED
    write_design(directory, plant, result, _call(chosen, options), proof)
    if searched:
        forget(timings)
    say([*str(result).splitlines(), *proved, f"written: {directory}"])
    return FINE


def _proof(plant: PlantFile, result: GainResult, file: str) -> tuple[dict[str, bytes], list[str]]:
    """The file of the certificate, and the line that says what it proves; raises as `certified` does."""
    from replication.audit.run.certify import to_json
    from replication.certify.own import certified

    certificate, sentence = certified(result, plant.name, as_written=True)
    return {file: to_json(certificate)}, [f"proved: {sentence}"]


OPTIONS = {
    "multirate": ("periods", "offsets", "level"),
    "nonuniform": ("periods", "goal", "leaves", "horizon"),
    "dualrate": ("period", "ratio", "observer"),
    "delay": ("degree", "rule", "margin", "level", "order"),
}
"""Options that are passed on to the design; the others say what becomes of it."""


def _call(chosen: argparse.Namespace, options: dict[str, Any]) -> str:
    """The command line that makes the same design again."""
    words = ["replication", "design", chosen.method, chosen.plant.name]
    for name, value in options.items():
        if value is not None:
            text = ",".join(str(part) for part in value) if isinstance(value, (list, tuple)) else str(value)
            words += [f"--{name}", text]
    words += ["--certificate"] * chosen.certificate
    return shlex.join(words)


def _multirate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--periods", type=_wholes, required=True, metavar="N,N", help="of each sensor, in base periods: 2,3"
    )
    parser.add_argument("--offsets", type=_offsets, metavar="K,K", help="of each sensor (default: zeros), or: best")
    parser.add_argument("--level", type=_positive, metavar="G", help="a level to keep (default: the least)")


def _nonuniform(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--periods",
        type=_range,
        required=True,
        metavar="H,H",
        help="shortest and longest period in s: 0.1,0.3",
    )
    parser.add_argument("--goal", choices=("robust", "nominal"), help="for the range, or for its middle (robust)")
    parser.add_argument("--leaves", type=_whole, metavar="N", help="Lyapunov matrices of the guarantee")
    parser.add_argument("--horizon", type=_whole, metavar="N", help="samples of the worst sequence searched for")


def _dualrate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--period", type=_positive, required=True, metavar="T", help="fast period of the input in s")
    parser.add_argument("--ratio", type=_whole, required=True, metavar="M", help="the sensor delivers every M T")
    parser.add_argument("--observer", metavar="NAME", help="what fills the instants between (running_prediction)")


def _delay(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--degree", type=_whole, metavar="D", help="of the polynomials of the proof (3, less for large plants)"
    )
    parser.add_argument("--rule", metavar="NAME", help="of the degrees: bessel, tensor, total or wide (bessel)")
    parser.add_argument("--margin", type=_positive, metavar="R", help="distance from the least level (0.05)")
    parser.add_argument("--level", type=_positive, metavar="G", help="a level to keep, in place of the margin")
    parser.add_argument("--order", type=_whole, metavar="N", help="points of each history less one (24)")


def _offsets(text: str) -> list[int] | Literal["best"]:
    return "best" if text == "best" else _list(text, _natural)


def _wholes(text: str) -> list[int]:
    return _list(text, _whole)


def _range(text: str) -> list[float]:
    ends = _list(text, _positive)
    if len(ends) != 2:
        raise argparse.ArgumentTypeError(f"{text!r} must be two numbers, such as 0.1,0.3")
    return ends


def _list(text: str, one: Callable[[str], T]) -> list[T]:
    return [one(part.strip()) for part in text.split(",")]


def _natural(text: str) -> int:
    if not text.isascii() or not text.isdecimal() or len(text) > 9:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 on")
    return int(text)


def _whole(text: str) -> int:
    if _natural(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 1")
    return int(text)


def _positive(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    return number

"""`replication design`: an estimator for a plant of one's own, from a file, with the level that it guarantees."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import Any

from replication.commands.shared import FAILED, FINE, say
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.ownplant.methods import METHODS

TEXT = "design an estimator for a plant of your own, given in a file"
NOTES = """The plant file is TOML; `replication design METHOD --help` lists its keys. Gains (JSON, MATLAB, C), a figure
and a page go to ./NAME-METHOD/, NAME being that of the file; they appear at once or not at all. If no estimator is
found the exit code is 3.

"""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add a parser for each method."""
    methods = parser.add_subparsers(required=True, metavar="METHOD", dest="method")
    for method in METHODS.values():
        added = methods.add_parser(
            method.name,
            help=method.summary,
            description=f"{method.summary[0].upper()}{method.summary[1:]}.",
            epilog=f"keys of the plant file:\n{method.described()}\n\n{parser.epilog}",
            formatter_class=parser.formatter_class,
        )
        added.add_argument("plant", type=Path, metavar="FILE", help="the plant, a TOML file")
        for option in method.options:
            option.add(added)
        added.add_argument("--output", type=Path, metavar="DIR", help="where the design goes (default: ./NAME-METHOD)")
        added.add_argument("--force", action="store_true", help="replace an earlier design there")


def command(chosen: argparse.Namespace) -> int:
    """Read, design, print what is guaranteed, write."""
    from replication.ownplant.reading import read_plant
    from replication.ownplant.searching import forget
    from replication.ownplant.writing import require_free, with_names, write_design

    method = METHODS[chosen.method]
    plant = read_plant(chosen.plant, method.name)
    directory = chosen.output or Path(f"{plant.name}-{plant.method}")
    require_free(directory, replace=chosen.force)
    options = {option.name: getattr(chosen, option.name) for option in method.options}
    given = {name: value for name, value in options.items() if value is not None}
    call = _call(chosen, given)
    # A search that was killed goes on from here.
    timings = directory.with_name(f"{directory.name}.timings")
    if searched := given.get("offsets") == "best":
        given["timings"] = timings
    try:
        result = with_names(method.design(plant.values, **given), plant.names)
    except InvalidInputError as error:
        raise InvalidInputError(f"{chosen.plant}: {error}") from None
    except (InfeasibleError, SolverError) as error:
        print(f"replication: {chosen.plant}: {error}", file=sys.stderr)
        return FAILED
    write_design(directory, plant, result, call)
    if searched:
        forget(timings)
    say([*str(result).splitlines(), f"written: {directory}"])
    return FINE


def _call(chosen: argparse.Namespace, given: dict[str, Any]) -> str:
    """The command line that makes the same design again."""
    words = ["replication", "design", chosen.method, chosen.plant.name]
    for name, value in given.items():
        text = ",".join(str(part) for part in value) if isinstance(value, (list, tuple)) else str(value)
        words += [f"--{name}", text]
    return shlex.join(words)

"""`replication design`: an estimator for a plant of one's own, from a file, with the level that it guarantees."""

import argparse
import shlex
import sys
import warnings
from pathlib import Path
from typing import Any

from replication.commands import FAILED, FINE, command, say
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.ownplant.methods import METHODS, forget


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
        for name, settings in method.options.items():
            added.add_argument(f"--{name}", **settings)
        added.add_argument("--output", type=Path, metavar="DIR", help="where the design goes (default: ./NAME-METHOD)")
        added.add_argument("--certificate", action="store_true", help="prove the design, and write what proves it")
        added.add_argument("--force", action="store_true", help="replace an earlier design there")


@command(
    "design",
    "design an estimator for a plant of your own, given in a file",
    arguments,
    notes="""\
The plant file is TOML; `replication design METHOD --help` lists its keys. Gains and the
observer that runs (each as JSON, MATLAB, C), a figure and a page go to ./NAME-METHOD/, NAME being that of the file;
they appear at once or not at all. If no estimator is
found the exit code is 3. With --certificate the verifier proves what it can of the design, and
NAME-METHOD.certificate.json lies beside the gains; `python -m replication verify FILE` checks it again.

""",
)
def design(chosen: argparse.Namespace) -> int:
    """Read, design, print what is guaranteed, write."""
    from numpy.linalg import LinAlgError

    from replication.ownplant.files import read_plant, require_free, write_design

    method = METHODS[chosen.method]
    plant = read_plant(chosen.plant, method.name)
    directory = chosen.output or Path(f"{plant.name}-{plant.method}")
    certificate = f"{plant.name}-{plant.method}.certificate.json"
    require_free(directory, replace=chosen.force, proof=certificate)
    settings = {name: value for name in method.options if (value := getattr(chosen, name)) is not None}
    call = _call(chosen, settings)
    # A search that was killed goes on from here.
    timings = directory.with_name(f"{directory.name}.timings")
    if searched := settings.get("offsets") == "best":
        settings["timings"] = timings
    try:
        with warnings.catch_warnings():
            # What overflows on the way is found where the finished design is evaluated.
            warnings.simplefilter("ignore", RuntimeWarning)
            result = method.design(plant.values, **settings).named(**plant.names, units=plant.units)
        proof, proved = {}, []
        if chosen.certificate:
            from replication.audit.run.certify import to_json
            from replication.certify.own import certified

            content, sentence = certified(result, plant.name, as_written=True)
            proof, proved = {certificate: to_json(content)}, [f"proved: {sentence}"]
    except InvalidInputError as error:
        raise InvalidInputError(f"{chosen.plant}: {error}") from None
    except (InfeasibleError, SolverError) as error:
        print(f"replication: {chosen.plant}: {error}", file=sys.stderr)
        return FAILED
    except (ArithmeticError, LinAlgError) as error:
        advice = "its numbers lie too far apart for floating point; choose units in which they are near 1"
        print(f"replication: {chosen.plant}: no design ({error}): {advice}", file=sys.stderr)
        return FAILED
    write_design(directory, plant, result, call, proof)
    if searched:
        forget(timings)
    say([*str(result).splitlines(), *proved, f"written: {directory}"])
    return FINE


def _call(chosen: argparse.Namespace, settings: dict[str, Any]) -> str:
    """The command line that makes the same design again."""
    words = ["replication", "design", chosen.method, chosen.plant.name]
    for name, value in settings.items():
        text = ",".join(str(part) for part in value) if isinstance(value, (list, tuple)) else str(value)
        words += [f"--{name}", text]
    words += ["--certificate"] * chosen.certificate
    return shlex.join(words)

"""The command line: `python -m replication` or `replication`, with the commands of `replication.commands`."""

import argparse
import gc
import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

import replication
from replication.commands import BAD_INPUT, FAULT, INTERRUPTED, all_commands
from replication.errors import InvalidInputError, ReplicationError
from replication.extras import missing, told

DESCRIPTION = "Recompute what the papers print and set it beside the print, with a verdict for each claim."
EXIT_CODES = """exit codes:
  0    all is well
  1    a verdict is not the pinned one, a certificate is not proved, or `check`, `coverage` or `diff` found something
  2    bad usage or input
  3    an experiment, claim, erratum or figure ended in an error, or no design was found
  70   a fault of this program, which does not depend on what the papers print
  130  interrupted; what was finished is kept and the next run takes up there
"""
EXAMPLES = """examples:
  replication run                        audit all papers, write report/ and figures/
  replication run KEY --jobs 1           one paper, one experiment at a time
  replication list                       papers and claims with their verdicts
  replication show CLAIM                 all the evidence for one claim
  replication diff old.json new.json     what changed between two runs, and why
  replication guide                      how to audit a paper of your own, in any field
  replication design multirate cart.toml --periods 1,4
                                         gains for a plant of your own, and what they guarantee

"""
TRACEBACK = "REPLICATION_TRACEBACK"
"""A variable of the environment: if it is set, an unforeseen error shows where it came from."""
YOUNG = 100_000
"""Objects that are made before garbage is looked for among them."""
LONGEST = 500
"""Characters that are repeated of the message of an unforeseen error."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code; errors of this package go to stderr without a traceback."""
    # What a command imports and reads stays until its end; looking through it for garbage takes a tenth of `check`.
    gc.set_threshold(YOUNG)
    chosen = _parser().parse_args(arguments)
    try:
        if not (epoch := os.environ.get("SOURCE_DATE_EPOCH", "0")).isdecimal():
            raise InvalidInputError(f"SOURCE_DATE_EPOCH must be whole seconds since 1970, got {epoch!r}; correct it")
        if any("\0" in word for word in arguments or ()):
            raise InvalidInputError("an argument holds a null character, which no name of a file can; leave it out")
        code: int = chosen.command(chosen)
    except ReplicationError as error:
        print(f"replication: {error}", file=sys.stderr)
        return BAD_INPUT
    except OSError as error:
        # A file that cannot be read or written; what fails inside an experiment is part of the results instead.
        path = error.filename2 or error.filename
        print(f"replication: {f'{path}: ' if path else ''}{error.strerror or error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(
            "replication: interrupted; files that are whole stay, and `run` goes on from what it had computed",
            file=sys.stderr,
        )
        return INTERRUPTED
    except Exception as error:  # noqa: BLE001 - a traceback would end with the code of a changed verdict
        if os.environ.get(TRACEBACK):
            traceback.print_exc()
        print(f"replication: {told(error) if missing(error) else _fault(error)}", file=sys.stderr)
        return BAD_INPUT if missing(error) else FAULT
    return code


def _fault(error: Exception) -> str:
    """What to say of an error that nobody foresaw, on one line."""
    if isinstance(error, MemoryError):
        return "there is too little memory for this; close other programs, or take a smaller problem or fewer --jobs"
    text = " ".join(str(error).split())[:LONGEST]
    here = Path(__file__).parent
    lines = [part for part in traceback.extract_tb(error.__traceback__) if Path(part.filename).is_relative_to(here)]
    where = f"{Path(lines[-1].filename).relative_to(here.parent)}:{lines[-1].lineno}"
    return (
        f"a fault of this program, {type(error).__name__} at {where}: {text}. Please report it to the authors named in "
        f"CITATION.cff, with the command line and what {TRACEBACK}=1 shows besides"
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="replication",
        description=DESCRIPTION,
        epilog=EXAMPLES + EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {replication.__version__}")
    subparsers = parser.add_subparsers(required=True, metavar="COMMAND")
    for add in all_commands().values():
        add(subparsers, EXIT_CODES)
    return parser

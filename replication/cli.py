"""The command line: `python -m replication` or `replication`, with the commands of `replication.commands`.

Exit codes: 0 all is well · 1 a verdict is not the pinned one, a certificate is not proved, or `check`, `coverage` or
`diff` found something · 2 bad usage or input · 3 an experiment, claim, erratum or figure ended in an error, or no
design was found · 130 interrupted.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from replication import commands
from replication.commands.shared import BAD_INPUT, INTERRUPTED
from replication.errors import ReplicationError

DESCRIPTION = "Recompute what the papers print and set it beside the print, with a verdict for each claim."
EXIT_CODES = """exit codes:
  0    all is well
  1    a verdict is not the pinned one, a certificate is not proved, or `check`, `coverage` or `diff` found something
  2    bad usage or input
  3    an experiment, claim, erratum or figure ended in an error, or no design was found
  130  interrupted; what was finished is kept and the next run takes up there
"""
EXAMPLES = """examples:
  replication run                        audit all papers, write report/ and figures/
  replication run okajima2023 --jobs 1   one paper, one experiment at a time
  replication list                       papers and claims with their verdicts
  replication show CLAIM                 all the evidence for one claim
  replication diff old.json new.json     what changed between two runs, and why
  replication design multirate cart.toml --periods 1,4
                                         gains for a plant of your own, and what they guarantee

"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code; errors of this package go to stderr without a traceback."""
    chosen = _parser().parse_args(arguments)
    try:
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
    return code


def _parser() -> argparse.ArgumentParser:
    style = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog="replication", description=DESCRIPTION, epilog=EXAMPLES + EXIT_CODES, formatter_class=style
    )
    subparsers = parser.add_subparsers(required=True, metavar="COMMAND")
    for name in commands.NAMES:
        command = commands.load(name)
        added = subparsers.add_parser(
            name,
            help=command.text,
            description=f"{command.text[0].upper()}{command.text[1:]}.",
            epilog=command.notes + EXIT_CODES,
            formatter_class=style,
        )
        command.arguments(added)
        added.set_defaults(command=command.command)
    return parser

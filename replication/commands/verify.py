"""`replication verify`: check certificates in exact and ball arithmetic."""

from __future__ import annotations

import argparse
from pathlib import Path

from replication.commands.shared import project_root
from replication.verify.workers import add_jobs

TEXT = "check certificates in exact and ball arithmetic, and say what each proves"
NOTES = """`python verify.py` does the same where no package is installed: the standard library computes then
in place of python-flint.

"""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("paths", nargs="*", type=Path, metavar="PATH", help="files or folders (default: all)")
    parser.add_argument("--both", action="store_true", help="in both arithmetics, which must say the same")
    add_jobs(parser)


def command(chosen: argparse.Namespace) -> int:
    """Print one line for each certificate."""
    if chosen.both:
        from replication.twice import report
    else:
        from replication.verify.run import report

    return report(chosen.paths, project_root(), chosen.jobs)

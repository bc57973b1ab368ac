"""`replication coq`: let Coq check the theorems on multi-rate levels."""

from __future__ import annotations

import argparse

from replication.commands.shared import DIFFERENT, FINE, project_root, say

TEXT = "let Coq check the theorems on the levels of multi-rate observers"
NOTES = """Coq and its Mathematical Components must be there; on Debian: apt-get install coq libcoq-mathcomp-algebra.
It works in build/coq. When all theorems are checked, papers/PAPER/machine-checked.json says so to the report.

"""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("names", nargs="*", metavar="NAME", help="theorems (default: all)")
    parser.add_argument("--again", action="store_true", help="let coqchk check all theorems too, which is slow")


def command(chosen: argparse.Namespace) -> int:
    """Print one line for each theorem: proved, or the reason why not."""
    from replication.machine.run import check

    root = project_root()
    found = check(root, root / "build" / "coq", chosen.names, lambda line: say([line]), again=chosen.again)
    done = [one for all_of_paper in found.values() for one in all_of_paper]
    failed = sum(bool(one.reason) for one in done)
    say([f"{len(done) - failed} of {len(done)} theorems proved by Coq"])
    return DIFFERENT if failed else FINE

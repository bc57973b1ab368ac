"""`replication notebooks`: the tutorials, executed and written as pages."""

from __future__ import annotations

import argparse
from pathlib import Path

from replication.commands.shared import FINE, checkout, say

TEXT = "execute the tutorial notebooks and write them as pages that load nothing"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("names", nargs="*", metavar="NAME", help="notebooks in docs/notebooks (default: all)")
    parser.add_argument("--to", type=Path, metavar="DIR", help="where the pages go (default: report/notebooks/)")


def command(chosen: argparse.Namespace) -> int:
    """Write the pages and say which notebooks had to be executed."""
    from replication.audit.publish.notebooks import build_notebooks

    root = checkout()
    for built in build_notebooks(root, chosen.to or root / "report" / "notebooks", chosen.names):
        say([f"{'executed' if built.executed else 'unchanged'}: {built.page}"])
    return FINE

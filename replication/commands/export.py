"""`replication export`: badges, linked data, and metadata for journals and checkers, from results.json."""

from __future__ import annotations

import argparse
from pathlib import Path

from replication.commands.shared import FINE, add_output, project_root, results_path, say

TEXT = "write badges, JSON-LD, CODECHECK and ReScience metadata and BibTeX from results.json"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_output(parser, "where results.json is")
    parser.add_argument("--to", type=Path, metavar="DIR", help="where the files go (default: exports/ beside it)")


def command(chosen: argparse.Namespace) -> int:
    """Write the exports and name them."""
    from replication.audit.publish.write import write_exports
    from replication.audit.store.records import read_results

    path = results_path(chosen)
    say(map(str, write_exports(read_results(path), project_root(), chosen.to or path.parent / "exports")))
    return FINE

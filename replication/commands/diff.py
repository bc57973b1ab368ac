"""`replication diff`: what changed between two results files, and why."""

from __future__ import annotations

import argparse
from pathlib import Path

from replication.commands.shared import DIFFERENT, FINE, say

TEXT = "compare two results files, claim by claim, with the cause of each change"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("old", type=Path, metavar="OLD")
    parser.add_argument("new", type=Path, metavar="NEW")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print JSON")
    form.add_argument("--html", type=Path, metavar="FILE", help="write a page that loads nothing, as the report does")


def command(chosen: argparse.Namespace) -> int:
    """Print the changes as text or JSON, or write them as a page."""
    import msgspec

    from replication.audit.inspect.compare import compare, render
    from replication.audit.store.records import read_results

    old, new = (read_results(path, also_older=True) for path in (chosen.old, chosen.new))
    changes = compare(old, new)
    if chosen.html is not None:
        from replication.audit.report.diff import build_page

        say([f"page: {build_page(old, new, changes, chosen.html)}"])
    elif chosen.json:
        say([msgspec.json.format(msgspec.json.encode(changes), indent=2).decode()])
    else:
        say(render(changes))
    return DIFFERENT if changes else FINE

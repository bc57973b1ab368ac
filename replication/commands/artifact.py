"""`replication artifact`: one archive of sources, lock, results, figures and report, or a check of one."""

from __future__ import annotations

import argparse
from pathlib import Path

from replication.commands.shared import DIFFERENT, FINE, checkout, say

TEXT = "pack sources, results, figures and report into one zip with checksums"
NOTES = """The same commit and results give the same bytes. Unpacked, the archive is a project again: `make report`
rebuilds it and `make test` runs its tests.

"""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--to", type=Path, metavar="FILE", help="the zip (default: dist/ of the project)")
    which.add_argument("--check", type=Path, metavar="DIR", help="compare an unpacked archive with its checksums")


def command(chosen: argparse.Namespace) -> int:
    """Write the archive, or name the files of an unpacked one that are not what they were."""
    from replication import __version__
    from replication.audit.publish.archive import changed_files, write_archive

    if chosen.check is not None:
        changed = changed_files(chosen.check)
        say([*changed, f"{len(changed)} files changed"])
        return DIFFERENT if changed else FINE
    root = checkout()
    path = chosen.to or root / "dist" / f"slow-sensor-replication-{__version__}-artifact.zip"
    say([f"{path}: {write_archive(root, path)} files"])
    return FINE

"""What several commands share: exit codes, options, places of files, and printing."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

FINE, DIFFERENT, BAD_INPUT, FAILED, INTERRUPTED = 0, 1, 2, 3, 130


def project_root() -> Path:
    """The directory that holds `papers`, the lock, the cache and the report."""
    import papers

    return Path(next(iter(papers.__path__))).resolve().parent


def results_path(chosen: argparse.Namespace) -> Path:
    """Where results.json is: in `--output`, or in report/ of the project."""
    return Path(chosen.output or project_root() / "report") / "results.json"


def say(lines: Iterable[str]) -> None:
    """Print lines to the standard output; a reader that has left is no error."""
    from replication.audit.progress import say

    for line in lines:
        say(line, sys.stdout)


def add_output(parser: argparse.ArgumentParser, text: str) -> None:
    """Add the option `--output` of the commands that read or write results.json."""
    parser.add_argument("--output", type=Path, metavar="DIR", help=f"{text} (default: report/ of the project)")


def add_figures(parser: argparse.ArgumentParser, text: str) -> None:
    """Add the option `--figures` of the commands that draw or show figures."""
    parser.add_argument("--figures", type=Path, metavar="DIR", help=f"{text} (default: figures/ of the project)")

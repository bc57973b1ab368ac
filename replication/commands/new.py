"""`replication new`: the package of a new paper, ready to run."""

from __future__ import annotations

import argparse
from pathlib import Path

from replication.commands.shared import FINE, say

TEXT = "make the package of a new paper with claims, a figure, a table and tests, ready to run"
NOTES = """What it writes runs as it is; docs/adding-a-paper.md walks through making it yours. In a folder that
belongs to no project it begins one: replication.toml says what it is called, and where its papers lie.

"""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("key", metavar="KEY", help="name of the package in papers/, for example okajima2023")


def command(chosen: argparse.Namespace) -> int:
    """Write the files and name them."""
    from replication.audit.project import root_above
    from replication.scaffold.make import scaffold

    say(map(str, scaffold(chosen.key, root_above(Path.cwd()) or Path.cwd())))
    say([f"next: replication run {chosen.key}"])
    return FINE

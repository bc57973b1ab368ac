"""`replication new`: the package of a new paper, ready to run."""

from __future__ import annotations

import argparse

from replication.commands.shared import FINE, checkout, say

TEXT = "make the package of a new paper with claims, a figure, a table and tests, ready to run"
NOTES = """What it writes runs as it is; docs/adding-a-paper.md walks through making it yours.

"""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("key", metavar="KEY", help="name of the package in papers/, for example okajima2023")


def command(chosen: argparse.Namespace) -> int:
    """Write the files and name them."""
    from replication.scaffold.make import scaffold

    say(map(str, scaffold(chosen.key, checkout())))
    say([f"next: python -m replication run {chosen.key}"])
    return FINE

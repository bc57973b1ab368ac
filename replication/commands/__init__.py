"""The commands of the command line, one module each, in the order in which `--help` lists them.

A command is a module with

- `TEXT`: one line for the list of commands, starting with a small letter;
- `NOTES` (optional): paragraphs that its own help adds, ending with an empty line;
- `arguments(parser)`: adds its arguments;
- `command(chosen)`: does it and returns one of the exit codes of `replication.commands.shared`.

The module `NAME.py` is the command `replication NAME`. To add one: write the module and put its name in `NAMES`.
Nothing but the standard library is imported at the top of these modules, so that `--help` answers at once.
"""

from __future__ import annotations

import argparse
import importlib
from typing import Protocol, cast

NAMES = (
    "run",
    "list",
    "show",
    "check",
    "report",
    "diff",
    "new",
    "notebooks",
    "certify",
    "verify",
    "export",
    "artifact",
    "design",
)


class Command(Protocol):
    """What a module of this package has to offer."""

    TEXT: str

    def arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add the arguments of the command to its parser."""

    def command(self, chosen: argparse.Namespace) -> int:
        """Carry the command out and return the exit code."""


def load(name: str) -> Command:
    """The module of a command."""
    return cast(Command, importlib.import_module(f"{__name__}.{name}"))

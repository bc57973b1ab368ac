"""The commands of the command line, in the order in which `--help` lists them.

To add one: define it in a module of this package and name the module in `MODULES`. A module holds commands that do one
kind of work, as a dictionary `COMMANDS` by name; one that is a single command may instead have its parts as names of
its own: `TEXT`, `NOTES` (optional), `arguments(parser)` and `command(chosen)`.
Nothing but the standard library is imported at the top of these modules, so that `--help` answers at once.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Callable
from dataclasses import dataclass

MODULES = {
    "run": "run",
    "list": "results",
    "show": "results",
    "check": "results",
    "coverage": "papers",
    "report": "publish",
    "diff": "results",
    "new": "papers",
    "guide": "papers",
    "notebooks": "publish",
    "certify": "proofs",
    "verify": "proofs",
    "coq": "proofs",
    "export": "publish",
    "artifact": "publish",
    "register": "publish",
    "design": "design",
}
"""The module of each command."""

NAMES = tuple(MODULES)


@dataclass(frozen=True)
class Command:
    """A command of the command line.

    text: one line for the list of commands, starting with a small letter. arguments: adds its arguments to a parser.
    command: does it and returns one of the exit codes of `replication.commands.shared`.
    notes: paragraphs that its own help adds, ending with an empty line.
    """

    text: str
    arguments: Callable[[argparse.ArgumentParser], None]
    command: Callable[[argparse.Namespace], int]
    notes: str = ""


def load(name: str) -> Command:
    """The command of that name."""
    module = importlib.import_module(f"{__name__}.{MODULES[name]}")
    if hasattr(module, "COMMANDS"):
        found: Command = module.COMMANDS[name]
        return found
    return Command(module.TEXT, module.arguments, module.command, getattr(module, "NOTES", ""))

"""The commands of the command line, in the order in which `--help` lists them.

To add one: write a function with the decorator `command` in a module of this package, and name the module in `MODULES`.
Nothing but the standard library is imported at the top of these modules, so that `--help` answers at once.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

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
    "design": "design",
}
"""The module of each command."""

NAMES = tuple(MODULES)


Run = Callable[[argparse.Namespace], int]
Option = Callable[[argparse.ArgumentParser], object]
"""Adds an argument to a parser."""


@dataclass(frozen=True)
class Command:
    """A command of the command line.

    text: one line for the list of commands, starting with a small letter. options: add its arguments to a parser.
    run: does it and returns one of the exit codes of `replication.commands.shared`.
    notes: paragraphs that its own help adds, ending with an empty line.
    """

    text: str
    options: tuple[Option, ...]
    run: Run
    notes: str = ""


_commands: dict[str, Command] = {}


def command(name: str, text: str, *options: Option, notes: str = "") -> Callable[[Run], Run]:
    """A decorator for the function that does a command; the arguments are those of `Command`."""

    def made(run: Run) -> Run:
        _commands[name] = Command(text, options, run, notes)
        return run

    return made


def option(*names: str, **settings: Any) -> Option:
    """An argument, as `ArgumentParser.add_argument` takes it."""
    return lambda parser: parser.add_argument(*names, **settings)


def either(*options: Option) -> Option:
    """Arguments of which at most one is given."""

    def add(parser: argparse.ArgumentParser) -> None:
        group: Any = parser.add_mutually_exclusive_group()
        for one in options:
            one(group)

    return add


def load(name: str) -> Command:
    """The command of that name."""
    importlib.import_module(f"{__name__}.{MODULES[name]}")
    return _commands[name]

"""The commands of the command line.

To add one: write a function with the decorator `command` in a module of this package, and name the module in `MODULES`.
Nothing but the standard library is imported at the top of these modules, so that `--help` answers at once.
"""

import argparse
import importlib
from collections.abc import Callable
from typing import Any

MODULES = ("run", "results", "papers", "publish", "proofs", "design")
"""In the order in which `--help` lists their commands."""

Run = Callable[[argparse.Namespace], int]
Option = Callable[[argparse.ArgumentParser], object]
"""Adds an argument to a parser."""


_commands: dict[str, Callable[[Any, str], None]] = {}


def all_commands() -> dict[str, Callable[[Any, str], None]]:
    """Every command by its name: what adds its parser to others, with the end of its help."""
    for module in MODULES:
        importlib.import_module(f"{__name__}.{module}")
    return _commands


def command(name: str, text: str, *options: Option, notes: str = "") -> Callable[[Run], Run]:
    """A decorator for the function that does a command and returns one of the exit codes of `commands.shared`.

    text: one line for the list of commands, starting with a small letter. options: add its arguments to a parser.
    notes: paragraphs that its own help adds, ending with an empty line.
    """

    def made(run: Run) -> Run:
        def add(subparsers: Any, ending: str) -> None:
            parser = subparsers.add_parser(
                name,
                help=text,
                description=f"{text[0].upper()}{text[1:]}.",
                epilog=notes + ending,
                formatter_class=argparse.RawDescriptionHelpFormatter,
            )
            for option in options:
                option(parser)
            parser.set_defaults(command=run)

        _commands[name] = add
        return run

    return made


def option(*names: str, **settings: Any) -> Option:
    """An argument, as `ArgumentParser.add_argument` takes it."""
    return lambda parser: parser.add_argument(*names, **settings)

"""The commands of the command line, and what they share: exit codes, options, places of files, and printing.

To add one: write a function with the decorator `command` in a module of this package, and name the module in `MODULES`.
Nothing but the standard library is imported at the top of these modules, so that `--help` answers at once.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from replication.errors import AuditError, listed
from replication.verify.workers import jobs as jobs

if TYPE_CHECKING:
    from replication.audit.project import Project
    from replication.audit.store.records import ResultsFile

MODULES = ("run", "results", "papers", "proofs", "design")
"""In the order in which `--help` lists their commands."""
FINE, DIFFERENT, BAD_INPUT, FAILED, FAULT, INTERRUPTED = 0, 1, 2, 3, 70, 130
"""The exit codes."""

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
    """A decorator for the function that does a command and returns one of the exit codes.

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


def here() -> Project:
    """The project in which the command was given; AuditError if there is none."""
    from replication.audit.project import find_project

    return find_project(Path.cwd())


def project_root() -> Path:
    """The folder of that project, which holds papers, lock, cache and report."""
    return here().root


def results_path(chosen: argparse.Namespace) -> Path:
    """Where results.json is: in `--output`, or in report/ of the project."""
    return Path(chosen.output or project_root() / "report") / "results.json"


def say(lines: Iterable[str]) -> None:
    """Print lines, each at once. A reader who has left (`head`, a pager) ends no run: what follows goes nowhere."""
    for line in lines:
        try:
            print(line, flush=True)
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def results_of(chosen: argparse.Namespace) -> ResultsFile:
    """The results; says on standard error which files of the project are no longer those that they come from."""
    from replication.audit.run.tracing import state
    from replication.audit.store.cache import Cache
    from replication.audit.store.records import read_results
    from replication.audit.store.sources import SourceTree, default_packages

    results, project = read_results(results_path(chosen)), here()
    cache, tree = Cache(project.cache), SourceTree(default_packages(project.root))
    reading = [item for item in results.experiments if any(name.startswith("./") for name in item.read)]
    read = {name: now for item in reading for name, now in cache.data(item.name, item.key).items() if name[:2] == "./"}
    if moved := [name[2:] for name, then in read.items() if state(name, tree) != then]:
        advice = "the results were computed from other files; `replication run` computes them again"
        print(f"replication: changed since the run: {listed(moved)}; {advice}", file=sys.stderr)
    return results


def say_report(results: ResultsFile, figures: Path, output: Path) -> list[str]:
    """Build the report at `output`, say where it is and which of the tutorials that it links to are not built."""
    from replication.audit.report.page import build_articles, build_report

    try:
        lines = [f"report: {build_report(results, figures, output, project_root())}"]
        build_articles(results, figures, output.parent / "articles")
    except AuditError as error:
        raise (AuditError(f"{error}; {output} is of an earlier run") if output.is_file() else error) from None
    if absent := sorted({paper.notebook for paper in results.papers if paper.notebook}.difference(tutorials())):
        lines.append(
            f"tutorials not built yet, to which it links: {', '.join(absent)}; `replication notebooks` writes them"
        )
    say(lines)
    return lines


def tutorials() -> list[str]:
    """The names of the tutorials that are built as pages."""
    return sorted(page.stem for page in (project_root() / "report" / "notebooks").glob("*.html"))


def output(text: str) -> Option:
    """The option `--output` of the commands that read or write results.json."""
    return option("--output", type=Path, metavar="DIR", help=f"{text} (default: report/ of the project)")


def figures(text: str) -> Option:
    """The option `--figures` of the commands that draw or show figures."""
    return option("--figures", type=Path, metavar="DIR", help=f"{text} (default: figures/ of the project)")

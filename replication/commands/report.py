"""`replication report`: build the report from results.json."""

from __future__ import annotations

import argparse

from replication.commands.shared import FINE, add_figures, add_output, project_root, results_path, say_report

TEXT = "build index.html from results.json, without computing anything"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_output(parser, "where results.json is and index.html goes")
    add_figures(parser, "where the SVG and CSV files are")


def command(chosen: argparse.Namespace) -> int:
    """Write index.html beside results.json."""
    from replication.audit.store.records import read_results

    path = results_path(chosen)
    figures = chosen.figures or project_root() / "figures"
    say_report(read_results(path), figures, path.parent / "index.html")
    return FINE

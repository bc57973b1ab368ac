"""`replication check`: derive every stored verdict again from the stored numbers."""

from __future__ import annotations

import argparse

from replication.commands.shared import DIFFERENT, FINE, add_output, project_root, results_path, say

TEXT = "derive every verdict of results.json again and compare its texts with the code"
NOTES = """The verdicts must follow from the numbers of the file; the numbers are taken as they stand. Whether
they are what the computations give is for a new run: `replication run --no-cache`, then `replication diff`.

"""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_output(parser, "where results.json is")


def command(chosen: argparse.Namespace) -> int:
    """Print each problem found."""
    import papers
    from replication.audit.inspect.check import check
    from replication.audit.store.records import read_results

    results = read_results(results_path(chosen))
    problems = check(results, papers.load(), project_root())
    say(str(problem) for problem in problems)
    say([f"{len(problems)} problems in {len(results.claims)} claims"])
    return DIFFERENT if problems else FINE

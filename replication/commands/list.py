"""`replication list`: papers and claims with their verdicts."""

from __future__ import annotations

import argparse

from replication.commands.shared import FINE, add_output, results_path, say

TEXT = "list papers and claims with their verdicts"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("papers", nargs="*", metavar="PAPER", help="papers to list (default: all)")
    add_output(parser, "where results.json is")


def command(chosen: argparse.Namespace) -> int:
    """Print one line for each claim; without a run there are no verdicts yet."""
    import papers
    from replication.audit.publish.terminal import list_lines
    from replication.audit.store.records import read_results

    path = results_path(chosen)
    # In a directory that was asked for the results must be there.
    claims = read_results(path).claims if chosen.output or path.is_file() else ()
    say(list_lines(papers.load(chosen.papers or papers.KEYS), {claim.id: claim for claim in claims}))
    return FINE

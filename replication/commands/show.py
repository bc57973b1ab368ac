"""`replication show`: all the evidence for one claim."""

from __future__ import annotations

import argparse
import sys

from replication.commands.shared import FINE, add_output, results_path, say

TEXT = "show all the evidence for one claim"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("claim", metavar="CLAIM", help="id of the claim, as `list` prints it")
    add_output(parser, "where results.json is")


def command(chosen: argparse.Namespace) -> int:
    """Print what the results say about the claim, as a table on a terminal and as lines elsewhere."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from replication.audit.names import one_of
    from replication.audit.publish.terminal import claim_rows
    from replication.audit.store.records import read_results

    claims = {claim.id: claim for claim in read_results(results_path(chosen)).claims}
    claim = claims[one_of("claim", chosen.claim, claims)]
    if not sys.stdout.isatty():
        say(f"{label}: {text}" for label, text in claim_rows(claim))
        return FINE
    table = Table.grid(padding=(0, 2))
    for label, text in claim_rows(claim):
        table.add_row(Text(label, style="bold"), Text(text))
    Console().print(table)
    return FINE

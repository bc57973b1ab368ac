"""`replication certify`: make the certificates of the wanted theorems."""

from __future__ import annotations

import argparse

from replication.commands.shared import DIFFERENT, FINE, jobs, project_root, say

TEXT = "make the certificates that the papers want and that are not there, or no longer proved"
NOTES = """What is wanted stands in papers/PAPER/theorems.json. A certificate that is proved is left alone unless
--again is given; each one is verified before it is written to certificates/PAPER/NAME.json.

"""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("names", nargs="*", metavar="PAPER|NAME", help="papers or theorems (default: all)")
    parser.add_argument("--again", action="store_true", help="make those again that are proved already")
    parser.add_argument("--jobs", type=jobs, default=2, metavar="N", help="processes (default: 2)")


def command(chosen: argparse.Namespace) -> int:
    """Print one line for each certificate made, or the reason why it was not."""
    from replication.audit.run.certify import certify

    made = certify(project_root(), chosen.names, again=chosen.again, jobs=chosen.jobs)
    failed = 0
    for certificate in made:
        failed += bool(certificate.error)
        words = f"NOT MADE: {certificate.error}" if certificate.error else "proved"
        say([f"{certificate.paper}/{certificate.name} {certificate.seconds:.1f} s: {words}"])
    return DIFFERENT if failed else FINE

"""`replication verify`, `certify` and `coq`: certificates checked, made, and their theorems checked by Coq."""

import argparse
from pathlib import Path

from replication.commands import DIFFERENT, FINE, command, jobs, option, project_root, say
from replication.verify.workers import add_jobs


@command(
    "verify",
    "check certificates in exact and ball arithmetic, and say what each proves",
    option("paths", nargs="*", type=Path, metavar="PATH", help="files or folders (default: all)"),
    option("--both", action="store_true", help="in both arithmetics, which must say the same"),
    add_jobs,
    notes="""\
`python verify.py` does the same where no package is installed: the standard library computes then
in place of python-flint.

""",
)
def verify(chosen: argparse.Namespace) -> int:
    """Print one line for each certificate."""
    if chosen.both:
        from replication.twice import report
    else:
        from replication.verify.run import report

    return report(chosen.paths, project_root(), chosen.jobs)


@command(
    "certify",
    "make the certificates that the papers want and that are not there, or no longer proved",
    option("names", nargs="*", metavar="PAPER|NAME", help="papers or theorems (default: all)"),
    option("--again", action="store_true", help="make those again that are proved already"),
    option("--jobs", type=jobs, default=2, metavar="N", help="processes (default: 2)"),
    notes="""\
What is wanted stands in papers/PAPER/theorems.json. A certificate that is proved is left alone unless
--again is given; each one is verified before it is written to certificates/PAPER/NAME.json.

""",
)
def certify(chosen: argparse.Namespace) -> int:
    """Print one line for each certificate made, or the reason why it was not."""
    from replication.audit.run import certify as makers

    failed = 0
    for answer in makers.certify(project_root(), chosen.names, again=chosen.again, jobs=chosen.jobs):
        failed += bool(answer.error)
        say([f"{answer.name} {answer.seconds:.1f} s: {f'NOT MADE: {answer.error}' if answer.error else 'proved'}"])
    return DIFFERENT if failed else FINE


@command(
    "coq",
    "let Coq check the theorems on the levels of multi-rate observers",
    option("names", nargs="*", metavar="NAME", help="theorems (default: all)"),
    option("--again", action="store_true", help="let coqchk check all theorems too, which is slow"),
    notes="""\
Coq and its Mathematical Components must be there; on Debian: apt-get install coq libcoq-mathcomp-algebra.
It works in build/coq. When all theorems are checked, papers/PAPER/machine-checked.json says so to the report.

""",
)
def coq(chosen: argparse.Namespace) -> int:
    """Print one line for each theorem: proved, or the reason why not."""
    from replication.machine.run import check

    root = project_root()
    outcomes = check(root, root / "build" / "coq", chosen.names, lambda line: say([line]), again=chosen.again)
    theorems = [theorem for all_of_paper in outcomes.values() for theorem in all_of_paper]
    failed = sum(bool(theorem.reason) for theorem in theorems)
    say([f"{len(theorems) - failed} of {len(theorems)} theorems proved by Coq"])
    return DIFFERENT if failed else FINE

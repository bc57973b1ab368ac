"""The command line: `python -m replication` or `replication`.

Exit codes: 0 all is well · 1 a verdict is not the pinned one, or `check` or `diff` found something · 2 bad usage or
input · 3 an experiment, claim, erratum or figure ended in an error · 130 interrupted.

Heavy packages are imported by the commands that need them, so that `--help` answers at once.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from replication.errors import ReplicationError

if TYPE_CHECKING:
    from replication.audit.progress import Progress
    from replication.audit.records import ResultsFile

FINE, DIFFERENT, BAD_INPUT, FAILED, INTERRUPTED = 0, 1, 2, 3, 130

DESCRIPTION = "Recompute what the papers print and set it beside the print, with a verdict for each claim."
EXIT_CODES = """exit codes:
  0    all is well
  1    a verdict is not the pinned one, or `check` or `diff` found something
  2    bad usage or input
  3    an experiment, claim, erratum or figure ended in an error
  130  interrupted; what was finished is kept and the next run takes up there
"""
EXAMPLES = """examples:
  replication run                        audit all papers, write report/ and figures/
  replication run okajima2023 --jobs 1   one paper, one experiment at a time
  replication list                       papers and claims with their verdicts
  replication show CLAIM                 all the evidence for one claim
  replication diff old.json new.json     what changed between two runs, and why

"""
RUN_NOTES = """Results are kept in .cache/replication/ as long as the sources, inputs, lock and packages that they
depend on are unchanged. The report goes to report/; a run of some papers only goes to report/PAPER/
(report/PAPER+PAPER/), so that it never replaces the report on all papers.

"""


CHECK_NOTES = """The verdicts must follow from the numbers of the file; the numbers are taken as they stand. Whether
they are what the computations give is for a new run: `replication run --no-cache`, then `replication diff`.

"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code; errors of this package go to stderr without a traceback."""
    chosen = _parser().parse_args(arguments)
    try:
        code: int = chosen.command(chosen)
    except ReplicationError as error:
        print(f"replication: {error}", file=sys.stderr)
        return BAD_INPUT
    except OSError as error:
        # A file that cannot be read or written; what fails inside an experiment is part of the results instead.
        path = error.filename2 or error.filename
        print(f"replication: {f'{path}: ' if path else ''}{error.strerror or error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("replication: interrupted; what was finished is kept, run again to go on from there", file=sys.stderr)
        return INTERRUPTED
    return code


def project_root() -> Path:
    """The directory that holds `papers`, the lock, the cache and the report."""
    import papers

    return Path(next(iter(papers.__path__))).resolve().parent


def _run(chosen: argparse.Namespace) -> int:
    import msgspec

    import papers
    from replication.audit.cache import Cache
    from replication.audit.drawn import draw_figures
    from replication.audit.files import require_writable
    from replication.audit.records import write_results
    from replication.audit.report import build_report
    from replication.audit.runner import run
    from replication.audit.summary import run_lines

    root = project_root()
    selected = papers.load(chosen.papers or papers.KEYS)
    whole = len(selected) == len(papers.KEYS)
    output = chosen.output or root / "report" / ("" if whole else "+".join(paper.key for paper in selected))
    figures = chosen.figures or root / "figures"
    require_writable(output, "--output")
    require_writable(figures, "--figures")
    cache = Cache(root / ".cache" / "replication", read=not chosen.no_cache)
    outcome = run(selected, cache=cache, root=root, jobs=chosen.jobs, progress=_progress())
    drawn = draw_figures(selected, outcome.results_by_experiment, figures, cache=cache, root=root)
    results = msgspec.structs.replace(outcome.results, figures=drawn)
    write_results(output / "results.json", results)
    _say(run_lines(results, outcome.log, outcome.failures))
    _say([f"report: {build_report(results, figures, output / 'index.html')}"])
    return _code(results, outcome.failures)


def _list(chosen: argparse.Namespace) -> int:
    import papers
    from replication.audit.records import read_results
    from replication.audit.summary import list_lines

    path = _results_path(chosen)
    # Without a run there are no verdicts yet; in a directory that was asked for they must be there.
    claims = read_results(path).claims if chosen.output or path.is_file() else ()
    _say(list_lines(papers.load(chosen.papers or papers.KEYS), {claim.id: claim for claim in claims}))
    return FINE


def _show(chosen: argparse.Namespace) -> int:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from replication.audit.names import one_of
    from replication.audit.records import read_results
    from replication.audit.summary import claim_rows

    claims = {claim.id: claim for claim in read_results(_results_path(chosen)).claims}
    claim = claims[one_of("claim", chosen.claim, claims)]
    if not sys.stdout.isatty():
        _say(f"{label}: {text}" for label, text in claim_rows(claim))
        return FINE
    table = Table.grid(padding=(0, 2))
    for label, text in claim_rows(claim):
        table.add_row(Text(label, style="bold"), Text(text))
    Console().print(table)
    return FINE


def _check(chosen: argparse.Namespace) -> int:
    import papers
    from replication.audit.check import check
    from replication.audit.records import read_results

    results = read_results(_results_path(chosen))
    problems = check(results, papers.load())
    _say(str(problem) for problem in problems)
    _say([f"{len(problems)} problems in {len(results.claims)} claims"])
    return DIFFERENT if problems else FINE


def _report(chosen: argparse.Namespace) -> int:
    from replication.audit.records import read_results
    from replication.audit.report import build_report

    path = _results_path(chosen)
    figures = chosen.figures or project_root() / "figures"
    _say([f"report: {build_report(read_results(path), figures, path.parent / 'index.html')}"])
    return FINE


def _diff(chosen: argparse.Namespace) -> int:
    import msgspec

    from replication.audit.compare import compare, render
    from replication.audit.records import read_results

    changes = compare(read_results(chosen.old), read_results(chosen.new))
    if chosen.json:
        _say([msgspec.json.format(msgspec.json.encode(changes), indent=2).decode()])
    else:
        _say(render(changes))
    return DIFFERENT if changes else FINE


def _results_path(chosen: argparse.Namespace) -> Path:
    return Path(chosen.output or project_root() / "report") / "results.json"


def _code(results: ResultsFile, failures: Sequence[str]) -> int:
    from replication.audit.summary import errors, unexpected

    if failures or errors(results):
        return FAILED
    return DIFFERENT if unexpected(results) else FINE


def _progress() -> Progress:
    from replication.audit.progress import Bar, Plain

    if not sys.stdout.isatty():
        return Plain(sys.stdout)
    from rich.console import Console

    return Bar(Console())


def _say(lines: Iterable[str]) -> None:
    from replication.audit.progress import say

    for line in lines:
        say(line, sys.stdout)


def _jobs(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 1")
    return int(text)


def _parser() -> argparse.ArgumentParser:
    style = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog="replication", description=DESCRIPTION, epilog=EXAMPLES + EXIT_CODES, formatter_class=style
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name: str, command: object, text: str, notes: str = "") -> argparse.ArgumentParser:
        added = commands.add_parser(
            name,
            help=text,
            description=f"{text[0].upper()}{text[1:]}.",
            epilog=notes + EXIT_CODES,
            formatter_class=style,
        )
        added.set_defaults(command=command)
        return added

    def output(parser: argparse.ArgumentParser, text: str) -> None:
        parser.add_argument("--output", type=Path, metavar="DIR", help=f"{text} (default: report/ of the project)")

    def figures(parser: argparse.ArgumentParser, text: str) -> None:
        parser.add_argument("--figures", type=Path, metavar="DIR", help=f"{text} (default: figures/ of the project)")

    run = add("run", _run, "compute what changed, judge every claim, write figures and report", RUN_NOTES)
    run.add_argument("papers", nargs="*", metavar="PAPER", help="papers to audit (default: all)")
    run.add_argument(
        "--jobs", type=_jobs, metavar="N", help="processes (default: one per core; results do not depend on it)"
    )
    run.add_argument(
        "--no-cache", action="store_true", help="compute everything again; results are stored all the same"
    )
    output(run, "where results.json and index.html go")
    figures(run, "where the SVG and CSV files go")

    listing = add("list", _list, "list papers and claims with their verdicts")
    listing.add_argument("papers", nargs="*", metavar="PAPER", help="papers to list (default: all)")
    output(listing, "where results.json is")

    show = add("show", _show, "show all the evidence for one claim")
    show.add_argument("claim", metavar="CLAIM", help="id of the claim, as `list` prints it")
    output(show, "where results.json is")

    check = add(
        "check", _check, "derive every verdict of results.json again and compare its texts with the code", CHECK_NOTES
    )
    output(check, "where results.json is")

    report = add("report", _report, "build index.html from results.json, without computing anything")
    output(report, "where results.json is and index.html goes")
    figures(report, "where the SVG and CSV files are")

    diff = add("diff", _diff, "compare two results files, claim by claim, with the cause of each change")
    diff.add_argument("old", type=Path, metavar="OLD")
    diff.add_argument("new", type=Path, metavar="NEW")
    diff.add_argument("--json", action="store_true", help="print JSON")
    return parser

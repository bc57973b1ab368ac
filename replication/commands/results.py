"""What results say, whether it follows, what changed: `replication list`, `show`, `check`, `diff`; and what is written
of them for readers: `report`, `notebooks`, `export`, `artifact`.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from replication.commands import (
    DIFFERENT,
    FINE,
    command,
    figures,
    here,
    option,
    output,
    project_root,
    results_of,
    results_path,
    say,
    say_report,
)

if TYPE_CHECKING:
    from replication.audit.project import Project
    from replication.audit.run.last import Last, Said


@command(
    "list",
    "list papers and claims with their verdicts",
    option("papers", nargs="*", metavar="PAPER", help="papers to list (default: all)"),
    output("where results.json is"),
)
def list_claims(chosen: argparse.Namespace) -> int:
    """Print one line for each claim; without a run there are no verdicts yet."""
    from replication.audit.publish.terminal import list_lines

    # In a directory that was asked for the results must be there.
    records = results_of(chosen).claims if chosen.output or results_path(chosen).is_file() else ()
    say(list_lines(here().load(chosen.papers), {claim.id: claim for claim in records}))
    return FINE


@command(
    "show",
    "show all the evidence for one claim",
    option("claim", metavar="CLAIM", help="id of the claim, as `list` prints it"),
    output("where results.json is"),
)
def show(chosen: argparse.Namespace) -> int:
    """Print what the results say about the claim."""
    from replication.audit.publish.terminal import claim_text
    from replication.errors import one_of

    results = results_of(chosen)
    claims = {claim.id: claim for claim in results.claims}
    claim = claims[one_of("claim", chosen.claim, claims)]
    replies = [reply for paper in results.papers for reply in paper.replies if reply.claim == claim.id]
    say([claim_text(claim, results.readings.get(claim.paper, ()), replies).rstrip("\n")])
    return FINE


@command(
    "check",
    "derive every verdict of results.json again and compare its texts with the code",
    output("where results.json is"),
    figures("where the SVG and CSV files are"),
    notes="""\
The verdicts must follow from the numbers of the file; and its evidence, findings, errata, proofs and
figures from the results of the experiments, as far as .cache/ holds those of this run. Whether these come out again is
for a new run: `replication run --no-cache`, then `replication diff`. Where neither a file of the project nor anything
else that was read has changed since the last check, the words of that one are said again.

""",
)
def check(chosen: argparse.Namespace) -> int:
    """Print each problem found; where nothing has changed since the last check, what that one printed."""
    from replication.audit.run.last import CHECK, Last

    project, path = here(), results_path(chosen)
    drawn = chosen.figures or project.root / "figures"
    last = Last(project.root, [drawn, path], [str(path), str(drawn)], project.cache, CHECK)
    lines, code = last.said() or _checked(project, path, drawn, last)
    say(lines)
    return code


def _checked(project: Project, path: Path, drawn: Path, last: Last) -> Said:
    from replication.audit.inspect.check import check, differences, kept, unfounded
    from replication.audit.inspect.coverage import faults
    from replication.audit.run.tracing import traced
    from replication.audit.store.cache import Cache
    from replication.audit.store.records import read_results

    results, root, folder = read_results(path), project.root, project.folder
    with traced(root) as loading:
        papers = project.load()
    held = {paper.key for paper in results.papers}
    again = kept([paper for paper in papers if paper.key in held], root, Cache(project.cache))
    problems = list(map(str, [*check(results, papers, root), *differences(results, again, drawn)]))
    note = unfounded(results, again)
    wrong = [f"coverage: {fault}" for paper in papers for fault in faults(folder / paper.key, paper)]
    count = f"{len(problems)} problem{'s' * (len(problems) != 1)} in {len(results.claims)} claims"
    lines = (*problems, *([f"note: {note}"] if note else []), count, *wrong)
    answer = lines, DIFFERENT if problems or wrong else FINE
    last.keep(answer, loading, again.traced, again.untraced)
    return answer


@command(
    "diff",
    "compare two results files, claim by claim, with the cause of each change",
    option("old", type=Path, metavar="OLD"),
    option("new", type=Path, metavar="NEW"),
    option("--json", action="store_true", help="print JSON"),
)
def diff(chosen: argparse.Namespace) -> int:
    """Print the changes as text or JSON."""
    import msgspec

    from replication.audit.inspect.compare import compare, render
    from replication.audit.store.records import read_results

    old, new = (read_results(path, whole=False) for path in (chosen.old, chosen.new))
    changes = compare(old, new)
    say([msgspec.json.format(msgspec.json.encode(changes), indent=2).decode()] if chosen.json else render(changes))
    return DIFFERENT if changes else FINE


@command(
    "report",
    "build index.html from results.json, without computing anything",
    output("where results.json is and index.html goes"),
    figures("where the SVG and CSV files are"),
)
def report(chosen: argparse.Namespace) -> int:
    """Write index.html beside results.json."""
    page = results_path(chosen).with_name("index.html")
    say_report(results_of(chosen), chosen.figures or project_root() / "figures", page)
    return FINE


@command(
    "notebooks",
    "execute the tutorial notebooks and write them as pages that load nothing",
    option("names", nargs="*", metavar="NAME", help="notebooks in docs/notebooks (default: all)"),
    option("--to", type=Path, metavar="DIR", help="where the pages go (default: report/notebooks/)"),
)
def notebooks(chosen: argparse.Namespace) -> int:
    """Write the pages and say which notebooks had to be executed."""
    from replication.audit.publish.notebooks import build_notebooks

    root = project_root()
    for page, fresh in build_notebooks(root, chosen.to or root / "report" / "notebooks", chosen.names):
        say([f"{'executed' if fresh else 'unchanged'}: {page}"])
    return FINE


@command(
    "export",
    "write badges, JSON-LD, metadata for CODECHECK and Zenodo, and BibTeX from results.json",
    output("where results.json is"),
    option("--to", type=Path, metavar="DIR", help="where the files go (default: exports/ beside it)"),
)
def export(chosen: argparse.Namespace) -> int:
    """Write the exports, and what registers read at the root of the project, and name them."""
    from replication.audit.publish.archive import write_exports
    from replication.audit.publish.linked_data import read_software, write_registers

    results, root = results_of(chosen), project_root()
    say(map(str, write_exports(results, root, chosen.to or results_path(chosen).with_name("exports"))))
    say(write_registers(results, read_software(root), root))
    return FINE


def places(parser: argparse.ArgumentParser) -> None:
    """Add where the archive goes, or lies unpacked."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--to", type=Path, metavar="FILE", help="the zip (default: dist/ of the project)")
    group.add_argument("--check", type=Path, metavar="DIR", help="compare an unpacked archive with its checksums")


@command(
    "artifact",
    "pack sources, results, figures, report, this program and the way to rebuild into one zip with checksums",
    places,
    notes="""\
The same commit and results give the same bytes. Unpacked, the archive is a project again, which its REBUILD.md
rebuilds beside nothing but Python.

""",
)
def artifact(chosen: argparse.Namespace) -> int:
    """Write the archive, or name the files of an unpacked one that are not what they were."""
    from replication.audit.publish.archive import archive_name, changed_files, unfilled, write_archive

    if chosen.check is not None:
        changed = changed_files(chosen.check)
        say([*changed, f"{len(changed)} files changed"])
        return DIFFERENT if changed else FINE
    root = project_root()
    path = chosen.to or root / "dist" / archive_name(root)
    say([f"{path}: {write_archive(root, path)} files", *(f"note: {left}" for left in unfilled(root))])
    return FINE

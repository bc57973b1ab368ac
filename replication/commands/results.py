"""`replication list`, `show`, `check` and `diff`: what the results say, whether it follows, what changed."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from replication.commands import DIFFERENT, FINE, command, figures, here, option, output, results_of, results_path, say

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

"""`replication run`: compute what changed, judge every claim, write figures and report."""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from replication.commands import (
    DIFFERENT,
    FAILED,
    FINE,
    command,
    figures,
    here,
    jobs,
    option,
    output,
    say,
    say_report,
    tutorials,
)
from replication.errors import AuditError
from replication.ownplant.methods import positive

if TYPE_CHECKING:
    from replication.audit.run.runner import Outcome
    from replication.audit.run.worker import Compute
    from replication.audit.store.records import ResultsFile


@command(
    "run",
    "compute what changed, judge every claim, write figures and report",
    option("papers", nargs="*", metavar="PAPER", help="papers to audit (default: all)"),
    option("--jobs", type=jobs, metavar="N", help="processes (default: one per core; results do not depend on it)"),
    option("--no-cache", action="store_true", help="compute everything again; results are stored all the same"),
    option("--scheduler", metavar="ADDRESS", help="compute on this Dask cluster, for example tcp://10.0.0.1:8786"),
    option(
        "--twice", action="store_true", help="then compute everything once more; a result that differs is a failure"
    ),
    option("--timeout", type=positive, metavar="SECONDS", help="of an experiment that names none (default: 3600)"),
    output("where results.json and index.html go"),
    figures("where the SVG and CSV files go"),
    notes="""\
Results are kept in .cache/replication/ as long as the sources, inputs, lock and packages that they
depend on are unchanged. The report goes to report/; a run of some papers only goes to report/PAPER/
(report/PAPER+PAPER/), so that it never replaces the report on all papers.

""",
)
def audit(chosen: argparse.Namespace) -> int:
    """Audit the chosen papers; the report is written whatever the verdicts are."""
    from replication.audit.run.last import Last
    from replication.audit.run.tracing import traced

    executor = _executor(chosen)
    project = here()
    root, keys = project.root, sorted(set(chosen.papers or project.keys))
    target = chosen.output or root / "report" / ("" if keys == list(project.keys) else "+".join(keys))
    drawings = chosen.figures or root / "figures"
    directory = project.cache
    written = [drawings, *(target / name for name in ("results.json", "index.html", "articles"))]
    last = Last(root, written, [*keys, *tutorials(), *map(str, written)], directory)
    if not (chosen.no_cache or chosen.twice) and (answer := last.said()):
        say(answer[0])
        return answer[1]
    from replication.audit.declare import unlisted
    from replication.audit.inspect.headline import notes
    from replication.audit.publish.terminal import run_lines
    from replication.audit.run.runner import TIMEOUT, run
    from replication.audit.run.worker import Action
    from replication.audit.store.cache import Cache
    from replication.files import require_writable, unwritable

    with traced(root) as loading:
        papers = project.load(keys)
    lost = [words for paper in papers for words in unlisted(paper, project.folder)]
    if lost:
        raise AuditError(f"claims that nobody would see: {'; '.join(lost)}; add them to parts=..., or take them away")
    require_writable(target, "--output")
    require_writable(drawings, "--figures")
    if reason := unwritable(directory):
        print(f"replication: nothing will be kept for the next run: {directory}: {reason}", file=sys.stderr)
    cache = Cache(directory, read=not chosen.no_cache, write=not reason)
    limit = chosen.timeout or TIMEOUT
    audited = partial(run, papers, root=root, executor=executor, progress=lambda line: say([line]), timeout=limit)
    outcome = audited(cache=cache, figures=drawings)
    results = _dated(outcome.results, target / "results.json")
    remarks = [f"note: {note}" for note in notes(papers, results, outcome.unused, drawings, project.folder)]
    say([*run_lines(results, outcome.log, outcome.failures), *remarks])
    report = say_report(results, drawings, target / "index.html")
    code = _code(results, outcome.failures)
    whole = not any(step.reason.startswith("not kept") for step in outcome.log)
    if cache.write and code != FAILED and whole:
        # What a run says that finds all of this done.
        log = [replace(step, action=Action.REUSED) for step in outcome.log]
        lines = (*run_lines(results, log, ()), *remarks, *report)
        last.keep((lines, code), loading, outcome.traced, outcome.untraced)
    if not chosen.twice:
        return code
    again = audited(cache=replace(cache, read=False, write=False))
    second = again.results_by_experiment
    differing = [name for name, value in outcome.results_by_experiment.items() if second.get(name) != value]
    cache.forget(differing)
    moved = list(_moved(outcome, again, differing))
    say(moved or [f"twice: none of {len(second)} results differs"])
    return max(code, _code(again.results, again.failures), DIFFERENT if moved else FINE)


def _dated(results: ResultsFile, path: Path) -> ResultsFile:
    """Write the results, unless all but the date is as the file has it: then they are still those of that run."""
    import msgspec

    from replication.audit.store.records import read_results, write_results

    with contextlib.suppress(AuditError):
        before = read_results(path)
        run = msgspec.structs.replace(results.run, date=before.run.date)
        if msgspec.structs.replace(results, run=run) == before:
            return before
    write_results(path, results)
    return results


def _moved(first: Outcome, second: Outcome, differing: Sequence[str]) -> Iterator[str]:
    """What differs the second time; differing: the experiments whose results do."""
    verdicts = {claim.id: claim.verdict for claim in second.results.claims}
    if differing:
        yield f"twice: {len(differing)} of {len(second.results_by_experiment)} results differ: {', '.join(differing)}"
    for claim in first.results.claims:
        if claim.verdict is not verdicts[claim.id]:
            yield f"twice: {claim.id} is {claim.verdict}, then {verdicts[claim.id]}"


def _code(results: ResultsFile, failures: Sequence[str]) -> int:
    from replication.audit.publish.terminal import errors, unexpected, unproved

    if failures or errors(results):
        return FAILED
    return DIFFERENT if unexpected(results) or unproved(results) else FINE


def _executor(chosen: argparse.Namespace) -> Compute:
    from replication.audit.run.worker import processes

    if chosen.scheduler is None:
        return partial(processes, jobs=chosen.jobs)
    if chosen.jobs is not None:
        raise AuditError("--jobs is for processes of this machine; a cluster has the workers that it has")
    from replication.audit.run.worker import on_cluster

    return partial(on_cluster, chosen.scheduler)

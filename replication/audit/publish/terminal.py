"""A run, a claim and a list of claims in words, for the terminal."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

import msgspec

from replication.audit.inspect.headline import theorems
from replication.audit.judge.policies import once
from replication.audit.model import Outcome, Reading, SolverRecord, Verdict
from replication.audit.parts import Paper
from replication.audit.run.pool import Action, Step
from replication.audit.store.records import DECIDING, CertificateRecord, ClaimRecord, ResultsFile
from replication.errors import listed
from replication.verify.predicate import in_words

SLOWEST = 5
_PLACE = re.compile(r" \[[^\[\]]+:\d+\]$")
NOT_SHOWN = frozenset(
    {"statement", "solvers", "quantities", "as_printed", "intervals", "outcomes", "over_inputs", "says"}
)
LABELS = {
    "value": "computed",
    "expected": "expected verdict",
    "uses": "experiments",
    "supported": "supported, not proved",
    "unproved": "not proved",
}
"""Fields that are called otherwise in words."""


def run_lines(results: ResultsFile, log: Sequence[Step], failures: Sequence[str]) -> Iterator[str]:
    """The summary of a run: verdicts per paper, what was computed, the slowest, changed verdicts, failures."""
    for paper in results.papers:
        claims = [claim for claim in results.claims if claim.paper == paper.key]
        found = Counter(claim.verdict for claim in once(claims))
        several = ", ".join(f"{found[verdict]} {verdict}" for verdict in Verdict if found[verdict])
        yield f"{paper.key}: {found.total()} claims{several and f': {several}'}"
    done = Counter(step.action for step in log)
    yield "experiments: " + ", ".join(f"{done[action]} {action}" for action in Action)
    slowest = sorted((step for step in log if step.seconds > 0), key=lambda step: (-step.seconds, step.name))
    if slowest:
        yield "slowest: " + ", ".join(f"{step.name} {step.seconds:.1f} s" for step in slowest[:SLOWEST])
    for claim in unexpected(results):
        pinned, reason = claim.claim.expected, claim.judgement.reason
        yield f"changed verdict: {claim.id} is {claim.verdict}, pinned is {pinned}: {reason}"
    proved = sum(certificate.proved for certificate in results.certificates)
    if results.certificates:
        yield f"certificates: {proved} of {len(results.certificates)} proved"
    if said := theorems(once(results.claims)):
        yield said
    for certificate in unproved(results):
        yield f"not proved: {certificate.path}: {certificate.reason}"
    for error in (*errors(results), *failures):
        yield f"error: {error}"


def unexpected(results: ResultsFile) -> tuple[ClaimRecord, ...]:
    """The claims whose verdict is not the pinned one, errors aside."""
    return tuple(claim for claim in results.claims if claim.unexpected and claim.verdict is not Verdict.ERROR)


def unproved(results: ResultsFile) -> tuple[CertificateRecord, ...]:
    """The certificates that the verifier refused, or that are missing."""
    return tuple(certificate for certificate in results.certificates if not certificate.proved)


def errors(results: ResultsFile) -> tuple[str, ...]:
    """Whatever in the file ended in an error instead of an answer, with the error."""
    experiments = [f"experiment {part.name}: {part.error}" for part in results.experiments if part.error]
    errata = [f"erratum {part.id}: {part.error}" for part in results.errata if part.error]
    figures = [f"figure {part.name}: {part.error}" for part in results.figures if part.error]
    return (*experiments, *_claims(results.claims), *errata, *figures)


def _claims(claims: Iterable[ClaimRecord]) -> Iterator[str]:
    """A line for each error, however many claims ended in it; where each of them met it then matters no longer."""
    found: dict[str, list[ClaimRecord]] = {}
    for claim in claims:
        if claim.verdict is Verdict.ERROR:
            found.setdefault(_PLACE.sub("", claim.judgement.reason), []).append(claim)
    for reason, same in found.items():
        if len(same) == 1:
            yield f"claim {same[0].id}: {same[0].judgement.reason}"
        else:
            yield f"claims {listed([claim.id for claim in same])}: {reason}"


def list_lines(papers: Sequence[Paper], records: Mapping[str, ClaimRecord]) -> Iterator[str]:
    """Papers and claims, each claim with its verdict from the last run, or a dash if there is none."""
    for paper in papers:
        yield f"{paper.key}: {paper.title} ({len(paper.claims)} claims)"
        width = max((len(claim.id) for claim in paper.claims), default=0)
        for claim in paper.claims:
            verdict = str(records[claim.id].verdict) if claim.id in records else "-"
            yield f"  {claim.id:<{width}}  {verdict:<25}  {claim.place}"


def claim_rows(record: ClaimRecord, readings: Iterable[Reading] = ()) -> Iterator[tuple[str, str]]:
    """All that is known of a claim, as pairs of a label and a text; what is empty is left out.

    readings: those of its paper.
    """
    known = {reading.name: reading for reading in readings}
    yield "statement", record.claim.statement
    yield "paper", record.paper
    yield from (("as data", in_words(predicate)) for predicate in record.claim.says)
    for part in (record.claim, record.judgement, record.evidence):
        for name, value in _given(part):
            yield LABELS.get(name, name.replace("_", " ")), _text(value)
    if (reading := known.get(record.claim.reading)) is not None:
        inference = "; an inference" if reading.inference else ""
        yield "under the reading", f"{reading.name}: {reading.text} ({reading.place}{inference})"
    if (over := record.evidence.over_inputs) is not None:
        yield "over all inputs that round to their prints", f"[{over.lower!r}, {over.upper!r}], by {over.how}"
    for outcome in record.evidence.outcomes:
        yield f"under {outcome.reading}", _outcome_text(outcome, known.get(outcome.reading))
    if (printed := record.evidence.as_printed) is not None:
        given = ((name, value) for name, value in _given(printed) if name in DECIDING)
        yield "as printed", ", ".join(f"{name} {_text(value)}" for name, value in given) or "nothing"
    for name, number in record.evidence.quantities.items():
        yield f"· {name}", repr(number)
    for solver in record.evidence.solvers:
        yield "solver", solver_text(solver)


def _given(part: msgspec.Struct) -> Iterator[tuple[str, object]]:
    for name, value in msgspec.structs.asdict(part).items():
        if name not in NOT_SHOWN and value not in (None, "", (), (0, 0)) and (name != "optimum" or value):
            yield name, value


def _outcome_text(outcome: Outcome, reading: Reading | None) -> str:
    given = ", ".join(f"{name} {_text(value)}" for name, value in _given(outcome) if name != "reading")
    return f"{given or 'nothing'}{f'; {reading.text} ({reading.place})' if reading is not None else ''}"


def solver_text(solver: SolverRecord) -> str:
    """A solver record on one line."""
    parts = [f"{solver.name} {solver.version}: {solver.status}"]
    if solver.iterations is not None:
        parts.append(f"{solver.iterations} iterations")
    parts += [f"{name} {value:.1e}" for name, value in solver.residuals.items()]
    parts += [f"{name}={value}" for name, value in solver.options.items()]
    return ", ".join(parts)


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return "[" + ", ".join(_text(entry) for entry in value) + "]"
    return repr(value) if isinstance(value, float) else str(value)

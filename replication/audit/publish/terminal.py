"""A run, a claim and a list of claims in words, for the terminal."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

import msgspec

from replication.audit.inspect.headline import counts, theorems
from replication.audit.judge.policies import once
from replication.audit.model import Reading, Verdict
from replication.audit.parts import Paper, Reply
from replication.audit.publish.linked_data import without_empty
from replication.audit.run.worker import Action, Step
from replication.audit.store.records import CertificateRecord, ClaimRecord, ResultsFile
from replication.errors import listed
from replication.verify.predicate import in_words

SLOWEST = 5
_PLACE = re.compile(r" \[[^\[\]]+:\d+\]$")
NOT_SHOWN = ("statement", "says", "intervals")
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
        verdicts = {verdict: number for verdict, number in counts(claims).items() if number}
        several = ", ".join(f"{number} {verdict}" for verdict, number in verdicts.items())
        yield f"{paper.key}: {sum(verdicts.values())} claims{several and f': {several}'}"
    actions = Counter(step.action for step in log)
    yield "experiments: " + ", ".join(f"{actions[action]} {action}" for action in Action)
    slowest = sorted((step for step in log if step.seconds > 0), key=lambda step: (-step.seconds, step.name))
    if slowest:
        yield "slowest: " + ", ".join(f"{step.name} {step.seconds:.1f} s" for step in slowest[:SLOWEST])
    for claim in unexpected(results):
        pinned, reason = claim.claim.expected, claim.judgement.reason
        yield f"changed verdict: {claim.id} is {claim.verdict}, pinned is {pinned}: {reason}"
    proved = sum(certificate.proved for certificate in results.certificates)
    if results.certificates:
        yield f"certificates: {proved} of {len(results.certificates)} proved"
    if sentence := theorems(once(results.claims)):
        yield sentence
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
    """Whatever in the file ended in an error instead of an answer, with the error; once, however many claims met it."""
    others = results.named("experiment", "erratum", "figure")
    lines = [f"{sort} {name}: {record.error}" for (sort, name), record in others if record.error]
    reasons: dict[str, list[ClaimRecord]] = {}
    for claim in results.claims:
        if claim.verdict is Verdict.ERROR:
            reasons.setdefault(_PLACE.sub("", claim.judgement.reason), []).append(claim)
    for reason, (first, *more) in reasons.items():  # where each of several met it matters no longer
        ids = [claim.id for claim in (first, *more)]
        lines.append(f"claims {listed(ids)}: {reason}" if more else f"claim {first.id}: {first.judgement.reason}")
    return tuple(lines)


def list_lines(papers: Sequence[Paper], records: Mapping[str, ClaimRecord]) -> Iterator[str]:
    """Papers and claims, each claim with its verdict from the last run, or a dash if there is none."""
    for paper in papers:
        yield f"{paper.key}: {paper.title} ({len(paper.claims)} claims)"
        width = max((len(claim.id) for claim in paper.claims), default=0)
        for claim in paper.claims:
            verdict = str(records[claim.id].verdict) if claim.id in records else "-"
            yield f"  {claim.id:<{width}}  {verdict:<25}  {claim.place}"


def claim_text(record: ClaimRecord, readings: Iterable[Reading] = (), replies: Iterable[Reply] = ()) -> str:
    """All that is known of a claim, as YAML; what is empty is left out.

    readings: those of its paper. replies: of the authors to this claim.
    """
    parts = msgspec.json.decode(msgspec.json.encode((record.claim, record.judgement, record.evidence)))
    fields = {name: value for part in parts for name, value in part.items() if name not in NOT_SHOWN}
    content = {
        "statement": record.claim.statement,
        "as data": [in_words(predicate) for predicate in record.claim.says],
        **{LABELS.get(name, name.replace("_", " ")): value for name, value in fields.items()},
        "under the reading": {
            reading.name: f"{reading.text} ({reading.place}{'; an inference' * reading.inference})"
            for reading in readings
            if reading.name in record.rested
        },
        "replies": [msgspec.to_builtins(reply) for reply in replies],
    }
    left_out: tuple[object, ...] = ({}, [0, 0])
    content = {name: v for name, v in content.items() if name == "holds" or (v is not False and v not in left_out)}
    return msgspec.yaml.encode(without_empty(content), order=None).decode()

"""What stands behind the claims: the theorems with their certificates, and the experiments, drawn line by line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from replication.audit.judge.policies import once
from replication.audit.report.claim import anchor
from replication.audit.store.records import CertificateRecord, ClaimRecord, ExperimentRecord, ResultsFile

NO_REASON = "No certificate has been made."

ROW, TOP = 16, 12
LEFT, GAP, WIDTH = 250, 330, 640
"""Where the names of the experiments end, where those of the claims begin, and the whole, in units of the drawing."""

LONGEST = 34


@dataclass(frozen=True, kw_only=True)
class Proofs:
    """asked, proved, supported: how many claims there are, are proved, and have theorems beside them. open: the ones
    without any, by reason. made, twice, machine: how many certificates there are, and how many of them the second
    verifier and Coq have checked too."""

    certificates: tuple[tuple[CertificateRecord, tuple[ClaimRecord, ...]], ...]
    asked: int
    proved: int
    supported: int
    made: int
    twice: int
    machine: int
    open: tuple[tuple[str, tuple[ClaimRecord, ...]], ...]


def proofs(results: ResultsFile) -> Proofs | None:
    """What the certificates of `results` prove, each with its claims; None if there is no certificate."""
    if not results.certificates:
        return None
    asked = once(results.claims)
    reasons: dict[str, list[ClaimRecord]] = {}
    for claim in asked:
        if not claim.judgement.proved and not claim.judgement.supported:
            reasons.setdefault(claim.judgement.unproved or NO_REASON, []).append(claim)
    return Proofs(
        certificates=tuple(
            (certificate, tuple(claim for claim in results.claims if certificate.path in claim.evidence.certificates))
            for certificate in results.certificates
        ),
        asked=len(asked),
        proved=sum(claim.judgement.proved for claim in asked),
        supported=sum(bool(claim.judgement.supported) for claim in asked),
        made=len(results.certificates),
        twice=sum(certificate.proved and certificate.second for certificate in results.certificates),
        machine=sum(certificate.proved and bool(certificate.machine) for certificate in results.certificates),
        open=tuple((reason, tuple(claims)) for reason, claims in reasons.items()),
    )


@dataclass(frozen=True, kw_only=True)
class Node:
    """A name at a height; link: the place of the page that says more. rank: verdict, for the colour of a claim."""

    text: str
    link: str
    y: float
    verdict: str = ""


@dataclass(frozen=True, kw_only=True)
class Lineage:
    """The drawing of one paper: nodes on both sides, and the lines between them as SVG paths."""

    paper: str
    title: str
    experiments: tuple[Node, ...]
    claims: tuple[Node, ...]
    lines: tuple[str, ...]
    height: float
    alt: str


def lineages(results: ResultsFile) -> tuple[Lineage, ...]:
    """One drawing for each paper that has an experiment behind a claim."""
    drawn = (_lineage(paper.key, paper.title, results) for paper in results.papers)
    return tuple(lineage for lineage in drawn if lineage.lines)


def _lineage(key: str, title: str, results: ResultsFile) -> Lineage:
    claims = [claim for claim in results.claims if claim.paper == key]
    used = {name for claim in claims for name in claim.claim.uses}
    experiments = [record for record in results.experiments if record.paper == key and record.name in used]
    rows = max(len(claims), len(experiments), 1)
    left = {record.name: _height(index, len(experiments), rows) for index, record in enumerate(experiments)}
    ordered = _by_experiment(claims, left)
    right = {claim.id: _height(index, len(ordered), rows) for index, claim in enumerate(ordered)}
    lines = tuple(_line(left[name], right[claim.id]) for claim in ordered for name in claim.claim.uses if name in left)
    return Lineage(
        paper=key,
        title=title,
        experiments=tuple(_experiment_node(record, key, left[record.name]) for record in experiments),
        claims=tuple(_claim_node(claim, key, right[claim.id]) for claim in ordered),
        lines=lines,
        height=rows * ROW + 2 * TOP,
        alt=f"{len(experiments)} experiments on the left, {len(claims)} claims on the right, "
        f"{len(lines)} lines from the experiments to the claims that they answer",
    )


def _by_experiment(claims: Sequence[ClaimRecord], left: dict[str, float]) -> list[ClaimRecord]:
    """The claims at the mean height of their experiments, so that few lines cross; those without any come last."""

    def mean(claim: ClaimRecord) -> float:
        heights = [left[name] for name in claim.claim.uses if name in left]
        return sum(heights) / len(heights) if heights else float("inf")

    return sorted(claims, key=mean)


def _height(index: int, count: int, rows: int) -> float:
    """Rows spread evenly over the height of the longer side."""
    return TOP + ROW * (index + 0.5) * rows / count


def _line(begin: float, end: float) -> str:
    middle = (LEFT + GAP) / 2
    return f"M{LEFT},{begin:.1f}C{middle:g},{begin:.1f} {middle:g},{end:.1f} {GAP},{end:.1f}"


def _experiment_node(record: ExperimentRecord, key: str, y: float) -> Node:
    return Node(text=_short(record.name, key), link=anchor("experiment", record.name), y=y)


def _claim_node(record: ClaimRecord, key: str, y: float) -> Node:
    return Node(text=_short(record.id, key), link=anchor("claim", record.id), y=y, verdict=record.verdict)


def _short(name: str, key: str) -> str:
    text = name.removeprefix(f"{key}.")
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"

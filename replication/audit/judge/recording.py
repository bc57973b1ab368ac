"""Records of claims: `make_record` stores a claim with all that its verdict depends on, and judges what it stored.

`rejudge` judges a stored record anew. Both go through `judge`, so a verdict set by hand is found out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec

from replication.audit.judge.agreement import Target
from replication.audit.judge.proofs import Standing, with_proofs
from replication.audit.judge.verdict import judge, require_finite
from replication.audit.model import Claim, Evidence, Judgement, Proof, Reading, Verdict
from replication.audit.store.records import CertificateRecord, ClaimRecord, ErratumRecord, StatedClaim
from replication.errors import AuditError

OUTCOMES = (
    'outcomes are a list with one entry for each reading of the paper: [{"reading": "logarithms", "value": 48.3}], or '
    '{"reading": ..., "holds": True} where no number is printed'
)


def make_record(
    claim: Claim,
    evidence: Evidence | None,
    proof: Proof | None = None,
    *,
    inferred: bool = False,
    scanned: bool = False,
    readings: Iterable[Reading] = (),
    code: str = "",
    seconds: float = 0.0,
    error: str = "",
    certificates: Sequence[CertificateRecord] = (),
    unproved: str = "",
    untraced: Sequence[str] = (),
) -> ClaimRecord:
    """The record of `claim` with its verdict; never raises.

    evidence: what the claim answered, None after a failure. proof: that of the claim's erratum, None without one or
    when it failed. inferred, scanned: whether the erratum is an inference, or may be of the text at
    hand. readings: those of the paper. code: file:line of the
    answer. seconds: of its experiments. error: the failure, or empty.
    certificates: those that support the claim; what they prove takes the place of what was computed.
    unproved: why no theorem is possible. untraced: what its experiments did that nothing can follow.
    """
    stated = StatedClaim(**{name: getattr(claim, name) for name in StatedClaim.__struct_fields__})
    try:
        if error:
            raise AuditError(error)
        (usable, standing), failure = with_proofs(stated, plain(evidence), certificates), ""
    except AuditError as unusable:
        # No number of a failed or malformed answer is kept, so that judging the record again gives an error too.
        where = f" [{code}]" if code and not error else ""
        usable, standing, failure = Evidence(method=""), Standing(), f"{unusable}{where}"
    change = msgspec.structs.replace
    paths = tuple(certificate.path for certificate in certificates)
    usable = change(usable, code=code, seconds=seconds, certificates=paths, untraced=tuple(untraced))
    holds = None if proof is None else proof.holds
    judgement = judge(stated, usable, holds, inferred=inferred, scanned=scanned, readings=readings)
    judgement = _with_untraced(judgement, usable)
    if failure:
        judgement = Judgement(verdict=Verdict.ERROR, reason=failure, intervals=judgement.intervals)
    judgement = change(judgement, proved=standing.proved, supported=standing.supported, unproved=unproved)
    return ClaimRecord(claim=stated, evidence=usable, judgement=judgement)


def rejudge(
    record: ClaimRecord,
    errata: Mapping[str, ErratumRecord],
    target: Target | None = None,
    *,
    readings: Iterable[Reading] = (),
) -> Judgement:
    """Judge a stored record again from its numbers and the stored proofs alone; its judgement is not looked at.

    errata: by id. target: the printed value, if it was read. readings: those of the paper.

    What its certificates prove is taken from its judgement, which `check` compares with them.
    """
    erratum = errata.get(record.claim.erratum) if record.claim.erratum is not None else None
    holds = erratum.holds if erratum is not None and not erratum.error else None
    sort = {"inferred": erratum is not None and erratum.inference, "scanned": erratum is not None and erratum.scan}
    judgement = judge(record.claim, record.evidence, holds, target, readings=readings, **sort)
    kept = record.judgement
    told = {name: getattr(kept, name) for name in ("proved", "supported", "unproved")}
    return msgspec.structs.replace(_with_untraced(judgement, record.evidence), **told)


def _with_untraced(judgement: Judgement, evidence: Evidence) -> Judgement:
    if not evidence.untraced:
        return judgement
    return msgspec.structs.replace(judgement, reason=f"{judgement.reason} Not traced: {', '.join(evidence.untraced)}.")


def plain(evidence: Evidence | None) -> Evidence:
    """The evidence with plain finite numbers; raises AuditError naming the field that is not."""
    if not isinstance(evidence, Evidence):
        raise AuditError(f"there is no evidence: the claim answered {evidence!r}")
    try:
        fields = msgspec.to_builtins(evidence, enc_hook=_from_numpy)
        plain = msgspec.convert(fields, Evidence)
    except (TypeError, msgspec.ValidationError) as error:
        if "$.outcomes" in str(error):
            raise AuditError(f"{error}; {OUTCOMES}") from None
        raise AuditError(f"the evidence is not made of plain numbers: {error}") from None
    require_finite("", fields)
    return plain


def _from_numpy(value: Any) -> Any:
    """NumPy scalars and arrays as numbers and lists, known by their `tolist`."""
    if not hasattr(value, "tolist"):
        raise TypeError(f"{value!r} is a {type(value).__name__}")
    return value.tolist()

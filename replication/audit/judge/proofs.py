"""Certificates and claims: which certificates a run verifies, and what a claim gains by those that are proved."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.judge.agreement import End, Interval, Target, compared, negated
from replication.audit.judge.printed import flat
from replication.audit.model import NO_READING, NUMERIC, Claim, Evidence, Kind, Numbers, StatedClaim
from replication.audit.project import read_settings
from replication.audit.store.records import CertificateRecord, shared
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError
from replication.files import sha256
from replication.machine import STATEMENTS, sum_for
from replication.twice import RECORD, second
from replication.verify.predicate import Exported, Predicate, Term, differences, in_words
from replication.verify.subjects import theorems
from replication.verify.theorem import Refused


def machine_checked(folder: Path, stated: Collection[str]) -> tuple[str, dict[str, str]]:
    """What Coq left beside a paper: the file of its statement, checksums of certificates by name; nothing once stale.

    stated: the theorems that Coq has a statement of. Raises AuditError if the record names another one.
    """
    keys, unknown = ("statement", "theory", "certificates"), "of which Coq has no statement"
    statement, theory, sums = _left(folder / "machine-checked.json", "replication coq", keys, stated, unknown)
    return (str(statement), sums) if theory and theory == sum_for(folder) else ("", {})


def checked_twice(folder: Path, listed: Collection[str]) -> dict[str, str]:
    """Checksums, by name, of the certificates of which both arithmetics prove the same; nothing once stale.

    listed: the theorems that the paper wants. Raises AuditError if the record names another one.
    """
    keys, unknown = ("arithmetic", "certificates"), "which theorems.json does not"
    arithmetic, sums = _left(folder / RECORD, "python verify.py --both", keys, listed, unknown)
    return sums if arithmetic and arithmetic == second() else {}


def _left(path: Path, command: str, keys: Sequence[str], known: Collection[str], unknown: str) -> list[Any]:
    """These entries of what the last run of a second check left, its checksums by theorem last; nothing without one.

    Such a check takes too long for every run, and what has changed since it was made does not count.
    """
    if not path.is_file():
        return [*("" for _ in keys[1:]), {}]
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        entries = [record[key] for key in keys]
        others = sorted(dict(entries[-1]).keys() - set(known))
    except (ValueError, KeyError, TypeError) as error:
        raise AuditError(
            f"{path} is not what `{command}` writes ({error!r}); run it again, or remove the file"
        ) from None
    if others:
        raise AuditError(f"{path} names {', '.join(others)}, {unknown}; run `{command}` again, or remove the file")
    return entries


ROUNDING = 1e-9
"""A proved bracket may be narrower than floating point is exact: a value this near, relatively, is moved to its end."""
SUBJECT = ("printed.toml", "plants.py", "statements.py", "theorems.json")
"""Files of a paper that say what its certificates are about."""
OPEN = "It holds under one reading of the text and fails under another."
BY_KIND = {
    Kind.CITED: "The text gives no means to compute it.",
    Kind.STATISTICAL: "About random draws, which show how probable something is.",
}
"""Why there is no theorem on claims of these kinds, unless the paper gives another reason."""
Ends = tuple[float, float]


class Wanted(CertificateRecord, frozen=True, kw_only=True):
    """A certificate that a paper wants, before it is verified. subject: checksums of all that its proof reads."""

    subject: dict[str, str]
    proved: bool = False

    @property
    def task(self) -> str:
        """Its name among the tasks of a run."""
        return f"{self.paper}.certificate.{self.name}"


def wanted(root: Path, papers: Sequence[str]) -> tuple[tuple[Wanted, ...], dict[str, str]]:
    """The certificates that these papers want, and why claims have none; AuditError for a malformed list."""
    package = read_settings(root).papers
    certificates: list[Wanted] = []
    reasons: dict[str, str] = {}
    for paper in papers:
        try:
            listed, unproved = theorems(paper, root)
        except Refused as refusal:
            raise AuditError(str(refusal)) from None
        folder = root / package / paper
        common = {f"{package}/{paper}/{name}": sha256(folder / name) for name in SUBJECT if (folder / name).is_file()}
        common |= imported(root, package, folder)
        by_coq = [name for name, entry in listed.items() if entry.statement in STATEMENTS]
        (statement, sums), twice = machine_checked(folder, by_coq), checked_twice(folder, listed)
        for entry in listed.values():
            path = f"certificates/{paper}/{entry.name}.json"
            subject = {path: sha256(root / path, "missing"), **common}
            certificates.append(
                Wanted(
                    paper=paper,
                    name=entry.name,
                    claims=entry.claims,
                    statement=entry.statement,
                    path=path,
                    sha256=subject[path],
                    subject=subject,
                    machine=statement if sums.get(entry.name) == subject[path] else "",
                    second=twice.get(entry.name) == subject[path],
                )
            )
        reasons |= {claim: entry.reason for entry in unproved for claim in entry.claims}
    return tuple(certificates), reasons


def imported(root: Path, package: str, folder: Path) -> dict[str, str]:
    """The checksums of the project's files that the plants and the statements of a paper import, directly or not."""
    places = {package: root / package, "replication": Path(__file__).parents[2]}
    sources = SourceTree({name: place for name, place in places.items() if place.is_dir()})
    checksums = {"replication/verify/stdlib": second()}
    for name in ("plants", "statements"):
        if (folder / f"{name}.py").is_file():
            checksums |= sources.files_of(f"{package}.{folder.name}.{name}")
    return checksums


def no_theorem(claim: Claim | StatedClaim, reasons: Mapping[str, str], named: bool) -> str:
    """Why there is no theorem on a claim: as the paper says, or by its kind; empty for one that theorems support."""
    return "" if named else reasons.get(claim.id, BY_KIND.get(claim.kind, ""))


def record(certificate: Wanted, result: Mapping[str, Any] | None, error: str) -> CertificateRecord:
    """The record of a certificate: what `prove.prove` answered, or the error that it ended in."""
    proved = result or {"reason": error}
    fields = {**shared(CertificateRecord, certificate), "proved": not proved["reason"], **proved}
    return msgspec.convert(fields, CertificateRecord)


def with_proofs(
    claim: StatedClaim, evidence: Evidence, certificates: Sequence[CertificateRecord]
) -> tuple[Evidence, bool, str]:
    """The evidence for a claim with what is proved of it in place of what was computed, and whether it is proved.

    Last what the theorems do not say, if they only support it. Nothing changes while a certificate is not proved.
    Raises AuditError if the theorems contradict the evidence, or bound other numbers than it has.
    """
    if not certificates or not all(certificate.proved for certificate in certificates) or evidence.not_checkable:
        return evidence, False, ""
    paths = ", ".join(certificate.path for certificate in certificates)
    result = match(claim, evidence, certificates)
    computed = {outcome.reading: outcome.holds for outcome in evidence.outcomes}
    for reading, holds in result.by_reading.items():
        answer = computed.get(reading) if computed else evidence.holds
        if None not in (holds, answer) and holds != answer:
            raise AuditError(f"the theorems of {paths} contradict the evidence, which says holds: {answer}")
    ends = [(_outward(bound.low, -math.inf), _outward(bound.high, math.inf)) for bound in result.bounds]
    numeric = claim.kind in NUMERIC
    bracketed = _bracketed(evidence, ends, paths, numeric) if result.proved or (numeric and ends) else evidence
    if result.proved:
        return bracketed, True, ""
    return evidence, False, result.difference or OPEN


def _bracketed(evidence: Evidence, ends: Sequence[Ends], paths: str, numeric: bool) -> Evidence:
    """The evidence with the bracket of its certificates, on those sides that are proved of all its numbers.

    Raises AuditError for a number that does not lie in it, and for a statement with another bracket beside its number.
    """
    layout = evidence.value
    numbers = [] if layout is None else list(flat(layout))
    if len(ends) != len(numbers) and numeric:
        has = len(numbers) if numbers else "none"
        raise AuditError(f"the theorems of {paths} bound {len(ends)} numbers, the evidence has {has}")
    if len(ends) != len(numbers) or layout is None:
        return msgspec.structs.replace(evidence, lower=None, upper=None)
    lows, highs = (flat(layout if numeric or part is None else part) for part in (evidence.lower, evidence.upper))
    for number, low, high, pair in zip(numbers, lows, highs, ends, strict=True):
        # The bracket of its own that reaches nearest to the proved one must meet it.
        nearest = min(max(_clamped(number, pair), low), high)
        if abs(_clamped(nearest, pair) - nearest) > ROUNDING * max(1.0, abs(nearest)):
            raise AuditError(f"the theorems of {paths} prove {list(pair)}, and the computed value is {nearest!r}")
    values = map(_clamped, numbers, ends)
    sides = zip(*ends, strict=True)
    lower, upper = (_shaped(layout, iter(side)) if all(map(math.isfinite, side)) else None for side in sides)
    return msgspec.structs.replace(evidence, value=_shaped(layout, values), lower=lower, upper=upper)


def _outward(number: End, towards: float) -> float:
    """The nearest float that is not on the inner side of `number`."""
    nearest = float(number)
    if math.isinf(nearest):
        return nearest
    inner = Fraction(nearest) > number if towards < 0 else Fraction(nearest) < number
    return math.nextafter(nearest, towards) if inner else nearest


def _clamped(number: float, ends: Ends) -> float:
    return min(max(number, ends[0]), ends[1])


def _shaped(layout: Numbers, numbers: Iterator[Any]) -> Any:
    """The numbers, one after the other, in the layout of another quantity."""
    return tuple(_shaped(entry, numbers) for entry in layout) if isinstance(layout, tuple) else next(numbers)


# Does a theorem say what a claim says? The predicates of the claim, decided by what its certificates export.

NO_PREDICATE = "The claim states no predicate that a theorem could be compared with."
Offer = tuple[str, Exported]
"""A term of a theorem, with the name of the theorem."""


@dataclass(frozen=True, kw_only=True)
class Match:
    """What the theorems of a claim say of it.

    by_reading: whether all its predicates under a reading hold, None where they are not decided. difference: in words,
    what the theorems do not say. bounds: what they prove of the number of its first predicate.
    """

    by_reading: Mapping[str, bool | None]
    difference: str
    bounds: tuple[Interval, ...]

    @property
    def proved(self) -> bool:
        """Whether the claim is decided, one way or the other, under each reading that it rests on."""
        return bool(self.by_reading) and None not in self.by_reading.values()


def match(claim: StatedClaim, evidence: Evidence, certificates: Sequence[CertificateRecord]) -> Match:
    """Decide a claim by certificates of its paper that are proved; raises AuditError if they contradict each other.

    It rests on its own reading and, where the evidence tells outcomes under several, on each of these.
    """
    if not claim.says:
        return Match(by_reading={}, difference=NO_PREDICATE, bounds=())
    paper = claim.id.partition(".")[0]
    offers = [
        (certificate.name, export)
        for certificate in certificates
        if certificate.paper == paper and certificate.proved
        for export in certificate.says
    ]
    decided = [(predicate, _decided(predicate, claim, offers)) for predicate in claim.says]
    # A claim without a reading of its own may have outcomes under several, of which the text leaves the choice.
    names = [claim.reading] if claim.reading and not (claim.reading == NO_READING and evidence.outcomes) else []
    readings = dict.fromkeys(
        [*names, *(predicate.reading for predicate in claim.says), *(outcome.reading for outcome in evidence.outcomes)]
    )
    by_reading = {name: _all([holds for predicate, holds in decided if predicate.reading == name]) for name in readings}
    missing = [_lacking(predicate, claim, offers) for predicate, holds in decided if holds is None]
    known = {predicate.reading for predicate in claim.says}
    missing += [f"nothing is said under the reading {name}" for name in readings if name not in known]
    bounds = _bounds(claim.says[0].of, claim.says[0], offers)
    return Match(by_reading=by_reading, difference=_told(missing, by_reading), bounds=bounds)


def _all(decided: Sequence[bool | None]) -> bool | None:
    """A conjunction: false as soon as one part is, true if all are; nothing is said by none."""
    if False in decided:
        return False
    return None if None in decided or not decided else True


def _told(missing: Sequence[str], by_reading: Mapping[str, bool | None]) -> str:
    """What is decided under some readings, then what is not."""
    if not missing:
        return ""
    words = {True: "says", False: "denies"}
    ways = {holds: [name for name, answer in by_reading.items() if answer is holds] for holds in words}
    decided = [f"A theorem {words[holds]} it under {', '.join(names)}. " for holds, names in ways.items() if names]
    text = "; ".join(missing)
    return f"{''.join(decided)}{text[:1].upper()}{text[1:]}."


def _fitting(term: Term, predicate: Predicate, offers: Iterable[Offer]) -> list[Exported]:
    """What is exported of exactly this term, under this reading."""
    like = predicate.unit, term.quantity, term.setting
    near = (export for _, export in offers if (export.unit, export.of.quantity, export.of.setting) == like)
    return [export for export in near if not differences(term, predicate.reading, export)]


def _decided(predicate: Predicate, claim: StatedClaim, offers: Sequence[Offer]) -> bool | None:
    """Whether a predicate holds by these theorems; None if they do not say."""
    if predicate.relation in ("holds", "fails"):
        answers = {export.holds for export in _fitting(predicate.of, predicate, offers)} - {None}
        if len(answers) > 1:
            raise AuditError(f"the theorems on {claim.id} contradict each other: one says that it holds, one not")
        return answers == {predicate.relation == "holds"} if answers else None
    ours = _bounds(predicate.of, predicate, offers)
    if isinstance(predicate.to, Term):
        theirs = _bounds(predicate.to, predicate, offers)
        return compared(predicate.relation, ours[0], theirs[0]) if len(ours) == len(theirs) == 1 else None
    text = str(predicate.to)
    if predicate.relation in ("is", "is not"):
        changes = {} if text == claim.printed else {"printed": text, "tolerance": None}
        return _equal(predicate, ours, Target.of(msgspec.structs.replace(claim, **changes)))
    limit = Fraction(text)
    return compared(predicate.relation, ours[0], Interval(limit, limit)) if len(ours) == 1 else None


def _equal(predicate: Predicate, ours: Sequence[Interval], target: Target) -> bool | None:
    """Whether bounds lie in what each number of a print stands for; of a conjugate pair the imaginary part in size."""
    if len(ours) != len(target.intervals):
        return None
    entries = zip(ours, target.printed.entries, target.intervals, strict=True)
    parts = [(bound.size() if entry.absolute else bound).within(stands) for bound, entry, stands in entries]
    return negated(_all(parts)) if predicate.relation == "is not" else _all(parts)


def _bounds(term: Term, predicate: Predicate, offers: Iterable[Offer]) -> tuple[Interval, ...]:
    """The narrowest bounds of each number of a term; none if theorems on it bound different counts of numbers."""
    bounds = [
        export.items
        for export in _fitting(term, predicate, offers)
        if any(end for pair in export.items for end in pair)
    ]
    if len({len(items) for items in bounds}) != 1:
        return ()
    narrow = tuple(_narrowest(pairs) for pairs in zip(*bounds, strict=True))
    for bound in narrow:
        if bound.low > bound.high:
            raise AuditError(
                f"the theorems on {in_words(predicate)} contradict each other: one says at least {bound.low}, another "
                f"at most {bound.high}; one of their statements or certificates is wrong"
            )
    return narrow


def _narrowest(pairs: Iterable[tuple[str | None, str | None]]) -> Interval:
    lows, highs = zip(*pairs, strict=True)
    low = max((Fraction(end) for end in lows if end is not None), default=-math.inf)
    return Interval(low, min((Fraction(end) for end in highs if end is not None), default=math.inf))


def _lacking(predicate: Predicate, claim: StatedClaim, offers: Sequence[Offer]) -> str:
    """What the nearest theorem says instead."""
    for term in predicate.terms:
        if not _fitting(term, predicate, offers):
            near = [(differences(term, predicate.reading, export), name) for name, export in offers]
            if not near:
                return "No theorem that supports it says anything as data"
            reasons, name = min(near, key=lambda pair: len(pair[0]))
            return f"The nearest theorem, {name}, says it otherwise: {'; '.join(reasons)}"
    return f"The proved bounds do not decide whether {in_words(predicate)}"

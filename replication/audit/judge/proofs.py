"""Certificates and claims: which certificates a run verifies, and what a claim gains by those that are proved."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.model import Evidence, Kind, Numbers
from replication.audit.store.records import CertificateRecord
from replication.errors import AuditError
from replication.verify.subjects import theorems
from replication.verify.theorem import Refused

ROUNDING = 1e-9
"""A proved bracket may be narrower than floating point is exact: a value this near, relatively, is moved to its end."""
SUBJECT = ("printed.toml", "plants.py", "theorems.json")
"""Files of a paper that say what its certificates are about."""
STATEMENTS = (Kind.FEASIBLE, Kind.ORDER)
Ends = tuple[float | None, float | None]


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """A certificate that a paper wants. path: below the project. subject: checksums of all that its proof reads.

    machine: the statement that Coq has proved of the file as it is, below the project; empty if none.
    """

    paper: str
    name: str
    claims: tuple[str, ...]
    statement: str
    path: str
    subject: Mapping[str, str]
    machine: str = ""

    @property
    def task(self) -> str:
        """Its name among the tasks of a run."""
        return f"{self.paper}.certificate.{self.name}"


def wanted(root: Path, papers: Sequence[str]) -> tuple[tuple[Wanted, ...], dict[str, str]]:
    """The certificates that these papers want, and the claims without one with the reason.

    Raises AuditError if a list of theorems is malformed.
    """
    found: list[Wanted] = []
    reasons: dict[str, str] = {}
    for paper in papers:
        try:
            listed, unproved = theorems(paper, root)
        except Refused as refusal:
            raise AuditError(str(refusal)) from None
        folder = root / "papers" / paper
        shared = {f"papers/{paper}/{name}": sha256(folder / name) for name in SUBJECT if (folder / name).is_file()}
        statement, sums = machine_checked(folder)
        for entry in listed.values():
            path = f"certificates/{paper}/{entry.name}.json"
            subject = {path: sha256(root / path), **shared}
            found.append(
                Wanted(
                    paper=paper,
                    name=entry.name,
                    claims=entry.claims,
                    statement=entry.statement,
                    path=path,
                    subject=subject,
                    machine=statement if sums.get(entry.name) == subject[path] else "",
                )
            )
        reasons |= {claim: entry.reason for entry in unproved for claim in entry.claims}
    return tuple(found), reasons


def machine_checked(folder: Path) -> tuple[str, dict[str, str]]:
    """What the last run of Coq left beside a paper: the statement's file, and the checksum of each certificate."""
    path = folder / "machine-checked.json"
    if not path.is_file():
        return "", {}
    record = json.loads(path.read_text(encoding="utf-8"))
    return record["statement"], record["certificates"]


def sha256(path: Path) -> str:
    """The checksum of a file, or a word for one that is not there."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "missing"


def record(certificate: Wanted, result: Mapping[str, Any] | None, error: str) -> CertificateRecord:
    """The record of a certificate: what `prove.prove` answered, or the error that it ended in."""
    proved = result or {"sentence": "", "reason": error, "lower": None, "upper": None, "holds": None, "items": []}
    return CertificateRecord(
        paper=certificate.paper,
        name=certificate.name,
        path=certificate.path,
        sha256=certificate.subject[certificate.path],
        claims=certificate.claims,
        statement=certificate.statement,
        proved=not proved["reason"],
        machine=certificate.machine,
        **{**proved, "items": tuple((low, high) for low, high in proved["items"])},
    )


def with_proofs(kind: Kind, evidence: Evidence, certificates: Sequence[CertificateRecord]) -> tuple[Evidence, bool]:
    """The evidence for a claim of this kind with what the certificates prove in place of what it computed.

    Also whether the bracket, or the statement, is proved. Nothing changes while one of them is not proved.
    Raises AuditError if the theorems contradict the evidence, or say nothing on a claim of this kind.
    """
    if not certificates or not all(certificate.proved for certificate in certificates) or evidence.not_checkable:
        return evidence, False
    paths = ", ".join(certificate.path for certificate in certificates)
    if kind in STATEMENTS:
        said = {certificate.holds for certificate in certificates} - {None}
        if not said:
            raise AuditError(f"the theorems of {paths} do not say whether the claim holds")
        if said != {evidence.holds}:
            raise AuditError(f"the theorems of {paths} contradict the evidence, which says holds: {evidence.holds}")
        return _statement_bracketed(evidence, certificates), True
    if evidence.value is None:
        raise AuditError(f"the theorems of {paths} bound a value, and the evidence has none")
    ends = proved_ends(certificates)
    numbers = list(_flat(evidence.value))
    if len(ends) != len(numbers):
        raise AuditError(f"the theorems of {paths} bound {len(ends)} numbers, the evidence has {len(numbers)}")
    if kind is not Kind.BOUND and any(None in pair for pair in ends):
        raise AuditError(f"the theorems of {paths} leave a side open")
    values = [_inside(number, pair, paths) for number, pair in zip(numbers, ends, strict=True)]
    bracketed = msgspec.structs.replace(
        evidence,
        value=_shaped(evidence.value, iter(values)),
        lower=None if ends[0][0] is None else _shaped(evidence.value, iter(end[0] for end in ends)),
        upper=None if ends[0][1] is None else _shaped(evidence.value, iter(end[1] for end in ends)),
    )
    return bracketed, True


def _statement_bracketed(evidence: Evidence, certificates: Sequence[CertificateRecord]) -> Evidence:
    """A statement that is proved shows the bracket of its certificates; where they give none, it shows none.

    Its value is moved to the nearest end if it lies outside though its own bracket does not.
    Raises AuditError if the two brackets have nothing in common.
    """
    change = msgspec.structs.replace
    bare = change(evidence, lower=None, upper=None)
    if evidence.value is None or not _bounding(certificates):
        return bare
    value, ends = evidence.value, proved_ends(certificates)
    numbers = list(_flat(value))
    if len(ends) != len(numbers):
        return bare
    lows = list(_flat(value if evidence.lower is None else evidence.lower))
    highs = list(_flat(value if evidence.upper is None else evidence.upper))
    paths = ", ".join(certificate.path for certificate in certificates)
    moved = []
    for number, low, high, pair in zip(numbers, lows, highs, ends, strict=True):
        # The bracket of its own that reaches nearest to the proved one must meet it.
        _inside(min(max(_clamped(number, pair), low), high), pair, paths)
        moved.append(_clamped(number, pair))
    sides = [None if any(end is None for end in side) else side for side in zip(*ends, strict=True)]
    lower, upper = (None if side is None else _shaped(value, iter(side)) for side in sides)
    return change(evidence, value=_shaped(value, iter(moved)), lower=lower, upper=upper)


def _bounding(certificates: Sequence[CertificateRecord]) -> list[tuple[tuple[str | None, str | None], ...]]:
    """The brackets of those certificates that bound a number; the others only say yes or no."""
    found = [certificate.items or ((certificate.lower, certificate.upper),) for certificate in certificates]
    return [bracket for bracket in found if any(end for pair in bracket for end in pair)]


def proved_ends(certificates: Sequence[CertificateRecord]) -> list[Ends]:
    """The proved bracket of each number, the narrowest of all theorems on it, rounded outwards to floats.

    Theorems that only say yes or no play no part. Raises AuditError if none bounds a number.
    """
    brackets = _bounding(certificates)
    if len({len(bracket) for bracket in brackets}) != 1:
        raise AuditError(f"{', '.join(c.path for c in certificates)} bound no number, or different counts of them")
    ends = []
    for pairs in zip(*brackets, strict=True):
        lows = [Fraction(low) for low, _ in pairs if low is not None]
        highs = [Fraction(high) for _, high in pairs if high is not None]
        ends.append(
            (_outward(max(lows), -math.inf) if lows else None, _outward(min(highs), math.inf) if highs else None)
        )
    return ends


def _outward(number: Fraction, towards: float) -> float:
    """The nearest float that is not on the inner side of `number`."""
    nearest = float(number)
    inner = Fraction(nearest) > number if towards < 0 else Fraction(nearest) < number
    return math.nextafter(nearest, towards) if inner else nearest


def _inside(number: float, ends: Ends, paths: str) -> float:
    inside = _clamped(number, ends)
    if abs(inside - number) > ROUNDING * max(1.0, abs(number)):
        raise AuditError(f"the theorems of {paths} prove {_interval(ends)}, and the computed value is {number!r}")
    return inside


def _clamped(number: float, ends: Ends) -> float:
    low, high = ends
    return min(max(number, -math.inf if low is None else low), math.inf if high is None else high)


def _interval(ends: Ends) -> str:
    return f"[{-math.inf if ends[0] is None else ends[0]!r}, {math.inf if ends[1] is None else ends[1]!r}]"


def _flat(numbers: Numbers) -> Iterator[float]:
    if isinstance(numbers, tuple):
        for entry in numbers:
            yield from _flat(entry)
    else:
        yield numbers


def _shaped(layout: Numbers, numbers: Iterator[Any]) -> Any:
    """The numbers, one after the other, in the layout of another quantity."""
    return tuple(_shaped(entry, numbers) for entry in layout) if isinstance(layout, tuple) else next(numbers)

"""Every proved claim, attacked in its wording: with one word of a theorem or of the claim altered it is proved no more.

What a theorem exports is altered in one field at a time (all theorems that say the same are altered alike), and so is
what the claim says. An attack succeeds if the claim is still decided, and as before.
"""

import dataclasses
from collections.abc import Container, Iterable, Iterator, Mapping
from fractions import Fraction
from typing import Any

import msgspec
import pytest

from replication.audit.judge.proofs import match
from replication.audit.run.runner import Outcome
from replication.audit.store.records import CertificateRecord, ClaimRecord
from replication.errors import AuditError
from replication.verify.predicate import QUANTITIES, Exported, Predicate, Term

pytestmark = pytest.mark.slow

LEAST = 1000
"""Attacks of which this says something."""
FLIPPED: Mapping[str, str] = {"is": "is not", "is not": "is", "holds": "fails", "fails": "holds"}


def others(value: Any) -> Iterator[Any]:
    """Values near `value` that are not equal to it."""
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int | float):
        yield from (value + 1, -value - 1)
    elif isinstance(value, str):
        yield f"{value}0" if value[-1:].isdigit() else f"{value} other"
    elif isinstance(value, list):
        yield [*value, *value[-1:], 7]
        for i, entry in enumerate(value):
            yield from ([*value[:i], other, *value[i + 1 :]] for other in others(entry))
    else:
        yield "other"


def terms(of: Term) -> Iterator[tuple[str, Term]]:
    """The term with one thing altered: quantity, plant, class of estimators, a parameter changed, gone or added."""
    same_unit = [name for name, (unit, _) in QUANTITIES.items() if unit == QUANTITIES.get(of.quantity, ("",))[0]]
    for name in [name for name in same_unit if name != of.quantity][:2]:
        yield "quantity", dataclasses.replace(of, quantity=name)
    for plant in {"", f"{of.plant}-2"} - {of.plant}:
        yield "plant", dataclasses.replace(of, plant=plant)
    for who in {"", "all estimators", "the given filter"} - {of.estimators}:
        yield "estimators", dataclasses.replace(of, estimators=who)
    yield "added", dataclasses.replace(of, setting={**of.setting, "only": 1})
    for key, value in of.setting.items():
        yield f"no {key}", dataclasses.replace(of, setting={k: v for k, v in of.setting.items() if k != key})
        for other in others(value):
            yield f"{key} {other}", dataclasses.replace(of, setting={**of.setting, key: other})


def exports(said: Exported) -> Iterator[tuple[str, Exported]]:
    """A theorem that says another thing: of another term, in another unit, under another reading, another answer."""
    for name, of in terms(said.of):
        yield name, dataclasses.replace(said, of=of)
    yield "unit", dataclasses.replace(said, unit=f"{said.unit}/s")
    yield "readings", dataclasses.replace(said, readings=("another",))
    if said.holds is not None:
        yield "answer", dataclasses.replace(said, holds=not said.holds)
    if said.items:
        yield "no bounds", dataclasses.replace(said, items=tuple((None, None) for _ in said.items))
        yield "one number more", dataclasses.replace(said, items=(*said.items, said.items[0]))
        wide = tuple(
            (None if low is None else str(Fraction(low) - 10**6), None if high is None else str(Fraction(high) + 10**6))
            for low, high in said.items
        )
        yield "wider", dataclasses.replace(said, items=wide)


def predicates(says: Predicate) -> Iterator[tuple[str, Predicate]]:
    """A claim that says another thing."""
    for name, of in terms(says.of):
        yield name, dataclasses.replace(says, of=of)
    yield "unit", dataclasses.replace(says, unit=f"{says.unit}/s")
    yield "reading", dataclasses.replace(says, reading="another")
    if says.relation in FLIPPED:  # what a theorem speaks of, and denies
        yield "relation", dataclasses.replace(says, relation=FLIPPED[says.relation])


def is_on(term: Term, predicate: Predicate, said: Exported) -> bool:
    return said.of == term and said.unit == predicate.unit and predicate.reading in said.readings


def decided(record: ClaimRecord, certificates: list[CertificateRecord], says: tuple[Predicate, ...]) -> Any:
    """What theorems decide of the claim under each reading, or that they contradict each other."""
    try:
        return match(msgspec.structs.replace(record.claim, says=says), record.evidence, certificates).by_reading
    except AuditError:
        return "error"


def attacks(record: ClaimRecord, certificates: list[CertificateRecord]) -> Iterator[tuple[str, Any]]:
    """Each attack on a claim in words, with what came of it."""
    says = record.claim.says
    before, offered = decided(record, certificates, says), [said for one in certificates for said in one.says]
    for which, predicate in enumerate(says):
        rest = (*says[:which], *says[which + 1 :])
        if decided(record, certificates, rest) == before:
            continue  # another part of the claim is false already, and with it the whole
        for name, altered in predicates(predicate):
            another = all(any(is_on(term, altered, said) for said in offered) for term in altered.terms)
            if name == "relation" or not another:  # what a theorem does say is no attack
                yield f"claim, {name}", decided(record, certificates, (*rest, altered))
        fitting = {id(s): dict(exports(s)) for s in offered if any(is_on(t, predicate, s) for t in predicate.terms)}
        # A theorem that another one repeats is altered with it; attacks are alike where their names are.
        for name in dict.fromkeys(name for altered in fitting.values() for name in altered):
            swapped = [
                msgspec.structs.replace(one, says=tuple(fitting.get(id(s), {}).get(name, s) for s in one.says))
                for one in certificates
            ]
            yield f"theorem, {name}", decided(record, swapped, says)


def tried(outcome: Outcome, papers: Container[str]) -> Iterator[tuple[str, bool]]:
    """Each attack on the proved claims of these papers, with whether it succeeds."""
    known = {one.path: one for one in outcome.results.certificates}
    for record in outcome.results.claims:
        if record.judgement.proved and record.paper in papers:
            certificates = [known[path] for path in record.evidence.certificates]
            before = decided(record, certificates, record.claim.says)
            for name, after in attacks(record, certificates):
                yield f"{record.id}: {name}", after == before


def test_no_attack_on_the_wording_of_a_proved_claim_succeeds(
    fresh_run: Outcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("replication.audit.judge.proofs._lacking", lambda *_: "")  # what an attack lacks, in words
    found = list(tried(fresh_run, {paper.key for paper in fresh_run.results.papers}))
    assert [name for name, succeeds in found if succeeds] == []
    assert len(found) >= LEAST


@pytest.mark.parametrize("lax", ["plant", "estimators", "setting", "readings"])
def test_they_succeed_where_a_word_is_not_compared(
    lax: str, fresh_run: Outcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fitting(term: Term, predicate: Predicate, offers: Iterable[tuple[str, Exported]]) -> list[Exported]:
        near = [said for _, said in offers if said.of.quantity == term.quantity and said.unit == predicate.unit]
        for name in {"plant", "estimators", "setting"} - {lax}:
            near = [said for said in near if getattr(said.of, name) == getattr(term, name)]
        return [said for said in near if lax == "readings" or predicate.reading in said.readings]

    monkeypatch.setattr("replication.audit.judge.proofs._fitting", fitting)
    assert any(succeeds for _, succeeds in tried(fresh_run, {"okajima2023"}))

"""From results to records: every claim answered and judged, every erratum proved, each failure on its own."""

import json
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import msgspec

from replication.audit.data import watched
from replication.audit.judge.agreement import stands_there
from replication.audit.judge.numerals import require_found, require_short
from replication.audit.judge.policies import same_fact
from replication.audit.judge.printed import is_print, parse
from replication.audit.judge.proofs import no_theorem
from replication.audit.judge.validate import unused_readings
from replication.audit.judge.verdict import make_record
from replication.audit.model import Claim, Erratum, Evidence, Experiment, Proof, Verdict
from replication.audit.parts import Paper
from replication.audit.run.chance import copied
from replication.audit.run.command import VERSION, unseen
from replication.audit.run.worker import Step, describe
from replication.audit.store.cache import encode
from replication.audit.store.records import (
    SCHEMA_VERSION,
    CertificateRecord,
    ClaimRecord,
    ErratumRecord,
    ExperimentRecord,
    PaperRecord,
    ResultsFile,
    RunRecord,
    shared,
)
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError, meant

T = TypeVar("T")


class Available(Mapping[str, Any]):
    """Results by experiment name, a copy of each; one that is missing says why. read: the names asked for."""

    def __init__(self, held: Mapping[str, Any], missing: Mapping[str, str]) -> None:
        self.held, self._missing, self.read = dict(held), missing, set[str]()

    def __getitem__(self, name: str) -> Any:
        again = name in self.read
        self.read.add(name)
        if name not in self.held:
            message = f"there is no experiment {name}; {meant(name, [*self, *self._missing])}"
            raise AuditError(self._missing.get(name, message))
        self.held[name] = self.held[name] if again else copied(self.held[name])
        return self.held[name]

    def __contains__(self, name: object) -> bool:
        return name in self.held

    def __iter__(self) -> Iterator[str]:
        return iter(self.held)

    def __len__(self) -> int:
        return len(self.held)


@dataclass(frozen=True)
class _Run:
    computed: Mapping[str, Step]
    sources: SourceTree
    certificates: Sequence[CertificateRecord]
    unproved: Mapping[str, str]
    read: set[str]

    def results(self, paper: Paper) -> Available:
        chosen = [(paper.short(one.name), self.computed[one.name]) for one in paper.experiments]
        return Available(
            {name: step.entry.result for name, step in chosen if step.entry is not None},
            {name: f"experiment {step.name} failed: {step.error}" for name, step in chosen if step.entry is None},
        )

    def attempt(
        self, paper: Paper, function: Callable[[Any], T], place: str = ""
    ) -> tuple[T | None, str, Sequence[Experiment]]:
        """The value of a function of the results of its paper, or None and the error; and whose results it read."""
        results, value, error = self.results(paper), None, ""
        try:
            value = function(results)
        except Exception as failure:  # noqa: BLE001 - a paper's function may fail in any way; the rest stands
            error = describe(failure, self.sources, place) + _of_results(failure, results)
        used = [experiment for experiment in paper.experiments if paper.short(experiment.name) in results.read]
        self.read.update(experiment.name for experiment in used)
        return value, error, used


def _of_results(failure: Exception, results: Available) -> str:
    """What an error of a paper's function has to do with the results that it read, in words; empty if nothing."""
    read = {name: results[name] for name in sorted(results.read) if name in results}
    if isinstance(failure, KeyError) and failure.args and isinstance(failure.args[0], str):
        keys = {key for value in read.values() if isinstance(value, dict) for key in value}
        return f"; of the keys of {', '.join(read)}, {meant(failure.args[0], keys)}" if keys else ""
    nothing = [name for name, value in read.items() if value is None]
    return f"; the result of {', '.join(nothing)} is None: return what the claims are to read" if nothing else ""


def assemble(
    papers: Sequence[Paper],
    computed: Mapping[str, Step],
    run: RunRecord,
    sources: SourceTree,
    certificates: Sequence[CertificateRecord],
    unproved: Mapping[str, str],
) -> tuple[ResultsFile, tuple[str, ...], tuple[str, ...]]:
    """The records, the failures that no record carries, and the experiments whose results nobody reads.

    certificates: as they were verified. unproved: why there is none, by claim. A function of a paper that fails becomes
    an error in its record.
    """
    state = _Run(computed, sources, certificates, unproved, set())
    records: list[PaperRecord] = []
    claims: list[ClaimRecord] = []
    errata: list[ErratumRecord] = []
    experiments: list[ExperimentRecord] = []
    failures: list[str] = []
    for paper in papers:
        proofs = {erratum.id: _prove(state, paper, erratum) for erratum in paper.errata}
        answered = [_claim(state, claim, paper, proofs) for claim in paper.claims]
        first = {record.id: record.judgement for record in answered}
        answered = [same_fact(record, first.get(record.claim.repeats)) for record in answered]
        claims.extend(answered)
        failures.extend(
            f"reading {name!r} of {paper.key}: no claim rests on it"
            for name in unused_readings(paper.readings, answered)
        )
        errata.extend(proofs.values())
        experiments.extend(_experiment(state, paper, experiment) for experiment in paper.experiments)
        record, errors = _paper(state, paper)
        records.append(record)
        failures.extend(f"{what} of {paper.key}: {error}" for what, error in errors.items() if error)
    results = ResultsFile(
        schema_version=SCHEMA_VERSION,
        run=run,
        papers=tuple(records),
        claims=tuple(claims),
        errata=tuple(errata),
        figures=(),
        experiments=tuple(experiments),
        certificates=tuple(certificates),
    )
    read = state.read.union(*(figure.uses for paper in papers for figure in paper.figures))
    # What ended in an error may not have come to all that it would read.
    whole = not (failures or any(claim.verdict is Verdict.ERROR for claim in claims) or any(e.error for e in errata))
    unused = tuple(record.name for record in experiments if whole and record.name not in read)
    return results, tuple(failures), unused


def _experiment(state: _Run, paper: Paper, experiment: Experiment) -> ExperimentRecord:
    step = state.computed[experiment.name]
    data = step.entry.data if step.entry is not None else {}
    return ExperimentRecord(
        name=experiment.name,
        paper=paper.key,
        function=step.dependencies.function,
        code=state.sources.location(experiment.function),
        inputs=json.loads(step.dependencies.inputs),
        key=step.dependencies.key if step.entry is None else step.entry.key,
        seconds=step.seconds,
        solvers=step.entry.solvers if step.entry is not None else (),
        error=step.error,
        read=tuple(data),
        untraced=_untraced(state, [experiment]),
        version=next((now for name, now in data.items() if name.startswith(VERSION)), ""),
    )


def _untraced(state: _Run, needs: Iterable[Experiment]) -> tuple[str, ...]:
    """What these experiments did that cannot be followed, and what no one sees of those that are commands."""
    entries = [(need, state.computed[need.name].entry) for need in needs]
    return tuple(
        sorted({words for need, entry in entries for words in (*(entry.untraced if entry else ()), *unseen(need))})
    )


def _behind(paper: Paper, names: Collection[str]) -> Iterator[Experiment]:
    """The experiments of these names, and all that they need."""
    for experiment in paper.experiments:
        if experiment.name in names:
            yield experiment
            yield from _behind(paper, experiment.needs)


def _prove(state: _Run, paper: Paper, erratum: Erratum) -> ErratumRecord:
    proof, error, _ = state.attempt(paper, lambda results: _checked(erratum.prove(results)))
    return ErratumRecord.of(paper.key, erratum, proof, code=state.sources.location(erratum.prove), error=error)


def _claim(state: _Run, claim: Claim, paper: Paper, proofs: Mapping[str, ErratumRecord]) -> ClaimRecord:
    evidence, error, used = _answer(state, claim, paper)
    certificates = [certificate for certificate in state.certificates if claim.id in certificate.claims]
    return make_record(
        msgspec.structs.replace(claim, uses=tuple(experiment.name for experiment in used)),
        evidence,
        proofs[claim.erratum] if claim.erratum is not None else None,
        readings=paper.readings,
        code=state.sources.location(claim.answer),
        seconds=sum((state.computed[experiment.name].seconds for experiment in used), 0.0),
        error=error,
        certificates=certificates,
        untraced=_untraced(state, _behind(paper, [experiment.name for experiment in used])),
        unproved=no_theorem(claim, state.unproved, bool(certificates)),
    )


def _answer(state: _Run, claim: Claim, paper: Paper) -> tuple[Evidence | None, str, Sequence[Experiment]]:
    """What answers the claim, by which experiments. It must not follow when its own print is moved."""
    with watched(claim.printed, claim.place) as watch:
        evidence, error, used = state.attempt(paper, claim.answer, state.sources.location(claim.answer))
    given = [experiment.name for experiment in used if experiment.is_given(claim)]
    if given and evidence is not None and stands_there(_flat(evidence.value), claim.printed):
        wrong = (
            f"claim {claim.id} answers itself: {given[0]} is given {claim.printed} and its value is exactly that; give "
            "the experiment what the print follows from"
        )
        return None, wrong, used
    if not watch.met or evidence is None or not is_print(claim.printed):
        return evidence, error, used
    moved = re.sub(
        r"\d(?=\D|$)(?!\.\d)", lambda digit: str(int(digit[0]) + (-1) ** (digit[0] == "9")), claim.printed, count=1
    )
    with watched(claim.printed, claim.place, moved):
        again, _, _ = state.attempt(paper, claim.answer)
    half = float(parse(claim.printed).entries[0].unit) / 2
    pairs = [] if again is None else [(getattr(evidence, x), getattr(again, x)) for x in ("value", "lower", "upper")]
    if not any(abs(a - b) >= half for old, new in pairs for a, b in zip(_flat(old), _flat(new), strict=False)):
        return evidence, "", used
    assert again is not None
    wrong = (
        f"claim {claim.id} answers itself: with {moved} printed in place of {claim.printed} its value is "
        f"{again.value}, not {evidence.value}; compute it from what its experiments give"
    )
    return None, wrong, used


def _flat(value: object) -> list[float]:
    if isinstance(value, tuple | list):
        return [number for entry in value for number in _flat(entry)]
    return [float(value)] if isinstance(value, int | float) else []


def _paper(state: _Run, paper: Paper) -> tuple[PaperRecord, dict[str, str]]:
    """The record of a paper, and by name of what could not be computed the error, empty if there is none."""
    findings, error, _ = state.attempt(paper, lambda results: _sentences(paper, results))
    moves, unmoved, _ = state.attempt(paper, paper.sensitivity)
    levels, unshared, _ = state.attempt(paper, paper.common)
    record = PaperRecord(
        findings=findings if findings is not None else (f"The findings could not be computed: {error}",),
        sensitivity=tuple(
            msgspec.structs.replace(row, claim=f"{paper.key}.{paper.short(row.claim)}") for row in moves or ()
        ),
        common=levels or (),
        **shared(PaperRecord, paper),
    )
    return record, {"findings": error, "sensitivity": unmoved, "common levels": unshared}


def _checked(proof: object) -> Proof:
    """A proof made of what JSON can hold; AuditError otherwise."""
    if not isinstance(proof, Proof):
        raise AuditError(f"the proof of an erratum must be a Proof, got {proof!r}")
    quantities = {name: float(number) for name, number in proof.quantities.items()}
    encode("the quantities of the proof", quantities)
    return Proof(holds=bool(proof.holds), text=proof.text, quantities=quantities)


def _sentences(paper: Paper, results: Available) -> tuple[str, ...]:
    """The findings, short and with no number that is only typed."""
    findings: object = paper.findings(results)
    if not isinstance(findings, tuple) or not all(isinstance(sentence, str) for sentence in findings):
        raise AuditError(f"findings must be a tuple of sentences, got {findings!r}")
    stated = [text for claim in paper.claims for text in (claim.printed, claim.meant, claim.statement, claim.place)]
    stated += [text for erratum in paper.errata for text in (erratum.printed, erratum.meant)]
    require_found("finding", paper.findings, results.held, [*stated, *map(repr, paper.experiments), paper.title])
    return tuple(map(require_short, findings))

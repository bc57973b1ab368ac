"""Are the papers' claims well formed, in types and in names? All mistakes are told before anything is computed."""

import enum
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache
from typing import Any, get_type_hints

import msgspec

from replication.audit.judge.policies import OF_READINGS, repeated
from replication.audit.judge.proofs import BY_KIND
from replication.audit.model import NO_READING, NUMERIC, Claim, Kind, Policy, Reading, StatedClaim, Verdict
from replication.audit.parts import Paper
from replication.audit.store.records import ClaimRecord, ErratumRecord, FigureRecord, PaperRecord, shared
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError, meant
from replication.verify.predicate import ESTIMATORS, YES_NO, Predicate, in_words, unit_of

_ID = re.compile(r"[a-z0-9][a-z0-9_-]*(\.[a-z0-9][a-z0-9_-]*)+")
_FILE = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


At = Callable[[str], str]


def validate_claims(papers: Sequence[Paper], at: At = lambda name: "") -> None:
    """Check names and references of `papers`; raises AuditError that lists every mistake, one a line.

    at: where the modules of the papers write a name, as ` [file:line]`.
    """
    times = Counter(named for paper in papers for named in _named(paper))
    again = [(what, name, number) for (what, name), number in times.items() if number > 1]
    mistakes = [f"{what} {name!r} is used {number} times; make each one unique" for what, name, number in again]
    for paper in papers:
        mistakes += [*_references(paper, at)]
        for look in (_names, _repeats, _scope, _pins, _readings, _predicates):
            mistakes += [*look(paper)]
    _require("the claims are not well formed", mistakes)


def _require(what: str, mistakes: Sequence[str]) -> None:
    if mistakes:
        count = f"{len(mistakes)} mistake{'s' if len(mistakes) > 1 else ''}"
        raise AuditError("\n".join([f"{what}, {count}:", *(f"- {text}" for text in mistakes)]))


def _named(paper: Paper) -> Iterator[tuple[str, str]]:
    """The names that a paper gives, each with what it is of."""
    yield "paper key", paper.key
    yield from (("claim id", claim.id) for claim in paper.claims)
    yield from (("erratum id", erratum.id) for erratum in paper.errata)
    yield from (("experiment name", experiment.name) for experiment in paper.experiments)
    yield from (("figure name", figure.name) for figure in paper.figures)


def _names(paper: Paper) -> Iterator[str]:
    for what, name in _named(paper):
        if what == "claim id" and not (_ID.fullmatch(name) and name.startswith(f"{paper.key}.")):
            yield f"claim id {name!r} must be lower-case words joined by dots that begin with {paper.key + '.'!r}"
        if what in ("experiment name", "figure name") and not name.startswith(paper.key):
            yield f"{what} {name!r} must begin with the key of its paper, {paper.key!r}"
        if what == "experiment name" and not _FILE.fullmatch(name):
            yield f"{what} {name!r} cannot name a file; use letters, digits, '.', '_' and '-'"


def _references(paper: Paper, at: At) -> Iterator[str]:
    known: dict[str, set[str]] = {"reading": {NO_READING, *(reading.name for reading in paper.readings)}}
    for what, name in _named(paper):
        known.setdefault(what.partition(" ")[0], set()).add(name)
    named: list[tuple[str, str, Iterable[str]]] = []
    for claim in paper.claims:
        named += [(f"claim {claim.id!r}", "names erratum", [] if claim.erratum is None else [claim.erratum])]
        named += [(f"claim {claim.id!r}", "names reading", [claim.reading] if claim.reading else [])]
    named += [(f"experiment {needing.name!r}", "needs experiment", needing.needs) for needing in paper.experiments]
    named += [(f"figure {figure.name!r}", "uses experiment", figure.uses) for figure in paper.figures]
    named += [(f"paper {paper.key!r}", "replies to claim", [reply.claim for reply in paper.replies])]
    for table in paper.tables:
        named += [(f"table {table.place!r} of {paper.key}", "shows claim", table.claims)]
    for item in paper.scope:
        where = f"scope item {item.part!r} of {paper.key}"
        named += [(where, "lists claim", item.claims), (where, "lists figure", item.figures)]
    for user, verb, names in named:
        candidates = known.get(verb.split()[-1], set())
        yield from (
            f"{user} {verb} {name!r}, which does not exist; {meant(name, candidates)}{at(name)}"
            for name in names
            if name not in candidates
        )


def _repeats(paper: Paper) -> Iterator[str]:
    known = {claim.id: claim for claim in repeated(paper.claims)}
    for claim in paper.claims:
        if claim.repeats != known[claim.id].repeats:
            yield (
                f"claim {claim.id!r} is said to repeat {claim.repeats!r}; by the predicates it repeats "
                f"{known[claim.id].repeats or 'none'!r}; leave repeats to `paper`, which fills it in"
            )
        elif claim.repeats and claim.expected is not known[claim.repeats].expected:
            yield (
                f"claim {claim.id!r} pins {str(claim.expected)!r} and says the same as {claim.repeats!r}, which pins "
                f"{str(known[claim.repeats].expected)!r}; one fact has one verdict"
            )


def _scope(paper: Paper) -> Iterator[str]:
    for item in paper.scope:
        if not (item.claims or item.figures or item.reason):
            where = f"scope item {item.part!r} of {paper.key}"
            yield f"{where} lists no claim and no figure, and gives no reason for leaving this part out"
    covered = {name for item in paper.scope for name in item.claims}
    for claim in paper.claims:
        if claim.id not in covered:
            yield f"claim {claim.id!r} is in no scope item of {paper.key}; list it under the part that it checks"


def _pins(paper: Paper) -> Iterator[str]:
    for claim in paper.claims:
        if claim.expected is Verdict.ERROR:
            yield f"claim {claim.id!r} pins the verdict error, which is no finding; pin what the evidence shows"
        if claim.expected is Verdict.REPRODUCED_AFTER_ERRATUM and claim.erratum is None:
            yield f"claim {claim.id!r} pins {str(claim.expected)!r} and names no erratum"
        if claim.meant and (claim.erratum is None or not claim.printed):
            yield f"claim {claim.id!r} means {claim.meant!r} in place of a print; it needs that print, and its erratum"
        for erratum in paper.errata:
            theirs, ours = (erratum.printed, erratum.meant), (claim.printed, claim.meant)
            if claim.meant and erratum.id == claim.erratum and theirs != ours:
                yield (
                    f"claim {claim.id!r} ({claim.place}) corrects {ours[0]!r} to {ours[1]!r}, and its erratum "
                    f"{erratum.id!r} ({erratum.place}) {theirs[0]!r} to {theirs[1]!r}; look into the text, and take "
                    "both from one entry of printed.toml"
                )
        if claim.optimum and claim.kind is not Kind.VALUE:
            yield f"claim {claim.id!r} of kind {claim.kind} is said to be an optimum; only a value can be one"
        if (claim.tolerance is None) != (not claim.tolerance_reason):
            yield f"claim {claim.id!r} must give tolerance and tolerance_reason together or neither"


def _readings(paper: Paper) -> Iterator[str]:
    for name, times in Counter(reading.name for reading in paper.readings).items():
        if times > 1:
            yield f"reading {name!r} of {paper.key} is defined {times} times; define it once"
    for reading in paper.readings:
        if reading.name in ("", NO_READING):
            yield f"a reading of {paper.key} is called {reading.name!r}, which says that there is none; rename it"
        if not reading.place or not reading.text:
            yield f"reading {reading.name!r} of {paper.key} needs the place that leaves the choice, and its text"
        if (reading.accuracy is None) == (reading.policy is Policy.SOLVER):
            yield f"reading {reading.name!r} of {paper.key}: an accuracy belongs to a solver's level, and only to one"
        if reading.policy not in (None, *OF_READINGS):
            yield f"reading {reading.name!r} of {paper.key} has the policy {str(reading.policy)!r}, of no reading"
    if sum(reading.policy is Policy.SOLVER for reading in paper.readings) > 1:
        yield f"{paper.key} has two readings of the level that a solver found; give one, with one accuracy"
    for claim in paper.claims:
        if not claim.reading:
            yield f'claim {claim.id!r} names no reading; say reading="none" if the text leaves no choice'


def _predicates(paper: Paper) -> Iterator[str]:
    known = {reading.name for reading in paper.readings} | {NO_READING}
    for claim in paper.claims:
        for predicate in claim.says:
            mistakes = [*_terms(predicate), *_relation(predicate)] or [*_print(claim, predicate)]
            yield from (f"claim {claim.id!r} {mistake}" for mistake in mistakes)
            if predicate.reading not in known:
                yield f"claim {claim.id!r} says something under {predicate.reading!r}, a reading that nobody defines"


def _terms(predicate: Predicate) -> Iterator[str]:
    for term in predicate.terms:
        unit = unit_of(term.quantity)
        if not unit:
            yield (
                f"speaks of {term.quantity!r}, which is no known quantity; give one of the paper's own statements its "
                "unit in brackets, such as 'final size [1]', or add it to replication/verify/quantities.toml"
            )
        elif not predicate.unit:
            yield f"says something of {term.quantity!r} without a unit; it has the unit {unit!r}"
        elif predicate.unit != unit:
            yield f"says something of {term.quantity!r} in the unit {predicate.unit!r}; it has the unit {unit!r}"
        if term.estimators not in ESTIMATORS and term.estimators:
            where = "replication/verify/predicate.py"
            yield f"speaks of the estimators {term.estimators!r}, which are no known class; add it to {where}"


def _print(claim: Claim, predicate: Predicate) -> Iterator[str]:
    """Of a number a theorem decides whether it is the print, and nothing weaker or beside it."""
    if (
        claim.kind in NUMERIC
        and predicate.unit != YES_NO
        and (predicate.relation, predicate.to) != ("is", claim.printed)
    ):
        yield (
            f"prints {claim.printed!r} and says as data: {in_words(predicate)}; a number "
            f'is what is printed: leave out relation and number, or say relation="is" and to="{claim.printed}"'
        )


def _relation(predicate: Predicate) -> Iterator[str]:
    relation, to = predicate.relation, predicate.to
    if (relation in ("holds", "fails")) != (predicate.unit == YES_NO):
        yield f"says that {predicate.of.quantity!r} {relation}, but its unit is {predicate.unit!r}"
    if (relation in ("holds", "fails")) != (to is None):
        yield f"says that {predicate.of.quantity!r} {relation} {to or 'nothing'}; leave that out, or say what it is"
    if isinstance(to, str) and relation not in ("is", "is not"):
        try:
            Fraction(to)
        except (ValueError, ZeroDivisionError):
            yield f"says that {predicate.of.quantity!r} is {relation} {to!r}, which is no number"


def validate_theorems(papers: Sequence[Paper], named: Collection[str], excused: Collection[str]) -> None:
    """Every claim has theorems and says something as data, or a reason why there is none; AuditError lists the others.

    named: ids of the claims that theorems support. excused: of those with a reason. A paper with neither asks for none.
    """
    mistakes = []
    asking = {name.partition(".")[0] for name in (*named, *excused)}
    for claim in (claim for paper in papers if paper.key in asking for claim in paper.claims):
        if claim.id in named and not claim.says:
            mistakes.append(
                f"claim {claim.id!r} has theorems and states no predicate; give says=... where it is declared"
            )
        if claim.id not in named and claim.id not in excused and claim.kind not in BY_KIND:
            mistakes.append(f"claim {claim.id!r} has no theorem and no reason in theorems.json why there is none")
    _require("the claims and the theorems do not fit", mistakes)


def unused_readings(readings: Iterable[Reading], claims: Sequence[ClaimRecord]) -> tuple[str, ...]:
    """The names of a paper's readings under which none of its claims was answered; none while a claim is an error."""
    if any(claim.verdict is Verdict.ERROR for claim in claims):
        return ()
    used = {name for claim in claims for name in claim.rested}
    by_solver = any(Policy.SOLVER in claim.judgement.policies for claim in claims)
    return tuple(
        reading.name for reading in readings if reading.name not in used and not (by_solver and reading.accuracy)
    )


def require_typed(papers: Sequence[Paper], sources: SourceTree) -> None:
    """Raise AuditError that lists every field of another type than its record has, with file and line."""
    _require("the papers are not well formed", [text for paper in papers for text in _paper(paper, sources)])


def _paper(paper: Paper, sources: SourceTree) -> Iterator[str]:
    package = "/".join(name for name in sources.packages if name != "replication")
    yield from _fields(f"paper {paper.key!r}", PaperRecord, paper, f"{package}/{paper.key}")
    for claim in paper.claims:
        yield from _fields(f"claim {claim.id!r}", StatedClaim, claim, sources.location(claim.answer))
    for erratum in paper.errata:
        yield from _fields(f"erratum {erratum.id!r}", ErratumRecord, erratum, sources.location(erratum.prove))
    for figure in paper.figures:
        yield from _fields(f"figure {figure.name!r}", FigureRecord, figure, sources.location(figure.data))
    for experiment in paper.experiments:
        inputs: Any = experiment.inputs
        if not isinstance(inputs, Mapping):
            where = sources.location(experiment.function)
            yield f"experiment {experiment.name!r}: inputs is {inputs!r:.80}; give a dictionary [{where}]"


def _fields(what: str, record: type[msgspec.Struct], declared: Any, where: str) -> Iterator[str]:
    for name, value in shared(record, declared).items():
        if wrong := _wrong(value, _hints(record)[name]):
            yield f"{what}: {name} is {value!r:.80}; {wrong} [{where}]"
    uses = getattr(declared, "uses", ())
    if not isinstance(uses, tuple | list) or not all(isinstance(name, str) for name in uses):
        yield f"{what}: uses is {uses!r:.80}; give a tuple of names, of one name with a comma: ('name',) [{where}]"


_hints = cache(get_type_hints)


def _wrong(value: Any, kind: Any) -> str:
    """Why a value cannot stand in a field of that type; empty if it can."""
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        known = ", ".join(f"{kind.__name__}.{member.name}" for member in kind)
        return "" if isinstance(value, kind) else f"write one of {known}"
    if isinstance(value, str):
        value = str(value)
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        text = 'a printed value is a string, whose digits are its tolerance: "1.50"' if kind is str else "correct it"
        return f"{str(error).lower()}; {text}"
    return ""

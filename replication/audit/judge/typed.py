"""Are the papers' declarations made of what they must be made of? A dataclass takes anything; the records do not."""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any, get_type_hints

import msgspec

from replication.audit.parts import Paper
from replication.audit.store.records import ErratumRecord, FigureRecord, PaperRecord, StatedClaim, shared
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError


def require_typed(papers: Sequence[Paper], sources: SourceTree) -> None:
    """Raise AuditError that lists every field of another type than its record has, with file and line."""
    mistakes = [text for paper in papers for text in _paper(paper, sources)]
    if mistakes:
        raise AuditError("\n".join(["the papers are not well formed:", *(f"- {text}" for text in mistakes)]))


def _paper(paper: Paper, sources: SourceTree) -> Iterator[str]:
    yield from _fields(f"paper {paper.key!r}", PaperRecord, paper, _folder(paper, sources))
    for claim in paper.claims:
        yield from _fields(f"claim {claim.id!r}", StatedClaim, claim, sources.location(claim.answer))
    for erratum in paper.errata:
        yield from _fields(f"erratum {erratum.id!r}", ErratumRecord, erratum, sources.location(erratum.prove))
        yield from _uses(f"erratum {erratum.id!r}", erratum.uses, sources.location(erratum.prove))
    for figure in paper.figures:
        yield from _fields(f"figure {figure.name!r}", FigureRecord, figure, sources.location(figure.data))
        yield from _uses(f"figure {figure.name!r}", figure.uses, sources.location(figure.data))
    for experiment in paper.experiments:
        inputs: Any = experiment.inputs
        if not isinstance(inputs, Mapping):
            where = sources.location(experiment.function)
            yield f"experiment {experiment.name!r}: inputs is {inputs!r:.80}; give a dictionary [{where}]"


def _folder(paper: Paper, sources: SourceTree) -> str:
    return f"{'/'.join(name for name in sources.packages if name != 'replication')}/{paper.key}"


def _fields(what: str, record: type[msgspec.Struct], declared: Any, where: str) -> Iterator[str]:
    hints = _hints(record)
    for name, value in shared(record, declared).items():
        if name != "uses" and (wrong := _wrong(value, hints[name])):
            yield f"{what}: {name} is {value!r:.80}; {wrong} [{where}]"
    if record is StatedClaim:
        yield from _uses(what, declared.uses, where)


_hints = cache(get_type_hints)


def _uses(what: str, uses: Any, where: str) -> Iterator[str]:
    if not isinstance(uses, tuple | list) or not all(isinstance(name, str) for name in uses):
        yield f"{what}: uses is {uses!r:.80}; give a tuple of names, of one name with a comma: ('name',) [{where}]"


def _wrong(value: Any, wanted: Any) -> str:
    """Why a value cannot stand in a field of that type; empty if it can."""
    if isinstance(wanted, type) and issubclass(wanted, enum.Enum):
        known = ", ".join(f"{wanted.__name__}.{member.name}" for member in wanted)
        return "" if isinstance(value, wanted) else f"write one of {known}"
    if isinstance(value, str):
        value = str(value)
    try:
        msgspec.convert(value, wanted)
    except msgspec.ValidationError as error:
        text = 'a printed value is a string, whose digits are its tolerance: "1.50"' if wanted is str else "correct it"
        return f"{str(error).lower()}; {text}"
    return ""

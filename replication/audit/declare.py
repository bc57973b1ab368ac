"""How a paper is declared: its parts in the order of the text, each claim on the function that answers it.

Names are short where they are declared and used; `paper` puts the key of the paper in front. All that the modules of a
paper are written with can be imported from here.
"""

from __future__ import annotations

import inspect
import sys
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from functools import partial, partialmethod
from pathlib import Path, PurePosixPath
from typing import Any, TypedDict, TypeVar, Unpack

import msgspec

from replication.audit.brief import Consequence
from replication.audit.data import PrintedValue, leaves
from replication.audit.judge.agreement import MARKS
from replication.audit.judge.policies import repeated
from replication.audit.judge.printed import is_print
from replication.audit.judge.printed import number as number
from replication.audit.model import NUMERIC, Claim, Experiment, Kind, Verdict
from replication.audit.model import Erratum as Erratum
from replication.audit.model import Evidence as Evidence
from replication.audit.model import Proof as Proof
from replication.audit.model import Reading as Reading
from replication.audit.model import Results as Results
from replication.audit.parts import CELL, Paper, ScopeItem
from replication.audit.parts import Figure as Figure
from replication.audit.parts import FigureData as FigureData
from replication.audit.parts import Formula as Formula
from replication.audit.parts import Table as Table
from replication.audit.run.command import OUTPUT, execute
from replication.audit.run.tracing import FIXED
from replication.errors import AuditError, one_of
from replication.verify.predicate import Predicate, Term, unit_of
from replication.verify.predicate import term as term

T = TypeVar("T")
Answer = TypeVar("Answer", bound=Callable[[Results], Evidence])
Said = Term | Predicate


def usual(kind: Kind, printed: str) -> Verdict:
    """The verdict that a claim pins unless it says otherwise: agreement; `compatible` of one printed draw."""
    if kind in NUMERIC:
        return Verdict.REPRODUCED
    if kind is Kind.CITED:
        return Verdict.UNDETERMINED
    return Verdict.COMPATIBLE if kind is Kind.STATISTICAL and printed else Verdict.CONSISTENT


_made: weakref.WeakSet[Part] = weakref.WeakSet()
"""Every part there is, so that one which no paper lists is found."""


STATED = "claims.toml"
"""Where claims without Python stand, beside the modules of a paper; `audit.numbers` reads it."""


def unlisted(paper: Paper, folder: Path) -> list[str]:
    """Claims that a module of the paper or its claims.toml declares, and that it lacks; folder: of the papers."""
    known, front = {claim.id for claim in paper.claims}, f"{folder.name}.{paper.key}."
    parts = [part for part in _made if f"{part.module}.".startswith(front)]
    lost = [(part, [claim.id for claim in part.claims if f"{paper.key}.{claim.id}" not in known]) for part in parts]
    entries = [f"{', '.join(names[:4])} of Part({part.title!r}) in {part.module}" for part, names in lost if names]
    stated = folder / paper.key / STATED
    places = [getattr(claim.answer, "declared", ("",))[0] for claim in paper.claims]
    if stated.is_file() and str(stated) not in places:
        entries.append(f"those of {stated}, which `numbers(__file__)` reads")
    return sorted(entries)


class Further(TypedDict, total=False):
    """Fields of `Claim` that a declaration hands on."""

    tolerance: str | None
    tolerance_reason: str
    erratum: str | None
    uncertainty: str
    optimum: bool
    ours: bool


class Part:
    """One part of a paper, as its scope calls it, with the claims declared on it and the figures that belong to it.

    A part without claims and figures says by `reason` why it is left out. also: claims of other parts on it.
    reading: that of its claims, unless one of them names another.
    """

    def __init__(
        self,
        title: str,
        *,
        reading: str = "",
        figures: str | Iterable[str] = (),
        also: str | Iterable[str] = (),
        reason: str = "",
    ) -> None:
        self.title, self.reading, self.reason = title, reading, reason
        self.figures, self.also = _names(figures), _names(also)
        self.claims: list[Claim] = []
        self.module: str = sys._getframe(1).f_globals.get("__name__", "")
        _made.add(self)

    def claim(
        self,
        kind: Kind,
        name: str,
        printed: str = "",
        *,
        place: str = "",
        statement: str = "",
        pinned: Verdict | str = "",
        meant: str = "",
        reading: str = "",
        consequence: Consequence | str | None = None,
        says: Said | Iterable[Said] = (),
        **further: Unpack[Further],
    ) -> Callable[[Answer], Answer]:
        """Declare a claim on the function that answers it, as a decorator or on a function made for the purpose.

        name: its id without the key of the paper. printed: the printed string; one of a data file brings its place.
        statement: in plain words, the docstring of the function unless given. pinned: the expected verdict, that of
        agreement unless given. says: predicates, or terms of which the claim says that they are as printed, or hold if
        nothing is. further: as of `Claim`.
        Raises AuditError if there is no place, no statement, no such verdict, or no such field.
        """
        for field in further:
            one_of(f"field of claim {name!r}:", field, [*(Part.claim.__kwdefaults__ or ()), *Further.__annotations__])

        def declare(answer: Answer) -> Answer:
            sentence = statement or " ".join((inspect.getdoc(_inner(answer)) or "").split())
            where = place or (printed.place if isinstance(printed, PrintedValue) else "")
            if not isinstance(printed, str):
                raise AuditError(
                    f"claim {name!r} prints {printed!r:.80}; write a string, whose digits are its tolerance, or "
                    "declare a claim on each entry"
                )
            for what, text in (("place", where), ("statement", sentence)):
                if not text:
                    raise AuditError(f"claim {name!r} has no {what}; give {what}=... where it is declared")
            pin = one_of(f"verdict of claim {name!r}:", pinned or usual(kind, str(printed)), [*Verdict])
            if consequence:
                one_of(f"consequence of claim {name!r}:", consequence, [*Consequence])
            self.claims.append(
                Claim(
                    id=name,
                    place=where,
                    kind=kind,
                    statement=sentence,
                    expected=Verdict(pin),
                    answer=answer,
                    printed=str(printed),
                    meant=_plain(meant),
                    reading=reading or self.reading,
                    consequence=Consequence(consequence) if consequence else None,
                    says=_said(kind, str(printed), reading or self.reading, says),
                    unit=getattr(printed, "unit", ""),
                    remark=getattr(printed, "note", ""),
                    **further,
                )
            )
            return answer

        return declare

    value = partialmethod(claim, Kind.VALUE)
    matrix = partialmethod(claim, Kind.MATRIX)
    bound = partialmethod(claim, Kind.BOUND)
    order = partialmethod(claim, Kind.ORDER)
    feasible = partialmethod(claim, Kind.FEASIBLE)
    statistical = partialmethod(claim, Kind.STATISTICAL)

    def cited(
        self,
        name: str,
        printed: str = "",
        *,
        reason: str,
        settled_by: str = "",
        line: tuple[str, int] | None = None,
        **told: Any,
    ) -> None:
        """Declare a claim that cannot be settled from the text, with the reason, and what would settle it.

        line: file and line where it is declared, if that is not where this is called.
        """
        if not reason.strip():
            raise AuditError(f"claim {name!r} has no reason; say why the text does not settle it")
        caller = sys._getframe(1)
        place = line or (caller.f_code.co_filename, caller.f_lineno)
        self.claim(Kind.CITED, name, printed, **told)(declared(place, partial(_not_checkable, reason, settled_by)))


def declared(place: tuple[str, int] | None, answer: partial[Evidence]) -> partial[Evidence]:
    """An answer that serves several claims, with file and line where this one of them is declared."""
    answer.declared = place  # type: ignore[attr-defined]
    return answer


def _not_checkable(reason: str, settled_by: str, results: Results) -> Evidence:
    return Evidence(method="", not_checkable=reason, settled_by=settled_by)


ROUNDING = 1e-10
"""Residuals of an identity below this are rounding: the data are of size one."""


def contrast(
    text: str,
    corrected: Mapping[str, float],
    printed: Mapping[str, float],
    *,
    wrong: float | None = None,
) -> Proof:
    """A proof by residuals: rounding where corrected, and as printed at least `wrong`, or more than rounding."""
    vanish = all(value <= ROUNDING for value in corrected.values())
    remain = all(value > ROUNDING if wrong is None else value >= wrong for value in printed.values())
    return Proof(holds=vanish and remain, text=text, quantities={**corrected, **printed})


def positive(margin: float, **told: Any) -> Evidence:
    """Evidence of a statement that holds if a margin is positive; told: the other fields of `Evidence`."""
    return Evidence(holds=margin > 0, margin=margin, **told)


def below(residual: float, threshold: float, reason: str, **told: Any) -> Evidence:
    """Evidence of a statement that holds if a residual is below a threshold; reason: why that much is allowed."""
    return Evidence(
        holds=residual < threshold,
        margin=threshold - residual,
        threshold=threshold,
        threshold_reason=reason,
        **told,
    )


def rounded(residual: float, *, zero: float = ROUNDING, **told: Any) -> Evidence:
    """Evidence of an identity, which holds up to the rounding of what is computed; residual: relative to its terms."""
    return below(residual, zero, "An identity holds up to the rounding of its terms, relative to their size.", **told)


def experiment(name: str, function: Callable[..., Any], /, **inputs: Any) -> Experiment:
    """An experiment under its short name; inputs: JSON values, in which printed values become plain strings.

    One that needs more or less time than `run --timeout` allows is `replace(experiment(...), timeout=seconds)`.
    """
    prints = frozenset((str(value), value.place) for _, value in leaves(inputs) if isinstance(value, PrintedValue))
    return Experiment(name=name, function=function, inputs=_plain(inputs), given=prints)


def command(
    name: str,
    line: Sequence[str],
    /,
    *,
    reads: Iterable[str] = (),
    writes: Iterable[str] = (),
    answer: str = OUTPUT,
    version: Sequence[str] = (),
    environment: str = "",
    variables: Iterable[str] = (),
    needs: str | Iterable[str] = (),
    timeout: float | None = None,
) -> Experiment:
    """An experiment that is a command in any language, under its short name.

    It runs in an empty folder with copies of the files that it reads, has an empty HOME, and sees of the environment
    PATH and `variables`. Its result is what it prints, as JSON, or what a file holds that it writes.

    Parameters
    ----------
    line
        The program and its arguments, such as `["Rscript", "fit.R"]`.
    reads
        Files and folders of the project, by their paths in it; hidden files are left out.
    writes
        Files that it makes; those that need it get them under the same names.
    answer
        Of these the one with the result, `.json` or `.csv`; a table becomes a list for each column.
    version
        A command that prints the version of the program, such as `["Rscript", "--version"]`.
    environment
        A file of the project that lists the packages of that language, such as `"renv.lock"`.
    variables
        Names of variables of the environment that it may read.
    needs
        Other commands that run before it, and whose files it gets.
    timeout
        Seconds after which it is ended, with all that it started.

    Raises
    ------
    AuditError
        For a line that is no list of words, a path outside the project, or an answer that it does not write.
    """
    fields = {"command": line, "version": version, "reads": reads, "writes": writes, "variables": variables}
    for field, value in fields.items():
        if isinstance(value, str) or not all(isinstance(word, str) and word for word in value):
            raise AuditError(f"command {name!r}: {field} is {value!r:.80}; write a list of words")
    inputs = {field: list(value) for field, value in fields.items()}
    if not inputs["command"]:
        raise AuditError(f"command {name!r} has no program; write [program, argument, ...]")
    for path in (*inputs["reads"], *inputs["writes"], *([environment] if environment else [])):
        if PurePosixPath(path).is_absolute() or ".." in PurePosixPath(path).parts:
            raise AuditError(f"command {name!r}: {path!r} leads out of the project; copy it into the project")
    if answer != OUTPUT and (answer not in inputs["writes"] or not answer.endswith((".json", ".csv"))):
        raise AuditError(f"command {name!r}: answer {answer!r} must be a .json or .csv file among writes=[...]")
    if fixed := sorted(FIXED.keys() & set(inputs["variables"])):
        raise AuditError(
            f"command {name!r}: {fixed[0]} is {FIXED[fixed[0]]} for every command; begin the line with env to change it"
        )
    if timeout is not None and not (isinstance(timeout, int | float | Decimal) and 0 < timeout < float("inf")):
        raise AuditError(f"command {name!r}: timeout is {timeout!r}; give positive seconds")
    inputs |= {"answer": answer, "environment": environment}  # type: ignore[dict-item]
    return Experiment(
        name=name, function=execute, inputs=inputs, timeout=timeout and float(timeout), needs=_names(needs)
    )


def paper(
    *,
    key: str,
    parts: Iterable[Part],
    experiments: Iterable[Experiment],
    errata: Iterable[Erratum] = (),
    figures: Iterable[Figure] = (),
    tables: Iterable[Table] = (),
    **about: Any,
) -> Paper:
    """The paper, names in full. about: the other fields of `Paper`: title, authors, readings, findings and the like.

    Raises AuditError for a name that has the key in front already, and for an erratum of a number that nothing prints.
    """

    def one(name: str, link: str = ".") -> str:
        if name.startswith(key + link):
            raise AuditError(f"the name {name!r} begins with the key of its paper; leave {key + link!r} out")
        return f"{key}{link}{name}"

    def fully(entry: T, link: str = ".", **changes: Any) -> T:
        """The same with its name and those of what it uses in full."""
        for field in ("id", "name", "uses", "needs"):
            value: Any = getattr(entry, field, None)
            if field in ("id", "name") and value is not None:
                changes[field] = one(value, link)
            elif value is not None:
                changes[field] = tuple(map(one, _names(value)))
        change: Any = msgspec.structs.replace if isinstance(entry, msgspec.Struct) else replace
        return change(entry, **changes)  # type: ignore[no-any-return]

    def cell(text: str) -> str:
        return CELL + one(text.removeprefix(CELL)) if text.startswith(CELL) else str(text)

    parts, errata, by_title = tuple(parts), tuple(errata), dict[str, list[Part]]()
    for part in parts:  # what code and what the printed data declare on one section is one item of the scope
        by_title.setdefault(part.title, []).append(part)
    prints = {claim.printed for part in parts for claim in part.claims}
    for erratum in errata:  # a number that was typed beside the printed ones can differ from them
        typed = not isinstance(erratum.printed, PrintedValue) and erratum.printed not in prints
        if typed and is_print(erratum.printed):
            raise AuditError(
                f"erratum {erratum.id!r} ({erratum.place}) has {erratum.printed!r} as printed, which no claim prints; "
                "look into the text, and take the number from DATA, the entries of printed.toml"
            )
    return Paper(
        key=key,
        claims=tuple(
            fully(claim, erratum=claim.erratum and one(claim.erratum), repeats=claim.repeats and one(claim.repeats))
            for claim in repeated(claim for part in parts for claim in part.claims)
        ),
        scope=tuple(
            ScopeItem(
                part=title,
                claims=tuple(one(name) for p in same for name in (*(claim.id for claim in p.claims), *p.also)),
                figures=tuple(one(name, "-") for part in same for name in part.figures),
                reason=" ".join(part.reason for part in same if part.reason),
            )
            for title, same in by_title.items()
        ),
        experiments=tuple(map(fully, experiments)),
        errata=tuple(fully(entry, printed=_plain(entry.printed), meant=_plain(entry.meant)) for entry in errata),
        figures=tuple(fully(figure, "-") for figure in figures),
        tables=tuple(
            msgspec.structs.replace(table, rows=tuple(tuple(map(cell, row)) for row in table.rows)) for table in tables
        ),
        **about,
    )


def _said(kind: Kind, printed: str, reading: str, says: Said | Iterable[Said]) -> tuple[Predicate, ...]:
    """The predicates in full: relation and number as printed, unit of the quantity, reading of the claim."""
    entries = []
    for entry in (says,) if isinstance(says, Term | Predicate) else says:
        if isinstance(entry, Term):
            mark = next((mark for mark in MARKS if printed.startswith(mark)), "")
            relation = MARKS[mark] if mark else "is" if kind in (Kind.VALUE, Kind.MATRIX) else "holds"
            to = None if relation == "holds" else printed.removeprefix(mark).strip()
            entry = Predicate(of=entry, relation=relation, to=to)
        entries.append(replace(entry, unit=entry.unit or unit_of(entry.of.quantity), reading=entry.reading or reading))
    return tuple(entries)


def _names(names: str | Iterable[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _plain(value: Any) -> Any:
    if isinstance(value, PrintedValue):
        return str(value)
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    return type(value)(map(_plain, value)) if type(value) in (list, tuple) else value


def _inner(function: Any) -> Any:
    while isinstance(function, partial) or hasattr(function, "__wrapped__"):
        function = function.func if isinstance(function, partial) else function.__wrapped__
    return function

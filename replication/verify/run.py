"""Verification of certificate files: subject, statement, bound, witness, in this order; and the sentence proved."""

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from replication.verify import delay, dualrate, multirate, nonuniform, subjects
from replication.verify.reading import content, fields, parse, rational, text
from replication.verify.statement import Statement, collected
from replication.verify.subjects import ROOT, folder_of, papers
from replication.verify.theorem import Refused, Theorem, require, same
from replication.verify.workers import in_order

STATEMENTS = collected(delay, dualrate, multirate, nonuniform)
"""All that can be proved, by name: `statement`s of the modules that these families import."""
FIELDS = ("format", "paper", "name", "claims", "statement", "plant", "parameters", "bound", "witness")


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What came of one certificate: the theorem, or the reason why nothing is proved.

    about: the paper whose plant and theorem it is about, or that the plant is somebody's own.
    """

    path: Path
    theorem: Theorem | None
    reason: str = ""
    about: str = ""

    def line(self) -> str:
        """What to print of it, on one line. Where the claim is false, the sentence says why it is."""
        # A name of a file that could be read as the rest of a line is quoted.
        path = repr(str(self.path)) if ": " in str(self.path) else str(self.path)
        if self.theorem is None:
            return f"NOT PROVED {path}: {self.reason}"
        false = "" if self.theorem.holds is not False else " the claim does not hold:"
        return f"proved {path}: {self.about}:{false} {self.theorem.sentence}"


def verify(path: Path, root: Path = ROOT) -> Outcome:
    """Read and check one certificate file; never raises on account of what it holds."""
    try:
        certificate = parse(content(path))
        theorem = check(certificate, root, subjects.wanted_at(path, root))
        subjects.require_file(certificate, path)
    except Exception as failure:  # noqa: BLE001 - whatever ends a check, nothing is proved then, and the reason is told
        return Outcome(path=path, theorem=None, reason=_told(failure))
    return Outcome(path=path, theorem=theorem, about=certificate["paper"] or "own plant")


def _told(failure: Exception) -> str:
    if isinstance(failure, OSError):
        return f"the file cannot be read: {failure.strerror}"
    return str(failure) if isinstance(failure, Refused) else f"the check ended in {type(failure).__name__}: {failure}"


def check(certificate: Any, root: Path = ROOT, place: tuple[str, str] | None = None) -> Theorem:
    """The theorem that a certificate proves; raises Refused.

    A certificate of a paper must be about exactly what the paper's data and list of theorems say; one of a plant of
    one's own has `paper` null and supports no claims. place: the paper and the name that it must have, if any.
    """
    values = dict(zip(FIELDS, fields(certificate, "certificate", *FIELDS), strict=True))
    subjects.require_form(values, place)
    stated = {side: rational(number, f"bound.{side}") for side, number in values["bound"].items()}
    if values["paper"] is not None:
        for field, expected in subjects.subject(values["paper"], values["name"], root).items():
            require(same(values[field], expected), f"{field} is not that of the wanted theorem {values['name']}")
    name = text(values["statement"], "statement")
    statement = STATEMENTS[name] if name in STATEMENTS else own_statement(name, values["paper"], root)
    return statement(certificate, stated)


def own_statement(name: str, paper: str | None, root: Path) -> Statement:
    """A statement of a paper's statements.py, which begins with its key, and stands with its certificates alone."""
    module = None if paper is None else subjects.loaded(folder_of(root) / paper / "statements.py")
    declared = [value for value in vars(module).values() if isinstance(value, Statement)] if module else []
    for item in declared:
        require(
            item.name.startswith(f"{paper}."),
            f"{paper}/statements.py declares {item.name}, which must begin with {paper}.",
        )
    matches = [item for item in declared if item.name == name]
    require(matches != [], f"there is no statement {name!r:.60}")
    return matches[0]


def committed(root: Path = ROOT) -> list[Path]:
    """The file that each wanted theorem of each paper must have, and any other certificate there is."""
    wanted = [
        root / "certificates" / key / f"{name}.json" for key in papers(root) for name in subjects.theorems(key, root)[0]
    ]
    others = sorted(set((root / "certificates").rglob("*.json")) - set(wanted))
    return [*wanted, *others]


def listed(paths: Sequence[Path], root: Path = ROOT) -> list[Path]:
    """The certificates of files and folders; all that is committed if none is named."""
    files = [file for path in paths for file in (sorted(path.rglob("*.json")) if path.is_dir() else [path])]
    return files if paths else committed(root)


def report(paths: Sequence[Path], root: Path = ROOT, jobs: int | None = 1) -> int:
    """Verify files and folders, or all that is committed if none is named; print a line for each; 1 on any failure."""
    try:
        chosen = listed(paths, root)
    except Refused as refusal:
        say(f"NOT PROVED: {refusal}")
        return 1
    proved = 0
    for outcome in in_order(partial(verify, root=root), chosen, jobs, lost):
        say(outcome.line())
        proved += outcome.theorem is not None
    say(f"{proved} of {len(chosen)} certificates proved")
    return 0 if chosen and proved == len(chosen) else 1


def lost(path: Path) -> Outcome:
    """What is told of a certificate whose check ended with its process."""
    return Outcome(path=path, theorem=None, reason="the process that checked it was killed, or crashed")


def say(words: str) -> None:
    """Print one line."""
    try:
        print(printable(words, sys.stdout.encoding or "ascii"), flush=True)
    except BrokenPipeError:
        # Whoever read the lines has gone: the rest goes nowhere, and the exit code still tells what came of it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def printable(words: str, encoding: str) -> str:
    """`words` on one line that the encoding can write: other characters are escaped, so that none forges a line."""
    escaped = (c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in words)
    return "".join(escaped).encode(encoding, "backslashreplace").decode(encoding)

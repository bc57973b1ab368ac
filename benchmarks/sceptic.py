"""How much Python a sceptic reads for the sentence of one theorem: `python benchmarks/sceptic.py [CERTIFICATE...]`.

Each certificate is checked and its line printed, under a trace. Counted are the functions of replication/verify that
were entered, each whole, with decorators, also the lines that did not run; no docstrings, comments, empty lines,
imports. The last column adds what these functions name: constants, tables of readers, fields of classes, and what
those name in turn.

Left out is what the sentence does not depend on, with all that is entered on its behalf: estimates of work and the
place of a file, which can only refuse, and the same sentence as data. So is the data of a paper, and the functions of
its plants.py: they are the subject, and are read beside the paper.

Without arguments all theorems are counted and docs/lines.md is written; with `--check` it is only compared.
"""

import ast
import io
import json
import sys
import tokenize
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from types import CodeType, FrameType

from replication.audit.judge.proofs import machine_checked
from replication.machine import STATEMENTS
from replication.verify.run import Outcome, committed, verify
from replication.verify.subjects import theorems

ROOT = Path(__file__).resolve().parents[1]
ROOM = ROOT / "replication" / "verify"
PAGE = ROOT / "docs" / "lines.md"
BEGIN, END = "<!-- lines: begin, written by `python benchmarks/sceptic.py` -->", "<!-- lines: end -->"
ASIDE = ("algebra/work.py", "predicate.py")
"""Modules on which no sentence depends."""
REFUSING = ("require_form", "wanted_at", "require_file")
"""Functions that can only refuse."""
KERNEL = ("kernel.py", "reading.py")
BAR = 250
"""Lines for one theorem that is not machine-checked."""
SILENT = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
Place = tuple[Path, int]
"""A file, and a line in it."""


@dataclass(frozen=True)
class Module:
    """lines: that are counted; pieces: what stands at the top, or in a class, by span; named, imported: by name."""

    lines: frozenset[int]
    pieces: tuple[tuple[range, ast.stmt], ...]
    named: Mapping[str, ast.stmt]
    imported: Mapping[str, tuple[Path, str]]


@lru_cache
def module(path: Path) -> Module:
    """Read one module."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    lines = {line for token in tokens if token.type not in SILENT for line in range(token.start[0], token.end[0] + 1)}
    imported = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom) or _is_text(node):
            lines -= set(_span(node))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("replication.verify"):
            file = ROOT.joinpath(*(node.module or "").split(".")).with_suffix(".py")
            imported |= {alias.asname or alias.name: (file, alias.name) for alias in node.names}
    pieces = [part for node in tree.body for part in (node.body if isinstance(node, ast.ClassDef) else [node])]
    return Module(
        lines=frozenset(lines),
        pieces=tuple((_span(part), part) for part in pieces),
        named={name: node for node in tree.body for name in _names(node)},
        imported=imported,
    )


def _is_text(node: ast.AST) -> bool:
    """A docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _span(node: ast.AST) -> range:
    first = min(part.lineno for part in (node, *getattr(node, "decorator_list", ())))
    return range(first, node.end_lineno + 1)


def _names(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return [name.id for target in targets if target for name in ast.walk(target) if isinstance(name, ast.Name)]


def entered(check: Callable[[], object]) -> set[Place]:
    """Where the functions of the verifier begin that a check enters, but for what runs on behalf of `ASIDE`."""
    found: dict[int, CodeType] = {}  # by identity, for the hash of a code reads all of it
    outside: dict[int, CodeType] = {}
    room, aside = str(ROOM), {str(ROOM / name) for name in ASIDE}

    def note(frame: FrameType | None, event: str, _: object) -> None:
        assert frame is not None
        code = frame.f_code
        if id(code) in found or id(code) in outside:
            return
        if not code.co_filename.startswith(room):
            outside[id(code)] = code
            return
        while frame is not None and not (frame.f_code.co_filename in aside or frame.f_code.co_name in REFUSING):
            frame = frame.f_back
        if frame is None:
            found[id(code)] = code

    # A trace that traces no lines is told of calls only, a profile of every return and every call of C as well.
    before = sys.gettrace()
    sys.settrace(note)
    try:
        check()
    finally:
        sys.settrace(before)
    return {(Path(code.co_filename), code.co_firstlineno) for code in found.values()}


def functions(places: Iterable[Place]) -> dict[Path, set[int]]:
    """The lines of the functions in which these places lie; of a lambda in a table, those of the table."""
    return _lines(_pieces(places))


def declared(places: Iterable[Place]) -> dict[Path, set[int]]:
    """The same with what these functions name at the top of modules, and what that names in turn."""
    seen = dict.fromkeys(_pieces(places))
    todo = list(seen)
    while todo:
        more = [one for one in _named(*todo.pop()) if one not in seen and str(one[0].relative_to(ROOM)) not in ASIDE]
        seen |= dict.fromkeys(more)
        todo += more
    return _lines(seen)


def _pieces(places: Iterable[Place]) -> list[tuple[Path, ast.stmt]]:
    return [(path, piece) for path, line in places for span, piece in module(path).pieces if line in span]


def _lines(pieces: Iterable[tuple[Path, ast.stmt]]) -> dict[Path, set[int]]:
    found: dict[Path, set[int]] = {}
    for path, piece in pieces:
        found.setdefault(path, set()).update(module(path).lines & set(_span(piece)))
    return found


@cache
def _named(path: Path, piece: ast.stmt) -> tuple[tuple[Path, ast.stmt], ...]:
    """Assignments and fields of classes that a piece names; the functions that run are known already."""
    found: list[tuple[Path, ast.stmt]] = []
    for name in {part.id for part in _inner(piece) if isinstance(part, ast.Name)}:
        where, real = (path, name) if name in module(path).named else module(path).imported.get(name, (path, name))
        one = module(where).named.get(real) if where.is_file() else None
        parts = one.body if isinstance(one, ast.ClassDef) else [one]
        found += [(where, part) for part in parts if isinstance(part, ast.AnnAssign | ast.Assign)]
    return tuple(found)


def _inner(node: ast.AST) -> Iterator[ast.AST]:
    """All that stands in a node but annotations, which do not run."""
    for field, value in ast.iter_fields(node):
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, ast.AST) and field not in ("annotation", "returns"):
                yield part
                yield from _inner(part)


@dataclass(frozen=True)
class Row:
    """What one theorem takes, by parts. in_coq: machine-checked. whole: with what its functions name."""

    name: str
    statement: str
    in_coq: bool
    parts: Mapping[str, int]
    whole: int

    @property
    def lines(self) -> int:
        """In all."""
        return sum(self.parts.values())


PARTS = ("frame", "kernel", "algebra", "reduction")


def part_of(path: Path) -> str:
    """The part of the verifier to which a module belongs."""
    folder, *inner = path.relative_to(ROOM).parts
    return ("algebra" if folder == "algebra" else "reduction") if inner else "kernel" if folder in KERNEL else "frame"


def by_coq(paper: str) -> list[str]:
    """The theorems of a paper that Coq states."""
    return [name for name, entry in theorems(paper, ROOT)[0].items() if entry.statement in STATEMENTS]


def row(path: Path) -> Row:
    """Count one theorem, which must be proved."""
    outcome: list[Outcome] = []

    def check() -> None:
        outcome.append(verify(path))
        outcome[0].line()

    places = entered(check)
    if outcome[0].theorem is None:
        raise SystemExit(outcome[0].line())
    parts: Counter[str] = Counter()
    for file, lines in functions(places).items():
        parts[part_of(file)] += len(lines)
    certificate = json.loads(path.read_bytes())
    return Row(
        name=f"{path.parent.name}/{path.stem}",
        statement=certificate["statement"],
        in_coq=path.stem in machine_checked(ROOT / "papers" / path.parent.name, by_coq(path.parent.name))[1],
        parts={part: parts[part] for part in PARTS},
        whole=sum(map(len, declared(places).values())),
    )


def files(*names: str) -> int:
    """All lines of some modules, or of all in some folders of the verifier."""
    found = [file for name in names for file in sorted(ROOM.glob(name)) if str(file.relative_to(ROOM)) not in ASIDE]
    return sum(len(module(file).lines) for file in found)


def table(rows: Sequence[Row]) -> str:
    """The page between its marks."""
    others = sorted(one.lines for one in rows if not one.in_coq)
    within = sum(lines <= BAR for lines in others)
    beside = sum(one.lines - one.parts["kernel"] <= BAR for one in rows if not one.in_coq)
    frame = [file.name for file in ROOM.glob("*.py") if file.name not in KERNEL]
    head = f"""{BEGIN}

Of the {len(rows)} theorems {len(rows) - len(others)} are machine-checked. Of the other {len(others)},
{within} need at most {BAR} lines; the least is {others[0]}, the median {others[len(others) // 2]},
the most {others[-1]}. Beside kernel and reading, which one reads once, {beside} do.
No theorem needs all of a file: the kernel has {files("kernel.py")} lines, the reading {files("reading.py")},
the algebra {files("algebra/*.py")}, the frame {files(*frame)}.

| statement | frame | kernel and reading | algebra | reduction | in all | with tables |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
"""
    return head + "".join(map(_line, _longest(rows))) + f"\n{END}"


def _longest(rows: Sequence[Row]) -> list[Row]:
    """Of each statement the theorem that takes most lines, in the order of their lines."""
    found: dict[str, Row] = {}
    for one in sorted(rows, key=lambda one: one.lines, reverse=True):
        found.setdefault(one.statement, one)
    return sorted(found.values(), key=lambda one: (one.lines, one.statement))


def _line(one: Row) -> str:
    name = f"`{one.statement}`" + (" (in Coq)" if one.in_coq else "")
    return "| " + " | ".join([name, *map(str, one.parts.values()), str(one.lines), str(one.whole)]) + " |\n"


def written(page: str, rows: Sequence[Row]) -> str:
    """The page with the table of these rows."""
    before, rest = page.split(BEGIN)
    return before + table(rows) + rest.split(END)[1]


def main(arguments: Sequence[str]) -> int:
    """Print the counts of some certificates, or write or check those of all."""
    named = [Path(argument).resolve() for argument in arguments if argument != "--check"]
    if named:
        for one in map(row, named):
            parts = ", ".join(f"{part} {lines}" for part, lines in one.parts.items())
            print(f"{one.lines} lines for {one.name} ({parts}); {one.whole} with the tables that they name")
        return 0
    page = PAGE.read_text(encoding="utf-8")
    new = written(page, [row(path) for path in committed()])
    if "--check" in arguments:
        print("docs/lines.md is " + ("up to date" if new == page else "stale: run python benchmarks/sceptic.py"))
        return int(new != page)
    PAGE.write_text(new, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))

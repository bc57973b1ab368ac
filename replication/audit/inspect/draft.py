"""A draft of printed.toml and coverage.toml from a text or its LaTeX source, for a person to read and accept.

What states a fact is proposed as printed data, whole numbers of the prose are left open, what only numbers is excused.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from pathlib import Path

from replication import scaffold
from replication.audit.inspect.coverage import NUMERAL
from replication.audit.judge.printed import is_print
from replication.errors import InvalidInputError
from replication.files import read_text, write_atomically
from replication.scaffold import plain_templates

FILES = ("printed.draft.toml", "coverage.draft.toml")
_NUMBER = r"(?:[0-9]+(?:,[0-9]{3})*(?:\.[0-9]+)?|(?<![0-9A-Za-z])\.[0-9]+)"
_SIGNED = rf"(?:(?<![\w)\]}}])[-−+])?{_NUMBER}"
_POWER = r"(?:[eE][+-]?[0-9]{1,2}|\s*(?:×|\\times|\\cdot)\s*10\s*\^\s*\{?\s*[-−+]?[0-9]{1,2}(?:\s*\})?)"
_TAIL = (
    rf"(?:\([0-9]{{1,3}}\)|\s*(?:±|\\pm|\+/-)\s*{_NUMBER}"
    rf"|\s*\^\s*\{{\s*\+{_NUMBER}\s*\}}\s*_\s*\{{\s*[-−]{_NUMBER}\s*\}}"
    rf"|\s*_\s*\{{\s*[-−]{_NUMBER}\s*\}}\s*\^\s*\{{\s*\+{_NUMBER}\s*\}}"
    rf"|\s*[\[(]\s*(?:[0-9.]+\s*\\?%\s*CI[:,]?\s*)?[-−]?{_NUMBER}\s*(?:,|;|–|to)\s*[-−]?{_NUMBER}\s*[\])])"
)
_PRINTS = tuple(
    re.compile(rf"(?<![0-9.]){form}(?![0-9]|\.[0-9])")
    for form in (
        rf"\({_SIGNED}{_TAIL}\){_POWER}",
        rf"(?:[<>≤≥]\s*)?{_SIGNED}{_POWER}?{_TAIL}?{_POWER}?(?:\s*\\?%)?(?:\*{{1,3}})?",
        _SIGNED,
    )
)
"""A number with all that may belong to it; the number alone, where the whole cannot be read."""
_FACT = re.compile(r"[.,%±<>≤≥]|\\pm|[eE][-+]|\^")
_NAMES = (
    "Sec(?:tion)?|§|Table|Tab|Fig(?:ure)?|Eq(?:uation)?|Theorem|Lemma|Corollary|Algorithm|Example|Appendix|Step|Case"
)
_BEFORE = (
    ("citation", re.compile(r"\\cite\w*\s*(?:\[[^\]]*\])?\{[^}]*$")),
    ("label", re.compile(rf"(?:{_NAMES})s?\.?[~\s]*[(\\ref{{]*$", re.IGNORECASE)),
    ("symbol", re.compile(r"(?:[_^]\s*\{?\s*[-+−]?|[_^]\{[^{}]*)$")),
    ("name", re.compile(r"[A-Za-z]$")),
    ("furniture", re.compile(r"\\(?:[vh]space|label|includegraphics|rule|setlength|setcounter|cline|cmidrule|multi\w+|"
                             r"hskip|vskip|usepackage|documentclass|url|href)\b\*?[^&]{0,60}$")),
)  # fmt: skip
"""Why a number states no fact, by what stands before it."""
_CITED = re.compile(r"(?<![0-9.])\[[0-9]+(?:\s*[,–-]\s*[0-9]+)*\]|\((?:19|20)[0-9]{2}[a-z]?\)")
"""[12], [3, 5-7] and (1998); a pair of whole numbers in brackets may be an interval, which a reader will see."""
_HEADING = re.compile(r"\s*(?:([0-9]+(?:\.[0-9]+)*)\.?|([IVX]+)\.)\s+[A-Z][^.]{2,70}$")
_CAPTION = re.compile(r"\s*(Table|TABLE|Fig(?:ure)?\.?|FIG(?:URE)?\.?)\s+([0-9]+)\b(?!,|\s+[a-z])")
"""With its number and its title; what goes on in small letters is a sentence on the table."""
_BIBLIOGRAPHY = re.compile(
    r"\s*(?:references|bibliography|literature cited)\s*$|\\begin\{thebibliography\}|\\bibitem", re.I
)


@dataclass
class _Unit:
    """A section, table or figure: its place, and what is listed of it."""

    place: str
    first: int
    last: int = 0
    rows: list[tuple[str, str]] = field(default_factory=list)
    items: list[str] = field(default_factory=list)


@dataclass
class _Draft:
    """What has been read so far. values: the printed data by name, with their place."""

    tex: bool
    units: list[_Unit] = field(default_factory=list)
    values: dict[str, tuple[str, str]] = field(default_factory=dict)
    counted: Counter[str] = field(default_factory=Counter)
    section: str = "Title"
    excused: str = ""
    header: Sequence[str] = ()
    row: int = 0

    def enter(self, place: str, line: int, item: str = "") -> None:
        self.units.append(_Unit(place, line, items=[item] if item else []))

    def value(self, name: str, place: str, text: str) -> str:
        """The name under which a print is proposed; another one where it is taken."""
        self.counted[name] += 1
        name = name if self.counted[name] == 1 else f"{name}-{self.counted[name]}"
        self.values[name] = (place, text)
        return name


def draft(text: str, *, tex: bool) -> tuple[str, str]:
    """The texts of printed.toml and coverage.toml that are proposed for a text; tex: whether it is LaTeX."""
    state = _Draft(tex, excused="furniture" if tex and r"\begin{document}" in text else "")
    state.enter("Title", 1)
    for number, line in enumerate(text.split("\n"), 1):
        (_tex if tex else _plain)(state, line, number)
        unit = state.units[-1]
        unit.rows.extend(_rows(state, unit, line, number))
        unit.last = number
        if tex and r"\begin{document}" in line:
            state.excused = ""
        if tex and re.search(r"\\end\{(?:table|figure|equation|align)\*?\}", line):
            state.header = ()
            state.enter(state.section, number + 1)
    return _texts(state, len(NUMERAL.findall(text)))


def _plain(state: _Draft, line: str, number: int) -> None:
    """Enter the section or table that begins at this line of a text."""
    if _BIBLIOGRAPHY.match(line):
        state.excused = "bibliography"
        state.enter("References", number)
    elif (caption := _CAPTION.match(line)) is not None:
        kind = "table" if caption[1][0:1].upper() == "T" else "figure"
        item = f"{kind} {caption[2]}"
        state.counted[item] += 1
        state.enter(item.capitalize(), number, item if state.counted[item] == 1 else "")
    elif (heading := _HEADING.match(line)) is not None:
        state.section = f"Sec. {heading[1] or heading[2]}"
        state.enter(state.section, number)
    elif not line.strip() and state.units[-1].place.startswith(("Table", "Figure")):
        state.enter(state.section, number)


def _tex(state: _Draft, line: str, number: int) -> None:
    """The same of LaTeX, which numbers by itself."""
    if _BIBLIOGRAPHY.search(line):
        state.excused = "bibliography"
        state.enter("References", number)
    elif (section := re.search(r"\\(sub)*section\s*\{", line)) is not None:
        depth = section[0].count("sub")
        state.counted[f"depth {depth}"] += 1
        for deeper in range(depth + 1, 4):
            state.counted[f"depth {deeper}"] = 0
        state.section = "Sec. " + ".".join(str(state.counted[f"depth {k}"]) for k in range(depth + 1))
        state.enter(state.section, number)
    elif (block := re.search(r"\\begin\{(table|figure|equation|align)\*?\}", line)) is not None:
        kind = {"align": "equation"}.get(block[1], block[1])
        state.counted[kind] += 1
        place = f"Eq. ({state.counted[kind]})" if kind == "equation" else f"{kind.capitalize()} {state.counted[kind]}"
        state.header, state.row = (), 0
        state.enter(place, number, f"{kind} {state.counted[kind]}")


def _rows(state: _Draft, unit: _Unit, line: str, number: int) -> Iterator[tuple[str, str]]:
    """What is listed of a line: each print, and what it is bound to."""
    comment = re.search(r"(?<!\\)%", line) if state.tex else None
    ends = comment.start() if comment else len(line)
    cells = _cells(state, unit, line)
    position = 0
    for numeral in NUMERAL.finditer(line):
        if numeral.start() < position:
            continue
        span = _print(line, numeral)
        reason = "furniture" if numeral.start() >= ends else state.excused or _reason(state, line, numeral)
        name = next((name for start, end, name in cells if start <= numeral.start() < end), "")
        if reason:
            yield numeral[0], f"excused:{reason}"
            continue
        text = line[slice(*span)]
        if name or _FACT.search(text):
            position = span[1]
            where = f"{unit.place}, {name.replace('.', ', ')}" if name else f"{unit.place}, line {number}"
            key = re.sub(r"[^a-z0-9]+", "-", unit.place.lower()).strip("-")
            yield text, f"data:{state.value(f'{key}.{name}' if name else f'{key}-line-{number}', where, text)}"
        else:
            yield numeral[0], f"open: line {number}"


def _print(line: str, numeral: re.Match[str]) -> tuple[int, int]:
    """Where the print lies to which a numeral belongs: the longest that can be read and begins with it."""
    for form in _PRINTS:
        for start in range(max(0, numeral.start() - 3), numeral.start() + 1):
            span = form.match(line, start)
            if span is not None and NUMERAL.search(line, start, span.end()) and _readable(line, numeral, span):
                return span.span()
    return numeral.span()


def _readable(line: str, numeral: re.Match[str], span: re.Match[str]) -> bool:
    """Whether a print begins with the numeral, cuts none in two, and is one that the judge reads."""
    inside = [run.span() for run in NUMERAL.finditer(line) if run.end() > span.start() and run.start() < span.end()]
    whole = inside[0] == numeral.span() and inside[-1][1] <= span.end()
    same = NUMERAL.findall(span[0]) == [line[slice(*part)] for part in inside]
    return whole and same and is_print(span[0])


def _reason(state: _Draft, line: str, numeral: re.Match[str]) -> str:
    """Why a number states no fact; empty if it may state one."""
    before = line[: numeral.start()]
    if not state.tex and (_HEADING.match(line) or _CAPTION.match(line)) and not NUMERAL.search(before):
        return "label"
    if any(cited.start() < numeral.start() < cited.end() for cited in _CITED.finditer(line)):
        return "citation"
    return next((reason for reason, form in _BEFORE if form.search(before)), "")


def _cells(state: _Draft, unit: _Unit, line: str) -> list[tuple[int, int, str]]:
    """The cells of a line of a LaTeX table, each with `row.column` by its first cell and the first line."""
    if not (state.tex and unit.place.startswith("Table") and "&" in line):
        return []
    bounds = [-1, *(mark.start() for mark in re.finditer(r"(?<!\\)&", line)), len(line)]
    spans = [(start + 1, end) for start, end in pairwise(bounds)]
    texts = [_slug(line[slice(*span)]) for span in spans]
    if not state.header:
        state.header = texts
        return []
    state.row += 1
    columns = [*state.header, *(f"column-{k}" for k in range(len(state.header), len(spans)))]
    row = texts[0] if re.search("[a-z]", texts[0]) else f"row-{state.row}"
    return [
        (*span, f"{row}.{columns[k] or f'column-{k}'}") for k, span in enumerate(spans) if k or row.startswith("row-")
    ]


def _slug(text: str) -> str:
    words = re.sub(r"\\[a-z]+", " ", re.sub(r"\\\\.*$", "", text))
    return "-".join(re.findall("[a-z0-9]+", words.lower()))


def _texts(state: _Draft, runs: int) -> tuple[str, str]:
    groups: dict[str, dict[str, tuple[str, str]]] = {}
    for name, value in state.values.items():
        group, _, rest = name.partition(".")
        groups.setdefault(group, {})[rest] = value
    numbers: dict[str, list[str]] = {}
    for kind, number in (item.split()[:2] for unit in state.units for item in unit.items):
        numbers.setdefault(kind, []).append(number)
    templates = plain_templates(Path(scaffold.__file__).parent)
    templates.filters["quoted"] = partial(json.dumps, ensure_ascii=False)
    fields = {"groups": groups, "numbers": numbers, "units": state.units, "runs": runs}
    printed, coverage = (templates.get_template(f"{name}.j2").render(fields) + "\n" for name in FILES)
    return printed, coverage


def write_draft(path: Path, folder: Path) -> list[Path]:
    """Write the drafts for a text into the folder of a paper; raises InvalidInputError where one lies already."""
    text = read_text(path)
    if not NUMERAL.search(text):
        raise InvalidInputError(f"{path} holds no number, and so nothing to list; is it the text of the paper?")
    paths = [folder / name for name in FILES]
    for target in paths:
        if target.exists():
            raise InvalidInputError(f"{target} exists; move what you take from it into place, and remove it first")
    texts = draft(text, tex=path.suffix == ".tex" or r"\begin{document}" in text)
    for target, content in zip(paths, texts, strict=True):
        write_atomically(target, content.encode())
    return paths

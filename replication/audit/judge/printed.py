"""Printed values: the string that stands in a paper, its exact numbers, and the unit of each last printed place.

The digits are the tolerance: a printed number stands for the closed interval of half a unit in its last place on
either side. All arithmetic is exact (`Fraction`). The forms are those of docs/adding-a-paper.md: LaTeX, a name before
a number and marks behind it are taken away, and what stands for an uncertainty is read.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from typing import Any, TypeVar

from replication.audit.data import words
from replication.audit.model import Numbers
from replication.audit.parts import Sensitivity
from replication.errors import AuditError, ReplicationError

UNSIGNED = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,2})?"
"""Two digits of exponent keep a typing slip such as 1e99999999 from filling the memory."""
REAL = rf"[+-]?{UNSIGNED}"

_PLAINER = tuple(
    (re.compile(pattern), plain)
    for pattern, plain in (
        (r"−", "-"),
        (r"\\(?:math\w\w|text(?:bf|it|rm)?|boldsymbol|bm)\s*\{([^{}]*)\}", r"\1"),
        (r"\\pm(?![A-Za-z])", "±"),
        (r"\\(?:times|cdot)(?![A-Za-z])\s*", "×"),
        (r"\\leq?(?:slant)?(?![A-Za-z])|<=", "≤"),
        (r"\\geq?(?:slant)?(?![A-Za-z])|>=", "≥"),
        (r"\\(?:sim|approx)(?![A-Za-z])", "~"),
        (r"\\(?:left|right)(?![A-Za-z])|^\\\(|\\\)$|\\!", ""),
        (r"\\([%&#$])", r"\1"),
        (r"\\[,;: ]|(?<=[0-9}])~(?=[0-9±(\[])", " "),
        (r"\{([-+,])\}", r"\1"),
        # A name before a relation: p = 0.75, R² = 0.9, t(24) < 2.1.
        (r"^\s*[^\W\d][\w^{}\\]*\s*(?:\([^()]*\))?\s*(?:=\s*|(?=[<>≤≥]))", ""),
        # Marks behind a number: stars of significance, signs and letters of notes.
        (r"(?<=[0-9)\]}%])\s*(?:\^\s*\{?\s*(?:\*+|\\(?:ast|dagger)\b|[†‡a-d])\s*\}?|\*{1,4}|[†‡§¶]+)\s*$", ""),
        (r"(?:\s*(?:%|per ?cent)|(?<=[0-9])\*{1,4}(?=\s))(?=\s*(?:±|\+/-|\[|\())", ""),
    )
)
_LAST = re.compile(r"([+-]?[0-9]+(?:\.[0-9]*)?|[+-]?\.[0-9]+)\(([0-9]{1,3})\)((?:[eE][+-]?[0-9]{1,2})?)")
_SPREAD = re.compile(rf"({REAL})\s*(?:±|\+/-)\s*({UNSIGNED})")
_ERROR = re.compile(rf"({REAL})\s+\(([0-9]*\.[0-9]+)\)")
_TIMES = re.compile(r"\(([^()]*)\)([eE][+-]?[0-9]{1,2})")
_APART = tuple(
    re.compile(rf"({REAL})\s*{apart}")
    for apart in (
        rf"\^\s*\{{?\s*\+\s*(?P<above>{UNSIGNED})\s*\}}?\s*_\s*\{{?\s*-\s*(?P<below>{UNSIGNED})\s*\}}?",
        rf"_\s*\{{?\s*-\s*(?P<below>{UNSIGNED})\s*\}}?\s*\^\s*\{{?\s*\+\s*(?P<above>{UNSIGNED})\s*\}}?",
        rf"\(?\s*\+\s*(?P<above>{UNSIGNED})\s*[/,;]?\s*-\s*(?P<below>{UNSIGNED})\s*\)?",
    )
)
_LEVEL = r"(?:([0-9.]+)\s*%\s*)?(?:(?:CI|CrI|HDI|confidence interval)\b)?\s*[:,]?\s*"
_LIMITS = re.compile(rf"({REAL})\s*[\[(]\s*{_LEVEL}({REAL})\s*(?:,|;|–|—|-|\bto\b)\s*({REAL})\s*[\])]")

_INNER_COMMA = re.compile(r"(?<=[0-9]),(?=[0-9])")
_INNER_THOUSANDS = re.compile(r"(?<![0-9,])[1-9][0-9]{0,2}(?:,[0-9]{3})+(?![0-9,])")

ADVICE = words("advice")
"""By what stands in a text that is no number, what may be meant, and what to write for it."""


def simplified(text: str) -> str:
    """The text without LaTeX, names and marks, with hyphens for minus signs."""
    plain = text.replace("$", "") if text.count("$") % 2 == 0 else text
    for pattern, instead in _PLAINER:
        plain = pattern.sub(instead, plain)
    return plain.strip()


def with_spread(body: str) -> tuple[str, Decimal, Decimal, tuple[str, ...]] | None:
    """The number of a simplified print, and how far its uncertainty reaches down and up; None where there is none.

    Last the numbers that are printed for the uncertainty: one, two sides, or two limits.
    """
    scaled = _TIMES.fullmatch(body)
    if scaled is not None and (inner := with_spread(scaled[1])) is not None:
        times = Decimal(f"1{scaled[2]}")
        texts = tuple(f"{number}{scaled[2]}" for number in (inner[0], *inner[3]))
        return texts[0], inner[1] * times, inner[2] * times, texts[1:]
    if (last := _LAST.fullmatch(body)) is not None:
        number = last[1] + last[3]
        both = int(last[2]) * Decimal(1).scaleb(int(Decimal(number).as_tuple().exponent))
        return number, both, both, (str(both),)
    if (beside := _SPREAD.fullmatch(body) or _ERROR.fullmatch(body)) is not None:
        return beside[1], Decimal(beside[2]), Decimal(beside[2]), (beside[2],)
    for form in _APART:
        if (apart := form.fullmatch(body)) is not None:
            sides = apart["below"], apart["above"]
            return apart[1], Decimal(sides[0]), Decimal(sides[1]), sides
    if (limits := _LIMITS.fullmatch(body)) is not None:
        below, above = Decimal(limits[1]) - Decimal(limits[3]), Decimal(limits[4]) - Decimal(limits[1])
        return limits[1], below, above, (limits[3], limits[4])
    plain = _INNER_THOUSANDS.sub(lambda match: match[0].replace(",", ""), body)
    if plain == body and "." not in body:
        plain = _INNER_COMMA.sub(".", body)
    return None if plain == body or _INNER_COMMA.search(plain) else with_spread(plain)


def level_of(text: str) -> str:
    """The level of the limits that a print names itself, such as `95 %`; empty if it names none."""
    limits = _LIMITS.fullmatch(simplified(text))
    return f"{limits[2]} %" if limits is not None and limits[2] else ""


T = TypeVar("T")

_REAL = re.compile(REAL)
_COMPLEX = re.compile(rf"([+-]?{UNSIGNED})\s*([+±-])\s*({UNSIGNED})\s*[ij]")
_GROUPED = r"[1-9][0-9]{0,2}(?:,[0-9]{3})+"
_THOUSANDS = re.compile(rf"([+-]?)({_GROUPED})(\.[0-9]*)?")
_SPACED = re.compile(r"([+-]?)([1-9][0-9]{0,2}(?:[ \u00a0\u2009\u202f'’][0-9]{3})+)(\.[0-9]*)?")
_POWER = re.compile(
    r"(?<=[0-9.)])\s*[×·x*]\s*10\s*(?:\^\s*\{?\s*([+-]?[0-9]{1,2})\s*\}?|([⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]{1,2}))(?![0-9⁰-⁹])"
)
_RAISED = str.maketrans("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+-0123456789")
_COMMA = re.compile(r"([+-]?[0-9]+),([0-9]+(?:e[+-]?[0-9]{1,2})?)")
_PER_CENT = re.compile(r"(?<=[0-9.)])\s*(?:%|per ?cent)$")
_RANGE = re.compile(rf"({_REAL.pattern})\s*(?:–|—|…|\.\.\.|\bto\b)\s*({_REAL.pattern})")
_AMBIGUOUS = re.compile(rf"(?<![0-9.,]){_GROUPED}(?![0-9])")


@dataclass(frozen=True)
class Entry:
    """One printed real number: its text, exact value and unit of the last place.

    absolute: it is the imaginary part of a conjugate pair, so only its size is compared.
    spread: the uncertainty that is printed with it, below and above. beside: the numbers that are printed for it.
    """

    text: str
    value: Fraction
    unit: Fraction
    absolute: bool = False
    spread: tuple[Fraction, Fraction] | None = None
    beside: tuple[str, ...] = ()


@dataclass(frozen=True)
class Printed:
    """A parsed printed value.

    cells: the printed cells row by row; one entry for a real cell, two (real, imaginary) for a complex one.
    shape: () for a single number, (n,) for a list, (rows, columns) for a matrix. relation: "", "<", "≤", ">" or "≥".
    plain: the same print in the simplest of its forms, in which each entry stands as in its text.
    """

    text: str
    relation: str
    cells: tuple[tuple[Entry, ...], ...]
    shape: tuple[int, ...]
    plain: str

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All real numbers of the print, row by row, the real part of a complex cell before its imaginary part."""
        return tuple(entry for cell in self.cells for entry in cell)

    @property
    def labels(self) -> tuple[str, ...]:
        """How to call each entry: "" for a single number, else `entry 2` or `entry (2,1)`, and the part if complex."""
        names = []
        for index, cell in enumerate(self.cells):
            row, column = divmod(index, self.shape[-1] if self.shape else 1)
            place = ("", f"entry {column + 1}", f"entry ({row + 1},{column + 1})")[len(self.shape)]
            parts = ("real part", "imaginary part") if len(cell) == 2 else ("",)
            names += [" of ".join(filter(None, (part, place))) for part in parts]
        return tuple(names)

    def arranged(self, cells: Sequence[T]) -> T | list[T] | list[list[T]]:
        """What belongs to each cell, in the layout of the print: alone, in a list, or in rows."""
        if len(self.shape) < 2:
            return list(cells) if self.shape else cells[0]
        width = self.shape[1]
        return [list(cells[begin : begin + width]) for begin in range(0, len(cells), width)]

    def align(self, name: str, numbers: Numbers) -> tuple[float, ...]:
        """Return `numbers` flattened in the order of `entries`; raises AuditError if it has another layout.

        name: what the numbers are ("computed value", "lower bound"), for the message.
        """
        cells = [cell if len(cell) == 2 else None for cell in self.cells]
        if not _is_laid_out(numbers, self.arranged(cells)):
            raise AuditError(
                f"the {name} {numbers!r} does not have the layout of the printed {self.text!r}: {self._wanted()}"
            )
        return tuple(flat(numbers))

    def _wanted(self) -> str:
        complex_cells = sum(len(cell) == 2 for cell in self.cells)
        rule = f", {complex_cells} of them complex as (real, imaginary)" if complex_cells else ""
        if len(self.shape) == 0:
            return "give a pair (real, imaginary)" if complex_cells else "give one number"
        if len(self.shape) == 1:
            return f"give {self.shape[0]} entries{rule}"
        return f"give {self.shape[0]} rows of {self.shape[1]} numbers"


def _is_laid_out(numbers: object, layout: object) -> bool:
    """Whether numbers stand where the layout has cells, in pairs where these have two entries."""
    if isinstance(layout, list | tuple):
        return isinstance(numbers, tuple) and len(numbers) == len(layout) and all(map(_is_laid_out, numbers, layout))
    return isinstance(numbers, int | float) and not isinstance(numbers, bool)


def flat(numbers: Numbers) -> Iterator[float]:
    """The numbers of a quantity, one after the other."""
    if isinstance(numbers, tuple):
        for entry in numbers:
            yield from flat(entry)
    else:
        yield numbers


def parse(text: str) -> Printed:
    """Parse a printed value; raises AuditError with the offending text if it is not one of the forms above."""
    plain = _REAL.fullmatch(text) is not None
    body = text if plain else _POWER.sub(_exponent, simplified(text))
    if not body:
        raise AuditError("the printed value is empty; give the string that stands in the paper")
    relation = ""
    if match := re.match(r"[<>≤≥]", body):
        relation, body = match[0], body[1:].strip()
    body = _PER_CENT.sub("", body)
    if (ends := _RANGE.fullmatch(body)) is not None:
        body = f"({ends[1]}, {ends[2]})"
    entry = None if plain else _with_spread(text, body)
    cells: tuple[tuple[Entry, ...], ...]
    shape: tuple[int, ...] = ()
    if entry is not None:
        cells, body = ((entry,),), entry.text
    elif body.startswith(("(", "[")):
        closing = ")" if body[0] == "(" else "]"
        if not body.endswith(closing):
            raise AuditError(f"printed value {text!r} opens with {body[0]!r} and does not end with {closing!r}")
        if ambiguous := _AMBIGUOUS.search(body):
            raise AuditError(
                f"printed value {text!r}: {ambiguous.group()!r} may be one number or several; "
                "put a blank after each comma between entries and write thousands without commas inside a list"
            )
        cells, shape = _list(text, body[1:-1]) if closing == ")" else _matrix(text, body[1:-1])
    else:
        body = _without_commas(body)
        cells = (_cell(text, body),)
    if relation and (shape != () or len(cells[0]) != 1 or entry):
        raise AuditError(f"printed value {text!r}: a relation stands before one real number only, without uncertainty")
    return Printed(text, relation, cells, shape, f"{relation}{body}")


def is_print(text: str) -> bool:
    """Whether `parse` reads it."""
    try:
        return bool(parse(text))
    except AuditError:
        return False


def number(printed: Any) -> Any:
    """What a print stands for, as input of an experiment: a float, the rows of a matrix, a list, or an interval's ends.

    Of a table or a list of prints those of its entries, under the same names. An uncertainty is left out, a number of
    per cent stays one. Raises AuditError for a bound and for a complex number, and as `parse`.
    """
    if isinstance(printed, Mapping):
        return {key: number(entry) for key, entry in printed.items()}
    if isinstance(printed, list | tuple):
        return [number(entry) for entry in printed]
    print_ = parse(str(printed))
    if print_.relation or any(len(cell) > 1 for cell in print_.cells):
        what = "a bound" if print_.relation else "a complex number"
        raise AuditError(f"printed value {printed!r} is {what} and no real number; say in Python what is computed with")
    return print_.arranged([float(entry.value) for entry in print_.entries])


def by_digits(printed: Printed, several: bool) -> Printed:
    """A number that is printed with its uncertainty without that, or as the list of both, if there are `several`."""
    entry = printed.entries[0]
    plain = f"({', '.join((entry.text, *entry.beside))})" if several and entry.beside else entry.text
    return replace(parse(plain), text=printed.text) if entry.beside else printed


def has_uncertainty(text: str) -> bool:
    """Whether an uncertainty is printed with the number."""
    return not _REAL.fullmatch(text) and with_spread(_POWER.sub(_exponent, simplified(text))) is not None


def decimal_fraction(text: str) -> Fraction:
    """The exact value of a printed real number such as `0.005`; raises AuditError if it is not one."""
    return _entry(text, text.replace("−", "-").strip()).value


def _list(text: str, body: str) -> tuple[tuple[tuple[Entry, ...], ...], tuple[int, ...]]:
    if len({part[:1].isspace() for part in body.split(",")[1:]}) > 1:
        raise AuditError(
            f"printed value {text!r}: some commas have a blank behind them and some have none; write decimal commas as "
            "points, and a blank after each comma between entries"
        )
    cells = tuple(_cell(text, part.strip()) for part in body.split(","))
    return cells, (len(cells),)


def _matrix(text: str, body: str) -> tuple[tuple[tuple[Entry, ...], ...], tuple[int, ...]]:
    rows = [re.split(r"\s*,\s*|\s+", row.strip()) for row in body.split(";")]
    widths = {len(row) for row in rows}
    if len(widths) > 1:
        raise AuditError(f"printed matrix {text!r} has rows of {sorted(widths)} entries; all rows must be equally long")
    return tuple((_entry(text, part),) for row in rows for part in row), (len(rows), len(rows[0]))


def _cell(text: str, part: str) -> tuple[Entry, ...]:
    match = _COMPLEX.fullmatch(part)
    if match is None:
        return (_entry(text, part),)
    real, sign, imaginary = match.groups()
    second = _entry(text, ("-" if sign == "-" else "") + imaginary)
    return _entry(text, real), Entry(second.text, second.value, second.unit, absolute=sign == "±")


def _entry(text: str, part: str) -> Entry:
    if not _REAL.fullmatch(part):
        meant = next((f"; it may be {advice}" for form, advice in ADVICE.items() if re.search(form, part)), "")
        raise AuditError(
            f"printed value {text!r}: {part!r} is not a number as printed, such as 1.33, .580 or 1.2e-3{meant}"
        )
    number = Decimal(part)
    exponent = number.as_tuple().exponent
    assert isinstance(exponent, int)  # NaN and infinities do not match the pattern
    return Entry(part, Fraction(number), Fraction(10) ** exponent)


def _with_spread(text: str, body: str) -> Entry | None:
    """A number with its uncertainty; None for any other print."""
    parts = with_spread(body)
    if parts is None:
        return None
    entry, *ends = _entry(text, parts[0]), Fraction(parts[1]), Fraction(parts[2])
    if _POWER.search(simplified(text)) and not re.search("[eE]", entry.text):
        raise AuditError(
            f"printed value {text!r}: the power of ten may be that of both numbers or of the last one; write it behind "
            "both in parentheses, (3.84 ± 0.05) × 10^4, or behind each"
        )
    if min(ends) <= 0:
        what = "limits that do not hold it; look again" if min(ends) < 0 else "an uncertainty of zero; leave it out"
        raise AuditError(f"printed value {text!r} states {what}")
    return Entry(entry.text, entry.value, entry.unit, spread=(ends[0], ends[1]), beside=parts[3])


def _without_commas(body: str) -> str:
    """A number without the marks between thousands, or with a point for a decimal comma."""
    match = _THOUSANDS.fullmatch(body) or _SPACED.fullmatch(body)
    if match is not None:
        return match[1] + re.sub(r"[^0-9]", "", match[2]) + (match[3] or "")
    comma = _COMMA.fullmatch(body)
    return body if comma is None else f"{comma[1]}.{comma[2]}"


def _exponent(power: re.Match[str]) -> str:
    return f"e{power[1] or power[2].translate(_RAISED)}"


Parameters = Mapping[str, Any]
"""Printed parameters as numbers: a float, or the rows of a matrix as lists."""

Quantities = Mapping[str, float]
"""Results by id of the claim that they answer."""


def spread(prints: Mapping[str, str], compute: Callable[[Parameters], Quantities]) -> dict[str, Any]:
    """What `compute` gives at the printed numbers, and with each that is not whole half a unit lower and higher.

    Returns JSON: as `rows` the fields of a `Sensitivity` for each claim and number; None where there is no result.
    """
    parsed = {name: parse(text) for name, text in prints.items()}
    base, moves = compute(_numbers(parsed)), []
    for name, printed in parsed.items():
        for index, entry in enumerate(printed.entries):
            if entry.unit < 1:
                ends = (_numbers(parsed, (name, index), side * entry.unit / 2) for side in (-1, 1))
                low, high = (_attempt(compute, numbers) for numbers in ends)
                moves.append((_label(name, printed, index), entry.text, low, high))
    rows = [
        {
            "claim": claim,
            "parameter": parameter,
            "printed": text,
            "base": value,
            "low": None if low is None else low[claim],
            "high": None if high is None else high[claim],
        }
        for claim, value in base.items()
        for parameter, text, low, high in moves
    ]
    return {"rows": rows}


def sensitivities(spread: Mapping[str, Any]) -> tuple[Sensitivity, ...]:
    """The records of what `spread` returned."""
    return tuple(Sensitivity(**row) for row in spread["rows"])


def _numbers(
    parsed: Mapping[str, Printed], moved: tuple[str, int] | None = None, by: Fraction = Fraction(0)
) -> Parameters:
    """Floats in the layout of the prints, one of them moved; moved: its parameter, and its place among the entries."""
    exact = {name: [entry.value for entry in printed.entries] for name, printed in parsed.items()}
    if moved is not None:
        exact[moved[0]][moved[1]] += by
    return {name: printed.arranged(list(map(float, exact[name]))) for name, printed in parsed.items()}


def _attempt(compute: Callable[[Parameters], Quantities], parameters: Parameters) -> dict[str, float] | None:
    try:
        return dict(compute(parameters))
    except ReplicationError:
        return None


def _label(name: str, printed: Printed, index: int) -> str:
    place = printed.labels[index].removeprefix("entry ")
    return f"{name}{place if place.startswith('(') else place and f'({place})'}"

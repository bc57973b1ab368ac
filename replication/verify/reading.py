"""Strict reading of certificates: JSON without floats, and readers of its values that name the path of a mistake.

Every number is a string that holds a plain rational, "p" or "p/q", or a small integer where it counts or points.
"""

from __future__ import annotations

import json
import re
import stat
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from replication.verify.algebra.work import limit_denominator
from replication.verify.theorem import Refused, require

if TYPE_CHECKING:  # imported where a number is read, so that lists of theorems can be read without it
    from flint import fmpq, fmpq_mat

T = TypeVar("T")
Name = TypeVar("Name", bound=str)
Reader = Callable[[Any, str], Any]
"""Gives the value of a field, from its JSON value and its path in the certificate; refuses what it must not be."""

MAX_BYTES = 2_000_000
MAX_DIGITS = 1_000
"""Of a numerator or a denominator."""
MAX_INTEGER_DIGITS = 9
MAX_ENTRIES = 40_000
"""Of one matrix or list."""
LARGEST_ORDER = 50
"""Most states of a plant or a filter whose characteristic polynomial is taken."""
NAME = re.compile(r"[A-Za-z0-9._-]{1,80}")
DIGITS = rf"[1-9][0-9]{{0,{MAX_DIGITS - 1}}}"
RATIONAL = re.compile(rf"(-?(?:0|{DIGITS}))(?:/({DIGITS}))?")


def content(path: Path) -> bytes:
    """The bytes of a regular file, no more of them than are needed to see that it is too large; raises OSError too."""
    status = path.stat()
    require(stat.S_ISREG(status.st_mode), "it is no regular file")
    require(status.st_size <= MAX_BYTES, f"the file has {status.st_size} bytes, more than {MAX_BYTES}")
    with path.open("rb") as file:
        return file.read(MAX_BYTES + 1)


def parse(content: bytes) -> Any:
    """The JSON value of a file; raises Refused for anything that another reader could understand in another way."""
    require(len(content) <= MAX_BYTES, f"the file has {len(content)} bytes, more than {MAX_BYTES}")
    try:
        return STRICT.decode(content.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise Refused(f"the file is not valid JSON: {error}") from None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    entries: dict[str, Any] = {}
    for key, value in pairs:
        require(key not in entries, f"the key {_shown(key)} stands twice in one object")
        entries[key] = value
    return entries


def _small_integer(text: str) -> int:
    require(len(text) <= MAX_INTEGER_DIGITS, f"the integer {text:.20}... is too long; write rationals as strings")
    return int(text)


def no_number(text: str) -> NoReturn:
    """Refuse a number of JSON or TOML that is none of the integers."""
    raise Refused(f'the number {text:.40} is not exact; write it as a string, such as "1/3"')


STRICT = json.JSONDecoder(
    object_pairs_hook=_unique, parse_int=_small_integer, parse_float=no_number, parse_constant=no_number
)


def fields(value: Any, path: str, *names: str) -> tuple[Any, ...]:
    """The values of exactly these fields of an object, in this order; none may be missing, none be left over."""
    values = known_fields(value, path, *names)
    unknown = sorted(value.keys() - {*names})
    require(not unknown, f"{path} has the unknown field {', '.join(map(_plain, unknown[:3]))}")
    return values


def known_fields(value: Any, path: str, *names: str) -> tuple[Any, ...]:
    """The values of these fields of an object, which may have others."""
    require(isinstance(value, dict), f"{path} must be an object, got {_shown(value)}")
    missing = [name for name in names if name not in value]
    require(not missing, f"{path} lacks the field {', '.join(missing)}")
    return tuple(value[name] for name in names)


def record(value: Any, path: str, readers: Mapping[str, Reader]) -> dict[str, Any]:
    """The values of exactly the fields of a table, each read by its reader."""
    entries = zip(readers.items(), fields(value, path, *readers), strict=True)
    return {name: reader(part, f"{path}.{name}") for (name, reader), part in entries}


def sized(reader: Callable[..., T], *sizes: Any) -> Callable[[Any, str], T]:
    """A reader with further arguments: shapes, a least integer, or the reader and number of the entries of a list."""
    return lambda value, path: reader(value, path, *sizes)


def as_written(value: Any, path: str) -> Any:
    """What stands there, for the statement to read."""
    return value


def text(value: Any, path: str) -> str:
    """A string."""
    require(isinstance(value, str), f"{path} must be a string, got {_shown(value)}")
    return str(value)


def name_of(value: Any, path: str) -> str:
    """A name, which can be printed and can name a file."""
    name = text(value, path)
    allowed = "1 to 80 letters, digits, points, underscores and hyphens"
    require(NAME.fullmatch(name) is not None, f"{path} must have {allowed}, got {_shown(name)}")
    return name


def one_of(value: Any, path: str, names: Collection[Name]) -> Name:
    """The one of these names, or of the members of an enumeration of strings, that stands there."""
    known = {str(name): name for name in names}
    name = text(value, path)
    require(name in known, f"{path} must be one of {', '.join(known)}, got {_shown(name)}")
    return known[name]


def integer(value: Any, path: str, least: int = 0, most: int | None = None) -> int:
    """A small integer, at least `least`, and at most `most` if that is given."""
    require(isinstance(value, int) and not isinstance(value, bool), f"{path} must be an integer, got {_shown(value)}")
    require(value >= least, f"{path} must be at least {least}, got {value}")
    require(most is None or value <= most, f"{path} must be at most {most}, got {value}")
    return int(value)


def rational(value: Any, path: str) -> fmpq:
    """A rational number from a string "p" or "p/q"."""
    match = RATIONAL.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        shape = f'a rational as a string, such as "-3" or "1/3", of at most {MAX_DIGITS} digits each'
        raise Refused(f"{path} must be {shape}, got {_shown(value)}")
    from flint import fmpq, fmpz

    return fmpq(fmpz(match[1]), fmpz(match[2] or 1))


def positive(value: Any, path: str) -> fmpq:
    """A positive rational."""
    number = rational(value, path)
    require(number > 0, f"{path} must be positive, got {value}")
    return number


def sequence(value: Any, path: str, reader: Callable[[Any, str], T], length: int | None = None) -> list[T]:
    """A list, each entry read by `reader`; of `length` entries if that is given."""
    require(isinstance(value, list), f"{path} must be a list, got {_shown(value)}")
    require(len(value) <= MAX_ENTRIES, f"{path} has {len(value)} entries, more than {MAX_ENTRIES}")
    require(length is None or len(value) == length, f"{path} must have {length} entries, got {len(value)}")
    return [reader(entry, f"{path}[{i}]") for i, entry in enumerate(value)]


def several(value: Any, path: str, reader: Callable[[Any, str], T], most: int = MAX_ENTRIES) -> list[T]:
    """A list of at least one and at most so many entries."""
    require(value != [], f"{path} is empty")
    require(not isinstance(value, list) or len(value) <= most, f"{path} has more than {most} entries")
    return sequence(value, path, reader)


def matrix(value: Any, path: str, rows: int | None = None, columns: int | None = None) -> fmpq_mat:
    """A matrix from a list of rows of rationals, of the given shape where that is given."""
    from flint import fmpq_mat

    read = sequence(value, path, lambda row, where: sequence(row, where, rational), rows)
    widths = sorted({len(row) for row in read})
    require(len(widths) == 1 and widths != [0], f"{path} must have rows of one length, at least 1, got {widths}")
    width = widths.pop()
    require(len(read) * width <= MAX_ENTRIES, f"{path} has {len(read)} x {width} entries, more than {MAX_ENTRIES}")
    require(columns is None or width == columns, f"{path} must have {columns} columns, got {width}")
    entries = [entry for row in read for entry in row]
    limit_denominator(entries, MAX_DIGITS, path)
    return fmpq_mat(len(read), width, entries)


def square(value: Any, path: str, size: int | None = None) -> fmpq_mat:
    """A square matrix."""
    read = matrix(value, path, size, size)
    require(read.nrows() == read.ncols(), f"{path} must be square, got {read.nrows()} x {read.ncols()}")
    return read


def states(value: Any, path: str) -> fmpq_mat:
    """The square matrix of a plant or a filter, of few enough states for exact determinants."""
    read = square(value, path)
    require(read.nrows() <= LARGEST_ORDER, f"{path} has {read.nrows()} states, more than {LARGEST_ORDER}")
    return read


def symmetric(value: Any, path: str, size: int | None = None) -> fmpq_mat:
    """A symmetric matrix, all of its entries written out."""
    read = square(value, path, size)
    require(read == read.transpose(), f"{path} must be symmetric")
    return read


def matrices(value: Any, path: str, rows: int, columns: int, length: int | None = None) -> list[fmpq_mat]:
    """A list of matrices of one shape."""
    return sequence(value, path, lambda entry, where: matrix(entry, where, rows, columns), length)


def written(value: Any) -> Any:
    """The JSON form of rationals, matrices, and of lists and objects of them: the inverse of the readers above."""
    from flint import fmpq, fmpq_mat, fmpz

    if isinstance(value, fmpq_mat):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {name: written(entry) for name, entry in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [written(entry) for entry in value]
    return str(value) if isinstance(value, (fmpq, fmpz)) else value


def _plain(name: str) -> str:
    return name if NAME.fullmatch(name) else _shown(name)


def _shown(value: Any) -> str:
    return f"{value!r:.40}"

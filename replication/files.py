"""Files that are whole or absent: written under a temporary name beside the target, then renamed."""

import csv
import hashlib
import io
import os
import tempfile
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path

from replication.errors import AuditError, InvalidInputError

APART = ("__pycache__", "notebooks", "build", "dist")
"""Folders with what Python, the tutorials and the packaging make of the sources."""


def write_atomically(path: Path, content: bytes) -> None:
    """Replace `path` by `content`; an interruption leaves the old file, or none, but never half of one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def read_text(path: Path) -> str:
    """The text of a file that somebody gives; raises InvalidInputError if it cannot be read, or is none in UTF-8."""
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InvalidInputError(
            f"{path} is no text in UTF-8: {error.reason} at byte {error.start}; convert it"
        ) from None
    except OSError as error:
        raise InvalidInputError(f"{path} cannot be read: {error.strerror}") from None


def read_columns(path: Path) -> dict[str, tuple[float, ...]]:
    """The columns of a CSV file of numbers, without blanks; raises OSError or ValueError for any other file."""
    with path.open(encoding="utf-8", newline="") as stream:
        names, *rows = csv.reader(stream)
    columns = zip(names, zip(*rows, strict=True), strict=True)
    return {name: tuple(float(cell) for cell in column if cell) for name, column in columns}


def sha256(content: bytes | str | Path, absent: str = "") -> str:
    """The checksum of bytes, of a text, or of a file; `absent` for one that is not there."""
    if isinstance(content, Path):
        if not content.is_file():
            return absent
        content = content.read_bytes()
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


def sum_of(paths: Iterable[Path]) -> str:
    """One checksum of files, by their names and what they hold; a missing one counts as such."""
    return sha256("\n".join(f"{path.name} {sha256(path, 'missing')}" for path in paths))


def csv_text(header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table as CSV; None is an empty cell."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([header, *rows])
    return stream.getvalue()


def write_directory(directory: Path, files: Mapping[str, bytes]) -> None:
    """Put a directory with just these files in the place of `directory`; until it is whole nothing is to be seen.

    An earlier one is moved aside first and removed last. Its parent is made if need be.
    """
    parent = directory.parent
    parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=parent, prefix=f".{directory.name}.") as temporary:
        new, earlier = Path(temporary) / "made", Path(temporary) / "earlier"
        new.mkdir()
        for name, content in files.items():
            (new / name).write_bytes(content)
        if directory.exists():
            directory.rename(earlier)
        new.rename(directory)


def require_writable(directory: Path, option: str) -> None:
    """Make `directory` and see that files can be written there, before hours of computing are spent on them.

    Raises AuditError that names the directory and the `option` of the command line to choose another one.
    """
    if reason := unwritable(directory):
        raise AuditError(
            f"{directory} is no directory that can be written ({reason}); choose another one with {option}"
        )


def unwritable(directory: Path) -> str:
    """Why no file can be written in `directory`, which is made if need be; empty if one can."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            pass
    except OSError as error:
        return str(error.strerror)
    return ""


def visible(place: Path, apart: Collection[str] = APART) -> Iterator[Path]:
    """A file, or the files of a folder and of those in it, hidden ones and folders of the names `apart` left out."""
    if place.is_file():
        yield place
    for folder, inner, names in os.walk(place):
        if "pyvenv.cfg" in names:  # an environment, which the versions of its packages stand for
            inner.clear()
            continue
        inner[:] = [name for name in inner if not name.startswith(".") and name not in apart]
        paths = (Path(folder, name) for name in names if not name.startswith("."))
        yield from (path for path in paths if path.is_file())

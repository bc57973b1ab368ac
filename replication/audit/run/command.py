"""Experiments that are a command in any language: run in a folder of their own that holds what they declare, no more.

A command sees copies of the files that it declares to read, the files that the experiments made which it needs, and of
the environment PATH, HOME, a fixed language and time zone, and the variables that it declares. Whatever else it would
depend on is not there. It answers in JSON or CSV, on its output or in a file.
"""

from __future__ import annotations

import contextlib
import csv
import hashlib
import io
import json
import math
import os
import re
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from replication.audit.run.tracing import ABSENT, FIXED, loose, note, said
from replication.errors import AuditError
from replication.files import visible, write_atomically

HANDED_ON = ("PATH", "HOME")
OUTPUT = "-"
"""The answer stands on the standard output, as JSON."""
LONGEST = 300
_SHARED = re.compile(rb"/tmp/|/dev/shm/")
"""Where programs may leave something for one another. TMPDIR is a folder of the command's own."""


def execute(
    command: Sequence[str],
    reads: Sequence[str],
    writes: Sequence[str],
    answer: str,
    version: Sequence[str],
    environment: str,
    variables: Sequence[str],
    root: str,
    store: str,
    needed: Mapping[str, str],
) -> Any:
    """The answer of a command; `declare.command` says what its fields mean.

    store: the folder in which files that experiments made are kept by their checksum; needed: those that this one
    gets, by name. Raises AuditError for a command that is not there, fails, answers in no known form, changes what it
    reads, writes what it does not declare, or writes beside its folder or into the project.
    """
    project = Path(root)
    names = list(_files(project, [*reads, *([environment] if environment else [])]))
    with tempfile.TemporaryDirectory(prefix="replication-") as made:
        folder = Path(made).resolve() / "work"
        for inner in (folder, folder.with_name("tmp")):
            inner.mkdir()
        for name in names:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(project / name, folder / name)
        for name, sha256 in needed.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(Path(store) / sha256, folder / name)
            (folder / name).chmod(0o755)  # it may be a program
        for name in writes:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
        before = {**_checksums(folder), **{f"{project}/{name}": _sha256(project / name) for name in names}}
        there = _around(folder, project)
        if version and said(tuple(version)) == ABSENT:
            raise AuditError(f"`{' '.join(version)}` says no version; give the command that prints it, or none")
        note(*(f"./{name}" for name in names), *(f"env:{name}" for name in variables), _program(version, command))
        if any(_SHARED.search(text) for text in [" ".join(command).encode(), *map(_bytes, folder.rglob("*"))]):
            loose("files in a folder that all programs share")
        output = _run(command, folder, variables)
        _require_kept(before, folder, project, names)
        now = _around(folder, project)
        if outside := sorted(now.keys() - there.keys()):
            raise AuditError(f"it writes outside of its folder: {', '.join(outside[:4])}; let it write where it starts")
        for path in sorted(path for path in there if there[path] != now.get(path)):
            loose(f"{path.removeprefix(f'{project}/')} changed while it ran")
        _require_declared(_checksums(folder).keys() - before.keys(), writes)
        note(files={name: _keep(folder / name, Path(store), command) for name in writes})
        if answer == OUTPUT:
            told = not writes or output.lstrip()[:1] in (b"{", b"[")  # else it only says what it does
            return _json(output, f"`{' '.join(command)}`: its output") if told else {"files": list(writes)}
        text = (folder / answer).read_text(encoding="utf-8-sig")
        return _csv(text, answer) if answer.endswith(".csv") else _json(text, f"`{' '.join(command)}`: {answer}")


def held(file: str, sha256: str, root: str, store: str, needed: Mapping[str, str]) -> Any:
    """What a JSON file holds, or a CSV file by columns, that a command made or that lies in the project.

    sha256: what its checksum must be, or empty. store, needed: as for `execute`. Raises AuditError for a file that is
    not there, is another one, or is none of these.
    """
    path = Path(store) / needed[file] if file in needed else Path(root) / file
    if not path.is_file() or not path.resolve().is_relative_to(Path(store if file in needed else root).resolve()):
        raise AuditError(
            f"{file!r} is not in {root}, and no [[command]] of claims.toml writes it; make it, or name it in `writes`"
        )
    if sha256 and _sha256(path) != sha256:
        raise AuditError(f"{file} has the SHA-256 {_sha256(path)}, not {sha256}; it is another file than was declared")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise AuditError(f"{file} is no text in UTF-8; write it as CSV or JSON in UTF-8") from None
    return _json(text, file) if file.endswith(".json") else _csv(text, file)


def _files(project: Path, reads: Sequence[str]) -> Iterator[str]:
    """The files below the project that are declared, those of a folder one by one, without hidden ones."""
    for name in reads:
        path = project / name
        if path.is_dir():
            note(f"./{name.rstrip('/')}/")
            for below in sorted(path.rglob("*")):
                inside = below.relative_to(project)
                if below.is_dir():
                    note(f"./{inside.as_posix()}/")
                elif not any(part.startswith(".") for part in inside.relative_to(name).parts):
                    yield inside.as_posix()
        elif path.is_file():
            yield PurePosixPath(name).as_posix()
        else:
            raise AuditError(f"reads {name!r}, which is not in {project}; write a file or folder of the project")


def _program(version: Sequence[str], command: Sequence[str]) -> str:
    return f"version:{json.dumps(list(version))}" if version else f"program:{command[0]}"


def _run(command: Sequence[str], folder: Path, variables: Sequence[str]) -> bytes:
    kept = {name: os.environ[name] for name in (*HANDED_ON, *variables) if name in os.environ}
    line = " ".join(command)
    try:
        process = subprocess.Popen(
            list(command),
            cwd=folder,
            env={**kept, **FIXED, "TMPDIR": str(folder.with_name("tmp"))},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
    except OSError as error:
        raise AuditError(f"`{line}` cannot be started: {error.strerror}; install {command[0]}, or declare it") from None
    try:
        output, complaint = process.communicate()
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)  # what it started ends with it
        process.communicate()
        raise
    if process.returncode:
        lines = [line.strip() for line in complaint.decode(errors="replace").splitlines() if line.strip()]
        told = next((line for line in lines if "error" in line.lower()), lines[-1] if lines else "it says nothing")
        said = told[:LONGEST]
        raise AuditError(f"`{line}` ended with code {process.returncode}: {said}")
    return output


def _require_kept(before: Mapping[str, str], folder: Path, project: Path, names: Sequence[str]) -> None:
    now = {**_checksums(folder), **{f"{project}/{name}": _sha256(project / name) for name in names}}
    changed = sorted(name for name in before if now.get(name) != before[name])
    if changed:
        raise AuditError(f"it changes what it reads: {', '.join(changed[:4])}; let it write another file")


def _require_declared(new: set[str], writes: Sequence[str]) -> None:
    if more := sorted(new - set(writes)):
        raise AuditError(f"it writes {', '.join(more[:4])}, which it does not declare; add to writes=[...]")
    if absent := sorted(set(writes) - new):
        raise AuditError(f"it did not write {', '.join(absent[:4])}, as it declares; look whether it ends early")


def _keep(path: Path, store: Path, command: Sequence[str]) -> str:
    sha256 = _sha256(path)
    if not (store / sha256).is_file():
        store.mkdir(parents=True, exist_ok=True)
        write_atomically(store / sha256, path.read_bytes())
    return sha256


def _around(folder: Path, project: Path) -> dict[str, tuple[int, int]]:
    """Size and time of the files of the project that are not hidden, and of those beside the folder of a command."""
    beside = (path for path in folder.parent.iterdir() if path.is_file())
    found = ((path, path.stat()) for path in (*visible(project, apart=("__pycache__",)), *beside))
    return {str(path): (state.st_size, state.st_mtime_ns) for path, state in found}


def _checksums(folder: Path) -> dict[str, str]:
    return {p.relative_to(folder).as_posix(): _sha256(p) for p in folder.rglob("*") if p.is_file()}


def _sha256(path: Path) -> str:
    return hashlib.sha256(_bytes(path)).hexdigest() if path.is_file() else ""


def _bytes(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() else b""


def _json(text: str | bytes, where: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        begins = f", it begins with {text[:30]!r}".replace("b'", "'", 1) if text else ""
        raise AuditError(f"{where} is no JSON{begins}: {error}; write the answer and nothing else") from None


def _csv(text: str, where: str) -> dict[str, list[float | str]]:
    """The columns by name; what reads as a finite number is one."""
    head, *rows = [row for row in csv.reader(io.StringIO(text), skipinitialspace=True) if row] or [[]]
    if len(head) == 1 and (mark := next((mark for mark in ";\t" if mark in head[0]), "")):
        raise AuditError(f"{where} is parted by {mark!r}; write a table with commas between its cells")
    if not rows or len(set(head)) != len(head) or any(len(row) != len(head) for row in rows):
        raise AuditError(f"{where} is no table with a line of names, each once, and as many cells in every line")
    return {name: [_number(row[i]) for row in rows] for i, name in enumerate(head)}


def _number(cell: str) -> float | str:
    with contextlib.suppress(ValueError):
        return number if math.isfinite(number := float(cell)) else cell
    return cell

"""Experiments that are a command in any language: run in a folder of their own that holds what they declare, no more.

Its program counts by its place, content and version, a file outside that the line or a script names by its content.
"""

import contextlib
import csv
import io
import json
import math
import os
import re
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from replication.audit.model import Experiment
from replication.audit.run.tracing import ABSENT, FIXED, loose, named, note, of_machine, said
from replication.errors import AuditError, listed
from replication.files import sha256 as checksum
from replication.files import visible, write_atomically

VERSION = "version:"
"""How the name of a dependency begins whose state is what a program prints of its version; see `tracing.state`."""
OUTPUT = "-"
"""The answer stands on the standard output, as JSON."""
LONGEST = 300
_NAME = rb"[^\x00-\x20/\"'`<>|&;:,()\[\]{}$*?\\#=]+"
_ABSOLUTE = re.compile(
    rb"(?:(?<![\w./<>*\\)\]}$~])|(?<=-[ILo])|(?<=file://))"
    rb"((?:\.\./+)+(?!\.)NAME|~\w+|)((?:/+NAME)+)".replace(b"NAME", _NAME)
)
"""Paths outside as lines, scripts and compiled programs write them, but no address, closing tag, date or quotient:
absolute ones, those that begin with ../, and below the home of somebody.
"""
_TOP = re.compile(rb"\b(?:setwd|chdir|cd)[\s(]*[\"']?/+[\"'\s);]")
_NO_JSON = re.compile(r"-?(NA|NaN|Inf|inf|nan|NULL|None|TRUE|FALSE|True|False|undefined)\b")
_TELLING = re.compile(r"error|cannot|no such|not found", re.IGNORECASE)


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

    store: the folder of files that experiments made, by checksum; needed: those that this one gets, by name. Raises
    AuditError for a command that fails, answers in no known form, or reads and writes what it does not declare.
    """
    project = Path(root)
    names = list(_files(project, [*reads, *([environment] if environment else [])]))
    with tempfile.TemporaryDirectory(prefix="replication-") as temporary:
        folder = Path(temporary).resolve() / "work"
        for inner in (
            folder,
            folder.with_name("tmp"),
            *((folder / name).parent for name in (*names, *needed, *writes)),
        ):
            inner.mkdir(parents=True, exist_ok=True)
        for name in names:
            shutil.copy(project / name, folder / name)
        for name, sha256 in needed.items():
            shutil.copy(Path(store) / sha256, folder / name)
            (folder / name).chmod(0o755)  # it may be a program
        if version and said(tuple(version)) == ABSENT:
            raise AuditError(f"`{' '.join(version)}` says no version; give the command that prints it, or none")
        programs = {word for word in (*command, *version) if shutil.which(word)} | {command[0]}
        note(*(f"./{name}" for name in names), *(f"env:{name}" for name in variables))
        note(*(f"program:{word}" for word in programs if os.sep not in word or Path(word).is_absolute()))
        note(*([f"{VERSION}{json.dumps(list(version))}"] if version else []))
        values = (os.environ.get(name, "") for name in variables)
        texts = ["\n".join([*command, *values]).encode(), *map(_bytes, folder.rglob("*"))]
        outside: set[Path] = set()
        while texts:  # what it names outside may name more
            beyond = set(named({path for text in texts for path in _outside(text, folder)})) - outside
            outside, texts = outside | beyond, [_bytes(path) for path in beyond if not of_machine(path)]
        before, stats = _seen(folder, project, names), _around(folder, project, outside)
        hidden = (str(path.relative_to(project)) for name in reads for path in (project / name).rglob(".*"))
        output = _run(command, folder, variables, hidden)
        after, now = _seen(folder, project, names), _around(folder, project, outside)
        new = after.keys() - before.keys()
        for paths, words in (
            ({name for name in before if after.get(name) != before[name]},
             "it changes what it reads: {}; let it write another file"),
            (now.keys() - stats.keys(), "it writes outside of its folder: {}; let it write where it starts"),
            (new - set(writes), "it writes {}, which it does not declare; add to writes=[...]"),
            (set(writes) - new, "it did not write {}, as it declares; look whether it ends early"),
        ):  # fmt: skip
            if paths:
                raise AuditError(words.format(", ".join(sorted(paths)[:4])))
        for path in sorted(path for path in stats if stats[path] != now.get(path)):
            loose(f"{path.removeprefix(f'{project}/')} changed while it ran")
        note(files={name: _keep(folder / name, Path(store)) for name in writes})
        if answer == OUTPUT:
            is_data = not writes or output.lstrip()[:1] in (b"{", b"[")  # else it only says what it does
            return _json(output, f"`{' '.join(command)}`: its output") if is_data else {"files": list(writes)}
        text = (folder / answer).read_text(encoding="utf-8-sig")
        return _csv(text, answer) if answer.endswith(".csv") else _json(text, f"`{' '.join(command)}`: {answer}")


def unseen(experiment: Experiment) -> tuple[str, ...]:
    """What no one sees of an experiment that is a command, in words; nothing of any other one."""
    if experiment.function is not execute:
        return ()
    inputs = experiment.inputs
    kinds = ["version"] * (not inputs["version"]) + ["packages"] * (not inputs["environment"])
    kinds.append("clock, draws, child programs and computed paths")
    return (f"{', '.join(kinds)} of {Path(inputs['command'][0]).name}",)


def held(file: str, sha256: str, root: str, store: str, needed: Mapping[str, str]) -> Any:
    """What a JSON file holds, or a CSV file by columns, that a command made or that lies in the project.

    sha256: what its checksum must be, or empty. store, needed: as for `execute`.
    """
    path = Path(store) / needed[file] if file in needed else Path(root) / file
    if not path.is_file() or not path.resolve().is_relative_to(Path(store if file in needed else root).resolve()):
        raise AuditError(
            f"{file!r} is not in {root}, and no [[command]] of claims.toml writes it; make it, or name it in `writes`"
        )
    if sha256 and (digest := checksum(path)) != sha256:
        raise AuditError(f"{file} has the SHA-256 {digest}, not {sha256}; it is another file than was declared")
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


def _run(command: Sequence[str], folder: Path, variables: Sequence[str], hidden: Iterable[str]) -> bytes:
    environment = {name: os.environ[name] for name in ("PATH", *variables) if name in os.environ}
    line, home = " ".join(command), str(folder.with_name("tmp"))  # R_PROFILE: R's start-up file that is not in HOME
    try:
        process = subprocess.Popen(
            list(command),
            cwd=folder,
            env={"HOME": home, "R_PROFILE": os.devnull, **environment, **FIXED, "TMPDIR": home},
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
    if code := process.returncode:
        lines = [line.strip() for line in complaint.decode(errors="replace").splitlines() if line.strip()]
        message = "; ".join(filter(_TELLING.search, lines)) or (lines[-1] if lines else "it says nothing")
        message = message.replace(home, "~").replace(f"{folder}/", "")
        ended = f"ended with code {code}" if code > 0 else f"was ended by signal {-code} ({signal.strsignal(-code)})"
        left = listed(sorted(set(hidden)))
        more = f"; hidden files are left out, unless reads names them: {left}" if left else ""
        raise AuditError(f"`{line}` {ended}: {message[:LONGEST]}{more}")
    return output


def _keep(path: Path, store: Path) -> str:
    if not (store / (name := checksum(path))).is_file():
        write_atomically(store / name, path.read_bytes())
    return name


def _around(folder: Path, project: Path, outside: Iterable[Path]) -> dict[str, tuple[int, int]]:
    """Size and time of the files of the project that are not hidden, of those beside a command's folder and outside."""
    beside = (path for path in (*folder.parent.iterdir(), *outside) if path.is_file())
    stats = ((path, path.stat()) for path in (*visible(project, apart=("__pycache__",)), *beside))
    return {str(path): (state.st_size, state.st_mtime_ns) for path, state in stats}


def _seen(folder: Path, project: Path, names: Sequence[str]) -> dict[str, str]:
    """The checksums of the files in the folder of a command, and of those of the project that it reads."""
    inside = {path.relative_to(folder).as_posix(): checksum(path) for path in folder.rglob("*") if path.is_file()}
    return inside | {f"{project}/{name}": checksum(project / name) for name in names}


def _outside(text: bytes, folder: Path) -> Iterator[str]:
    """The paths in a text that lead out of the folder of a command."""
    for front, rest in _ABSOLUTE.findall(text):
        path = os.path.normpath(folder / os.path.expanduser(os.fsdecode(front + rest)))  # noqa: PTH111
        if not Path(path).is_relative_to(folder.parent):
            yield path
    if _TOP.search(text):
        loose("files in /")


def _bytes(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() else b""


def _json(text: str | bytes, where: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        if not text.strip():
            raise AuditError(f"{where} is empty; write the answer there") from None
        whole, place = getattr(error, "doc", ""), getattr(error, "pos", 0)
        near = f", near {whole[max(place - 20, 0) : place + 20]!r}" if whole else ""
        word = _NO_JSON.match(whole, place)
        cure = f"JSON has no {word[0]}, only null, true and false" if word else "write the answer and nothing else"
        raise AuditError(f"{where} is no JSON{near}: {error}; {cure}") from None


def _csv(text: str, where: str) -> dict[str, list[float | str]]:
    """The columns by name; what reads as a finite number is one."""
    reader = csv.reader(io.StringIO(text), skipinitialspace=True)
    (_, head), *rows = [(reader.line_num, row) for row in reader if row] or [(1, [""])]
    if len(head) == 1 and (mark := next((mark for mark in ";\t" if mark in head[0]), "")):
        raise AuditError(f"{where} is parted by {mark!r}; write a table with commas between its cells")
    again = next((name for name in head if head.count(name) > 1), None)
    uneven = next(((line, len(row)) for line, row in rows if len(row) != len(head)), None)
    if again is not None or uneven or not rows:
        wrong = f"line {uneven[0]} has {uneven[1]} of {len(head)} cells" if uneven else "no line is below its names"
        wrong = wrong if again is None else f"two columns are called {again!r}"
        raise AuditError(
            f"{where} is no table: {wrong}; write a line of names, each once, and as many cells in every line"
        )
    return {name: [_number(row[i]) for _, row in rows] for i, name in enumerate(head)}


def _number(cell: str) -> float | str:
    with contextlib.suppress(ValueError):
        return number if math.isfinite(number := float(cell)) else cell
    return cell

"""What a computation depends on beside its sources, noted while it runs, so that nobody has to declare it.

What cannot be followed is named. What a module reads while it is imported counts for whoever imports it.
"""

import contextlib
import functools
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

import replication
from replication.audit.project import CONFIGURATION
from replication.audit.run.chance import CLOCK, RANDOM, listen
from replication.audit.store.provenance import installed, owners
from replication.audit.store.sources import SourceTree
from replication.extras import DISTRIBUTION
from replication.files import sha256

ABSENT = "absent"
FIXED = {"LC_ALL": "C.UTF-8", "TZ": "UTC", "PYTHONHASHSEED": "0"}
"""Language, time zone and order of sets of every experiment, so that no result depends on those of the user."""
PROGRAMS = ("subprocess.Popen", "os.exec", "os.posix_spawn", "os.spawn", "os.system", "pty.spawn")
NETWORK = ("socket.connect", "socket.getaddrinfo", "socket.gethostbyname")
LISTS = ("os.listdir", "os.scandir")
_OWN = ("TMP", "TEMP", "TMPDIR", "HOME", "USER", "PATH", "PWD", "LANG", "LANGUAGE", "TZ", "COLUMNS", "LINES", "TERM")
_OURS = re.compile(
    r"LC_|XDG_|PYTHON|OMP_|MKL_|KMP_|OPENBLAS_|BLIS_|NUMEXPR_|VECLIB_|JOBLIB_|LOKY_|MPL|SETUPTOOLS_|NO_COLOR"
)
"""Variables of the machine that libraries ask for; a project that reads one of them depends on it all the same."""
_STDLIB = sysconfig.get_path("stdlib")
_MACHINE = ("/usr/", "/lib", "/proc/", "/sys/", "/dev/", "/etc/ld.so", "/etc/localtime", "/etc/ssl", "/etc/fonts")
_LIBRARY = ("site-packages", "dist-packages")
_HOME = str(Path(replication.__file__).parent) + os.sep
_SEEKERS = ("/importlib/metadata/__init__.py", "/pkgutil.py")
"""Python's modules that list folders in search of packages, which count by their versions."""
_MAKERS = (".git", ".cache", ".venv", "__pycache__")


@dataclass
class Trace:
    """What was noted: files and folders by path, variables, and in words what cannot be followed.

    passing: files in a folder for a while, which must be gone when the computation ends.
    named: dependencies by the names of `state`, and files: made files by name and checksum, which a command declares.
    """

    root: str = ""
    read: dict[str, None] = field(default_factory=dict)
    written: set[str] = field(default_factory=set)
    variables: dict[str, None] = field(default_factory=dict)
    untraced: dict[str, None] = field(default_factory=dict)
    passing: set[str] = field(default_factory=set)
    named: set[str] = field(default_factory=set)
    files: dict[str, str] = field(default_factory=dict)


_active: Trace | None = None
_imported: dict[str, Trace] = {}
"""What modules of the project did while they were imported, by file: that happens once in a process."""


@contextlib.contextmanager
def traced(root: Path | None) -> Iterator[Trace]:
    """Note what is read meanwhile, for a project at `root`."""
    global _active
    _listen()
    before, _active = _active, Trace(root=f"{root}{os.sep}" if root else "\0")
    try:
        yield _active
    finally:
        for path in sorted(_active.passing):
            if os.path.exists(path):  # noqa: PTH110 - of each that was written
                _active.untraced[f"writes {path}"] = None
        _active = before


def noted(
    trace: Trace, tree: SourceTree, sources: Iterable[str] | None, modules: Iterable[str] = ()
) -> tuple[dict[str, str], tuple[str, ...]]:
    """By name of a dependency its state now, see `state`; and in words what cannot be followed.

    sources: labels of the files that the computation imports; None for all that this process imported.
    modules: imported beside these, by a computed name.
    """
    known = None if sources is None else {*sources, *modules}
    imported = {tree.label(Path(path)): part for path, part in _imported.items()}
    parts = [trace, *(part for label, part in imported.items() if known is None or label in known)]
    names = {f"env:{name}" for part in parts for name in part.variables}
    names |= {_label(path, tree) for part in parts for path in part.read if _counts(path, trace.root)}
    names |= {name for part in parts for name in part.named} | set(modules)
    names -= {f"env:{name}" for name in FIXED}
    states = {name: state(name, tree) for name in sorted(names - set(sources or ())) if name}
    return states, tuple(sorted({words for part in parts for words in part.untraced}))


def others(tree: SourceTree, sources: Iterable[str], known: Iterable[str]) -> set[str]:
    """Of what this process imported, the files of the project outside `sources`, and packages outside `known`."""
    files: set[str] = set()
    packages: set[str] = set()
    for name, module in list(sys.modules.items()):
        path = getattr(module, "__file__", None)
        if path and (label := tree.label(Path(path))) and not label.startswith(f"{replication.__name__}/"):
            files.add(label)
        elif "." not in name and name not in sys.stdlib_module_names:
            packages |= {f"package:{owner}" for owner in owners().get(name, ()) if owner != DISTRIBUTION}
    return (files - set(sources)) | (packages - {f"package:{name}" for name in known})


def note(*names: str, files: Mapping[str, str] | None = None) -> None:
    """Note dependencies by the names of `state`, and files that were made, of the computation that goes on."""
    if _active is not None:
        _active.named.update(names)
        _active.files.update(files or {})


def state(label: str, tree: SourceTree) -> str:
    """A word that changes when a dependency does: checksum of a file, names in a folder, value of a variable."""
    kind, _, name = label.partition(":")
    if kind == "env":
        value = os.environ.get(name)
        return ABSENT if value is None else sha256(value.encode(errors="surrogateescape"))
    if kind == "package":
        distribution = installed(name)
        return ABSENT if distribution is None else distribution.version
    if kind == "version":
        return said(tuple(json.loads(name)))
    if kind == "program":
        program = shutil.which(name)
        if program is None:
            return ABSENT
        path = Path(program).resolve()
        return f"{path} {_program_sha256(path, path.stat().st_mtime_ns)}"
    path = Path(label) if label.startswith("/") else tree.path(label)
    with contextlib.suppress(OSError, ValueError):
        if label.endswith("/"):
            names = (
                entry.name for entry in path.iterdir() if not entry.name.startswith(".") and entry.name != "__pycache__"
            )
            return sha256("\n".join(sorted(names)))
        return sha256(path.read_bytes())
    return ABSENT


@functools.cache
def said(command: tuple[str, ...]) -> str:
    """The first line of what a program says of its version; `ABSENT` if it fails or says nothing."""
    try:
        process = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return ABSENT
    lines = (process.stdout + process.stderr).strip().splitlines()
    return lines[0] if lines and not process.returncode else ABSENT


@functools.cache
def _program_sha256(path: Path, changed: int) -> str:
    with contextlib.suppress(OSError):
        return sha256(path)
    return str(changed)


def _label(path: str, tree: SourceTree) -> str:
    folder = path.endswith("/")
    where = Path(path).resolve()
    return f"{(tree.label(where) or str(where)).removesuffix('/.')}{'/' if folder else ''}"


def _counts(path: str, root: str) -> bool:
    """Whether a path is data: neither of the machine, nor of Python and its packages, nor what programs keep aside."""
    parts = Path(path).parts
    if any(part in _LIBRARY or part in _MAKERS for part in parts) or path.startswith(_HOME):
        return False
    if path.startswith(root):
        return not path.startswith((f"{sys.prefix}/", f"{sys.exec_prefix}/"))
    prefixes = (*_MACHINE, f"{sys.prefix}/", f"{sys.base_prefix}/", str(Path.home() / ".config"))
    return not path.startswith(prefixes) and not (path.startswith(tempfile.gettempdir()) and not Path(path).exists())


@functools.cache
def _listen() -> None:
    """Python keeps such a listener as long as the process lives."""
    tempfile.gettempdir()  # found once, under a lock, by writing: not while something is heard
    sys.addaudithook(_hear)
    listen(_chance)
    value_of = os._Environ.__getitem__

    def asked(self: Any, key: Any) -> Any:
        if _active is not None:
            _ask(os.fsdecode(key) if isinstance(key, bytes) else str(key), sys._getframe(1))
        return value_of(self, key)

    os._Environ.__getitem__ = asked  # type: ignore[method-assign]


def _chance(words: str, frame: FrameType) -> None:
    """Note what is another one each time, if a module of the project or a package that it calls asks for it."""
    if _active is None:
        return
    place = next((place for place in _frames(frame) if not RANDOM.search(place.f_code.co_filename)), None)
    by = place.f_code.co_filename if place is not None else ""
    if ours(by) or (words != CLOCK and _library(by) and place is not None and not _importing(place)):
        _owner(frame).untraced[words] = None


def named(paths: Iterable[str]) -> tuple[Path, ...]:
    """Of absolute paths that a command names the files, noted as read; of others the folder, unless of the machine.

    Which files of a folder a command opens, and whether one is there later, no one can follow.
    """
    files: list[Path] = []
    if (active := _active) is None:
        return ()
    for path in sorted(map(Path, paths)):
        place = next(ancestor for ancestor in (path, *path.parents) if os.path.exists(ancestor))  # noqa: PTH110 - any text may be one
        if place.is_file() and not str(place).startswith(("/proc/", "/sys/")):
            inside = place.is_relative_to(active.root)
            note(f"./{place.relative_to(active.root)}" if inside else str(place))
            files.append(place)
        elif len(place.parts) > 1 and (
            not of_machine(place) or place.is_relative_to("/dev/shm") or "share" in path.parts[2:-1]
        ):
            loose(f"files in {place}")
    return tuple(files)


def of_machine(path: Path) -> bool:
    """Whether a path is one of the machine, or of Python and its packages, and so no data."""
    return _active is None or not _counts(str(path), _active.root)


def loose(words: str) -> None:
    """Note what cannot be followed of the computation that goes on."""
    if _active is not None:
        _active.untraced[words] = None


def ours(file: str) -> bool:
    """Whether a file is one of the project, for the computation that goes on."""
    return _active is not None and file.startswith(_active.root) and _of_project(file, _active.root)


@functools.cache
def _of_project(file: str, root: str) -> bool:
    return _counts(file, root)


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    if _active is None or not event.startswith(
        ("open", "os.", "subprocess.", "socket.", "sqlite3.", "ctypes.", "pty.")
    ):
        return
    frame = sys._getframe(1)
    by = frame.f_code.co_filename
    if event == "open" or event in ("sqlite3.connect", "ctypes.dlopen"):
        if isinstance(arguments[0], str | bytes | os.PathLike) and not by.startswith("<frozen importlib"):
            flags = (arguments[2] or 0) if event == "open" else 0
            path = os.fsdecode(arguments[0])
            internal = path.endswith(f"/{CONFIGURATION}") and _asking(frame).startswith(_HOME)
            # A folder that is removed is opened by names within the one above.
            removed = frame.f_code.co_name.startswith("_rmtree")
            if not (internal or removed or by.endswith(("/linecache.py", "/tokenize.py"))):
                _open(path, flags, frame, library=event == "ctypes.dlopen")
    elif event in LISTS:
        # What this program lists, such as the papers there are, is no data of a computation.
        internal = by.startswith("<frozen importlib") or by.endswith(_SEEKERS) or _asking(frame).startswith(_HOME)
        if not (internal or isinstance(arguments[0], int)):
            _owner(frame).read[f"{os.path.abspath(os.fsdecode(arguments[0] or '.'))}/"] = None  # noqa: PTH100
    elif event in PROGRAMS:
        machine = ("/ctypes/util.py", "/platform.py", "/font_manager.py")
        if not _asking(frame).startswith(_HOME) and not any(name.endswith(machine) for name in _callers(frame)):
            _owner(frame).untraced[f"program {_program(arguments)}"] = None
    elif event in NETWORK:
        _owner(frame).untraced["network"] = None
    elif event == "socket.gethostname" and not _library(_asking(frame)):
        _owner(frame).untraced["the name of the machine"] = None


def _program(arguments: tuple[Any, ...]) -> str:
    first = arguments[0] if arguments[0] is not None else arguments[1]
    word = first[0] if isinstance(first, list | tuple) and first else first
    return Path(os.fsdecode(word).split()[0] if word else "?").name


def _open(path: str, flags: int, frame: FrameType, *, library: bool) -> None:
    path = os.path.abspath(path) if os.sep in path or not library else ""  # noqa: PTH100 - the folder may change later
    owner = _owner(frame)
    if flags & (os.O_WRONLY | os.O_RDWR):
        if path not in owner.read:
            owner.written.add(path)
        assert _active is not None
        lasting = not path.startswith(tempfile.gettempdir()) or path.startswith(_active.root)
        asking = _asking(frame)
        if lasting and _counts(path, _active.root) and not asking.startswith(_HOME):
            owner.untraced[f"writes {path.removeprefix(_active.root)}"] = None
        elif not lasting and ours(asking):
            owner.passing.add(path)
    elif path and path not in owner.written:
        owner.read[path] = None


def _ask(name: str, frame: FrameType) -> None:
    """Note a variable, unless Python or this program asks for it, or a library for one of the machine."""
    inner = ("/os.py", "_collections_abc.py", "<frozen os>", "<frozen _collections_abc>")
    by = next((name for name in _callers(frame) if not name.endswith(inner)), "<")
    library = _library(by)
    if by.startswith(("<", _HOME)) or (by.startswith(_STDLIB) and not library):
        return
    if not library or not (name in _OWN or _OURS.match(name) or _importing(frame)):
        _owner(frame).variables[name] = None


def _owner(frame: FrameType) -> Trace:
    """Where to note: for the module of the project that is being imported, else for the computation."""
    assert _active is not None
    for place in _frames(frame):
        by = place.f_code.co_filename
        if place.f_code.co_name == "<module>" and ours(by):
            return _imported.setdefault(by, Trace())
    return _active


def _library(file: str) -> bool:
    return any(f"{os.sep}{part}{os.sep}" in file for part in _LIBRARY)


def _asking(frame: FrameType) -> str:
    """The file of the innermost caller that is not Python's own."""
    return next((name for name in _callers(frame) if _library(name) or not name.startswith((_STDLIB, "<"))), "")


def _importing(frame: FrameType) -> bool:
    return any(name.startswith("<frozen importlib") for name in _callers(frame))


def _callers(frame: FrameType) -> Iterator[str]:
    return (place.f_code.co_filename for place in _frames(frame))


def _frames(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back

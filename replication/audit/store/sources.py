"""Which of the project's own files a function depends on, each with its SHA-256, found by following imports."""

from __future__ import annotations

import ast
import functools
import importlib.util
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import replication
from replication.audit.project import read_settings
from replication.errors import AuditError
from replication.files import sha256

CALLERS = tuple(
    f"replication/audit/{name}.py" for name in ("run/worker", "run/assemble", "run/draw", "declare", "numbers")
)
"""Where the functions of papers are called, which is never the cause of an error."""

_FILE = re.compile(rb"""(["'])([\w./-]{1,100}\.(?!py["'])[a-z0-9]{1,5})\1""")
"""A text that may name a file, as it stands in quotes."""
_DYNAMIC = re.compile(rb"\b(?:import_module|__import__|run_path|run_module|exec|spec_from_file_location)\s*\(")
"""How a module imports what its text does not name."""
_INSTALLED = ("site-packages", "dist-packages")
_BODIES = ("body", "orelse", "finalbody", "handlers", "cases")
"""Where a statement holds others."""


@dataclass(frozen=True, kw_only=True)
class _Module:
    sha256: str
    imports: tuple[tuple[str, str], ...]  # (module, name taken from it or ""), absolute
    texts: tuple[str, ...]  # that may name a file
    bound: frozenset[str]  # the names that it binds itself, at any depth; none if no module lies in it
    dynamic: bool  # whether it imports by a computed name


class SourceTree:
    """The project's packages by name and directory, and whatever these import that no distribution installed.

    Files are called by the package and the path inside it, with forward slashes: `replication/errors.py`; others of the
    project by their path in its folder, `./model/core.py`. A file is read once; make a new tree to see later edits.
    """

    def __init__(self, packages: Mapping[str, Path]) -> None:
        self.packages = {name: Path(directory).resolve() for name, directory in packages.items()}
        # The folder in which the papers lie.
        self.root = next((folder.parent for name, folder in self.packages.items() if name != "replication"), None)
        self._elsewhere: dict[str, Path | None] = {}
        for name in ("_followed", "_read_with", "_label_at", "_path", "_module", "_imported_by"):
            setattr(self, name, functools.cache(getattr(self, name)))

    def files_of(self, module: str) -> dict[str, str]:
        """SHA-256 by file of `module` and of all that it imports, transitively, lazy imports included.

        Of an enclosing package the imports are followed only where a name is taken from it: else each experiment would
        depend on every file of its paper. Raises AuditError for no module of the project, and for no Python.
        """
        followed = self._followed(module)
        enclosing = {parent for name in followed for parent in parents(name)}
        files = (self._read_with(name) for name in followed | enclosing)
        return dict(sorted(pair for part in files for pair in part.items()))

    def installed_of(self, module: str) -> set[str]:
        """The top-level modules that `module` imports, transitively, and that are no files of the project or Python."""
        tops = {name.partition(".")[0] for name in self._followed(module)}
        return {name for name in tops if self._place(name) is None and name not in sys.stdlib_module_names}

    def is_dynamic(self, module: str) -> bool:
        """Whether it, or a file of the papers and beside them that it imports, imports by a computed name."""
        names = (name for name in self._followed(module) if not name.startswith(f"{replication.__name__}."))
        return any(source.dynamic for name in names if (source := self._module(name)) is not None)

    def _followed(self, module: str) -> set[str]:
        """The module with all that it imports, directly or not."""
        if self._module(module) is None:
            known = ", ".join(self.packages)
            raise AuditError(f"module {module} is not a file of {known}; define the experiment in one of these")
        followed: set[str] = set()
        waiting = [module]
        while waiting:
            name = waiting.pop()
            if name not in followed:
                followed.add(name)
                waiting.extend(self._imported_by(name))
        return followed

    def _read_with(self, name: str) -> dict[str, str]:
        """SHA-256 of a module, of the data file beside it that has its name, and of those that it names in a string."""
        path, module = self._path(name), self._module(name)
        if path is None or module is None:
            return {}
        file = self.label(path)
        data = [
            file.removesuffix(".py") + ".toml",
            *(self.label((path.parent / text).resolve()) for text in module.texts),
        ]
        return {file: module.sha256, **{label: digest for label in data if (digest := sha256(self.path(label)))}}

    def label(self, path: Path) -> str:
        """`package/inside/file.py` of a path inside a package, `./file` elsewhere in the project; else empty."""
        elsewhere = {name: place for name, place in self._elsewhere.items() if place is not None}
        places = {**self.packages, **({} if self.root is None else {".": self.root}), **elsewhere}
        for name, directory in places.items():
            if path.is_relative_to(directory):
                inside = path.relative_to(directory)
                # An environment below the project holds packages, which count by their versions.
                return "" if set(_INSTALLED) & set(inside.parts) else f"{name}/{inside.as_posix()}"
            if name in elsewhere and path == directory.with_suffix(".py"):
                return path.name
        return ""

    def path(self, label: str) -> Path:
        """Where the file or folder of this label lies."""
        package, folder, inside = label.partition("/")
        if not folder:
            module = self._place(label.removesuffix(".py")) if label.endswith(".py") else None
            return Path("\0") if module is None else module.with_suffix(".py")
        place = self.root if package == "." else self.packages.get(package) or self._place(package)
        return (place or Path(package)) / inside

    def _label_at(self, file: str) -> str:
        """`label` of a path as code notes it."""
        return "" if file.startswith("<") else self.label(Path(file).resolve())

    def location(self, function: Callable[..., Any]) -> str:
        """`file:line` where a function, partial or callable is defined or `declared`; empty outside the project."""
        while isinstance(function, functools.partial) or hasattr(function, "__wrapped__"):
            if declared := getattr(function, "declared", None):
                return self._line(*declared)
            function = function.func if isinstance(function, functools.partial) else function.__wrapped__
        code = getattr(function, "__code__", None) or getattr(type(function).__call__, "__code__", None)
        return "" if code is None else self._line(code.co_filename, code.co_firstlineno)

    def _line(self, file: str, number: int) -> str:
        label = self._label_at(file)
        return f"{label}:{number}" if label else ""

    def mentioned(self, name: str) -> str:
        """` [file:line]` of the first line of a paper that writes a name, with its key or without; else empty."""
        key, _, short = re.split(r"([.-])", name, maxsplit=1) if re.search("[.-]", name) else (name, "", "")
        for package, directory in self.packages.items():
            is_paper = (directory / key).is_dir() and bool(short)
            front = rf"(?:{re.escape(key)}[.-])?" if is_paper else ""
            word = f"{front}{re.escape(short if is_paper else name)}"
            files = (directory / key if is_paper else directory).rglob("*.*") if package != "replication" else ()
            written = [
                path for path in sorted(files) if path.suffix in (".py", ".toml") and path.name != "coverage.toml"
            ]
            texts = [(path, path.read_text(encoding="utf-8").splitlines()) for path in written]
            lines = [(path, number, line) for path, text in texts for number, line in enumerate(text, 1)]
            # In quotes it is a name for sure; a word like another one may stand in any docstring.
            for pattern in (rf"[\"']{word}[\"']", rf"(?<![\w.-]){word}(?![\w-])"):
                for path, number, line in lines:
                    if re.search(pattern, line):
                        return f" [{self.label(path)}:{number}]"
        return ""

    def last_line(self, traceback: TracebackType | None, *, of_papers: bool = False) -> str:
        """`file:line` of the innermost frame in the project, or `of_papers` alone, callers aside; empty if none."""
        line, theirs = "", ""
        while traceback is not None:
            label = self._label_at(traceback.tb_frame.f_code.co_filename)
            line = f"{label}:{traceback.tb_lineno}" if label and label not in CALLERS else line
            theirs = line if label and not label.startswith(f"{replication.__name__}/") else theirs
            traceback = traceback.tb_next
        return theirs if of_papers else line

    def _path(self, module: str) -> Path | None:
        """The file of a module, or None if the name is no module of the project."""
        package, *inside = module.split(".")
        directory = self._place(package)
        if directory is None:
            return None
        place = directory.joinpath(*inside)
        return next(
            (path for path in (place / "__init__.py", place.with_name(f"{place.name}.py")) if path.is_file()), None
        )

    def _place(self, package: str) -> Path | None:
        """The folder of a top-level package, or of a module without its suffix; None if Python or pip brought it."""
        if package in self.packages:
            return self.packages[package]
        if package not in self._elsewhere:
            self._elsewhere[package] = self._beside(package)
        return self._elsewhere[package]

    def _beside(self, package: str) -> Path | None:
        if self.root is None or not package.isidentifier():
            return None
        here = self.root / package
        if here.with_suffix(".py").is_file() or (here / "__init__.py").is_file() or any(here.glob("*.py")):
            return here
        if package in sys.stdlib_module_names:
            return None
        try:
            spec = importlib.util.find_spec(package)
        except (ImportError, ValueError):
            return None
        places = list(spec.submodule_search_locations or ()) if spec else []
        origin = spec.origin if spec and spec.has_location else None
        file = Path(places[0]) if places else Path(origin).with_suffix("") if origin else None
        return None if file is None or set(_INSTALLED) & set(file.parts) else file.resolve()

    def _module(self, name: str) -> _Module | None:
        path = self._path(name)
        return None if path is None else _parsed(name, path, path.read_bytes())

    def _imported_by(self, name: str) -> tuple[str, ...]:
        module = self._module(name)
        names = []
        for source, taken in module.imports if module else ():
            part = f"{source}.{taken}" if taken else ""
            if part and self._module(part) is not None:
                names.append(part)
                # A submodule hides nothing unless the package binds the same name itself.
                package = self._module(source)
                if package is None or taken not in package.bound:
                    continue
            names.append(source)
        return tuple(dict.fromkeys(names))


def default_packages(root: Path) -> dict[str, Path]:
    """The packages whose files count as sources: this one, wherever it is installed, and the papers at `root`."""
    package = read_settings(root).papers
    return {"replication": Path(replication.__file__).parent, package: root / package}


def parents(module: str) -> Iterator[str]:
    """The packages that enclose a module, the nearest first."""
    while "." in module:
        module = module.rpartition(".")[0]
        yield module


@functools.cache
def _parsed(name: str, path: Path, content: bytes) -> _Module:
    """What a file says; each is read by several trees in one command."""
    try:
        tree = ast.parse(content, filename=str(path))
    except (SyntaxError, ValueError) as error:
        raise AuditError(f"{path} cannot be read as Python: {error}; correct the file") from None
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    imports = tuple(dict.fromkeys(pair for node in _statements(tree) for pair in _imports(node, package)))
    texts = tuple(match[2].decode() for match in _FILE.finditer(content))
    bound = frozenset(_bound(tree) if path.name == "__init__.py" or path.with_suffix("").is_dir() else ())
    return _Module(
        sha256=sha256(content), imports=imports, texts=texts, bound=bound, dynamic=bool(_DYNAMIC.search(content))
    )


def _statements(tree: ast.Module) -> Iterator[ast.AST]:
    """All statements at any depth; expressions hold none and are not walked."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        for field in _BODIES:
            waiting.extend(getattr(node, field, ()))


def _imports(node: ast.AST, package: str) -> Iterator[tuple[str, str]]:
    if isinstance(node, ast.Import):
        for alias in node.names:
            # `import a.b.c` binds a, through which everything that a and a.b hold can be reached.
            yield from ((module, "") for module in (alias.name, *parents(alias.name)))
    elif isinstance(node, ast.ImportFrom):
        base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
        module = ".".join([*base, *([node.module] if node.module else [])])
        yield from ((module, "" if alias.name == "*" else alias.name) for alias in node.names)


def _bound(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield from (alias.asname or alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id

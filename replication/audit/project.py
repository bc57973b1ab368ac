"""A project, the folder that holds `replication.toml`, and its papers: what `paper.toml` says of each.

docs/adding-a-paper.md has the settings, all of which may be left out.
"""

import functools
import importlib
import pkgutil
import re
import sys
import traceback
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.data import converted, line_of_field, read_tables
from replication.audit.inspect.coverage import read_coverage, tallied
from replication.audit.parts import Codecheck, Named, Paper, Reply
from replication.errors import AuditError, ReplicationError, one_of
from replication.extras import told
from replication.files import sha256

CONFIGURATION = "replication.toml"
PACKAGE = "papers"


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the configuration says; the results repeat it, so that a report needs nothing else."""

    title: str = "Replication"
    subject: str = ""
    authors: tuple[str, ...] = ()
    common: str = ""
    copy: str = ""
    repository: str = ""
    papers: str = PACKAGE
    codecheck: Codecheck = Codecheck()

    def sources(self, commit: str, dirty: bool | None) -> str:
        """Where the files of a commit are read, without a copy of the sources; empty if they are public nowhere."""
        return f"{self.repository.rstrip('/')}/blob/{commit}/" if self.repository and commit and dirty is False else ""


@dataclass(frozen=True)
class Project:
    """The folder of a project, and its settings."""

    root: Path
    settings: Settings

    @property
    def folder(self) -> Path:
        """Where the papers lie."""
        return self.root / self.settings.papers

    @property
    def cache(self) -> Path:
        """Where runs keep what they computed."""
        return self.root / ".cache" / "replication"

    @property
    def keys(self) -> tuple[str, ...]:
        """The papers there are, by module name, which is also `Paper.key`."""
        names = (module.name for module in pkgutil.iter_modules([str(self.folder)]))
        return tuple(sorted(name for name in names if not name.startswith("_")))

    def load(self, keys: Iterable[str] = ()) -> tuple[Paper, ...]:
        """The papers of these keys, or all, in the order of `keys`; AuditError for an unknown or broken one."""
        if not self.keys:
            raise AuditError(f"there is no paper in {self.folder} yet; begin one with `replication new KEY`")
        selection = {one_of("paper", key, self.keys) for key in keys} or set(self.keys)
        self._let_import()
        return tuple(self._paper(key) for key in self.keys if key in selection)

    def _let_import(self) -> None:
        """Python finds the papers here, and no package of the same name elsewhere."""
        if str(self.root) not in sys.path:
            sys.path.insert(0, str(self.root))
        package = self.settings.papers
        places = [Path(place).resolve() for place in getattr(sys.modules.get(package), "__path__", ())]
        if package in sys.modules and self.folder.resolve() not in places:
            taken = ", ".join(map(str, places)) or "a module of Python"
            raise AuditError(
                f"the name {package} stands for {taken} already; give the folder another name, and say so in "
                f'{self.root / CONFIGURATION}: papers = "..."'
            )

    def _paper(self, key: str) -> Paper:
        package = self.settings.papers
        try:
            paper = getattr(importlib.import_module(f"{package}.{key}"), "PAPER", None)
        except Exception as error:  # noqa: BLE001 - a paper's modules may fail in any way; whose mistake it is must be said
            raise AuditError(f"{package}/{key} cannot be loaded: {self._told(error)}; correct it there") from None
        if not isinstance(paper, Paper) or paper.key != key:
            raise AuditError(f"{package}/{key} must define PAPER, a Paper whose key is {key!r}, got {paper!r:.80}")
        return paper

    def _told(self, error: Exception) -> str:
        """An error with file and line of the papers; its type only where no sentence of ours explains it."""
        here = self.folder
        lines = [part for part in traceback.extract_tb(error.__traceback__) if Path(part.filename).is_relative_to(here)]
        at = [(Path(part.filename), part.lineno) for part in lines if Path(part.filename) != here / "__init__.py"]
        if isinstance(error, SyntaxError) and error.filename:
            at.append((Path(error.filename), error.lineno))
        where = f" [{at[-1][0].relative_to(self.root).as_posix()}:{at[-1][1]}]" if at else ""
        message = error.msg if isinstance(error, SyntaxError) else told(error)
        return f"{'' if isinstance(error, ReplicationError) else f'{type(error).__name__}: '}{message}{where}"


def find_project(start: Path) -> Project:
    """The project in which `start` lies; raises AuditError if no folder above it holds a configuration."""
    root = root_above(start)
    if root is None:
        raise AuditError(
            f"there is no {CONFIGURATION} in {start} or above it; change to the folder of a project, or begin one here "
            "with `replication new KEY`"
        )
    return Project(root, read_settings(root))


def root_above(start: Path) -> Path | None:
    """The nearest folder that holds a configuration, `start` or one above it; None if there is none."""
    folders = (start.resolve(), *start.resolve().parents)
    return next((folder for folder in folders if (folder / CONFIGURATION).is_file()), None)


def read_settings(root: Path) -> Settings:
    """The settings of the project at `root`, those by default where it has no configuration.

    Raises AuditError that names the file and the wrong or unknown field.
    """
    path = root / CONFIGURATION
    return _settings(path, sha256(path)) if path.is_file() else Settings()


@functools.cache
def _settings(path: Path, content: str) -> Settings:
    record = converted(str(path), read_tables(path), Settings)
    name = record.papers
    if not name.isidentifier() or name in {"replication", "tests", *sys.stdlib_module_names}:
        raise AuditError(
            f"{path}: papers = {name!r} cannot name a package of papers; give the name of a folder beside the file "
            f"that is a Python name and no module of Python, such as {PACKAGE!r}"
        )
    if record.repository and not re.fullmatch(r"https://[A-Za-z0-9.-]+(/[A-Za-z0-9._~-]+)+/?", record.repository):
        raise AuditError(
            f"{path}: repository = {record.repository!r} is no public address of the sources; give it as in a browser, "
            "such as https://github.com/a/b"
        )
    if not record.title.strip():
        raise AuditError(f"{path}: the title is empty; say what is audited here")
    return record


NAME = "paper.toml"


class About(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fields of the file; year is None if the text gives none, an author with an ORCID is a table."""

    title: str
    authors: tuple[str | Named, ...]
    summary: str
    year: int | None = None
    venue: str = ""
    doi: str = ""
    notebook: str = ""
    bibtex: str = ""
    replies: tuple[Reply, ...] = ()


def about(module: str) -> dict[str, Any]:
    """What `paper` asks of a source: its key, what paper.toml says of it, and how much of its text is covered.

    module: a module of the paper, as `__file__`; the key is the name of its folder.
    """
    path = Path(module).with_name(NAME)
    record, texts = _read(path), read_coverage(path.with_name("coverage.toml"))
    key = path.parent.name
    fields = {name: getattr(record, name) for name in About.__struct_fields__}
    people = [author if isinstance(author, Named) else Named(name=author) for author in record.authors]
    authors = tuple(author.name for author in people)
    return {
        **fields,
        "key": key,
        "authors": authors,
        "orcids": {author.name: author.orcid for author in people if author.orcid},
        "bibtex": record.bibtex or _entry(key, authors, record),
        "replies": tuple(
            msgspec.structs.replace(reply, claim=f"{key}.{reply.claim.lower()}") for reply in record.replies
        ),
        "coverage": tuple(tally for name, text in texts.items() for tally in tallied(name, text)),
    }


def _read(path: Path) -> About:
    table = read_tables(path)
    for name in ("title", "authors", "summary"):
        if not table.get(name) or (isinstance(table[name], str) and not table[name].strip()):
            raise AuditError(f"{_at(path, name)} is missing or empty; say what the paper gives")
    return converted(lambda name: _at(path, name), table, About)


def _at(path: Path, name: str) -> str:
    return f"{path}:{line_of_field(path, name)}: {name}"


def _entry(key: str, authors: Iterable[str], record: About) -> str:
    """A BibTeX entry of the fields that are given."""
    fields = {
        "author": " and ".join(authors),
        "title": record.title,
        "howpublished": record.venue,
        "year": record.year,
        "doi": record.doi,
    }
    lines = [f"@misc{{{key}", *(f"  {name} = {{{value}}}" for name, value in fields.items() if value)]
    return ",\n".join(lines) + "\n}"

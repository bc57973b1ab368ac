"""What a paper is called, by whom it is and where it was published: paper.toml beside its module.

title = "A note on an epidemic"
authors = ["A. Author", "B. Author"]
summary = "In your own words: the problem, the method, the example."
year = 2031                        # optional, as are all that follow
venue = "Journal of Examples 3, 14-15"
doi = "10.1000/182"
notebook = "epidemic"              # name of its tutorial
bibtex = '''@article{...}'''       # made of the rest where it is not given
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.data import line_of_field, read_tables
from replication.audit.inspect.coverage import tallies
from replication.audit.names import meant
from replication.errors import AuditError

NAME = "paper.toml"


class About(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The fields of the file; year is None if the text gives none."""

    title: str
    authors: tuple[str, ...]
    summary: str
    year: int | None = None
    venue: str = ""
    doi: str = ""
    notebook: str = ""
    bibtex: str = ""


def about(module: str) -> dict[str, Any]:
    """What `paper` asks of a source: its key, what paper.toml says of it, and how much of its text is covered.

    module: a module of the paper, as `__file__`; the key is the name of its folder.
    Raises AuditError that names file and field for what paper.toml does not say, or says in another form, and as
    `read_coverage`.
    """
    path = Path(module).with_name(NAME)
    found = _read(path)
    key = path.parent.name
    fields = {name: getattr(found, name) for name in About.__struct_fields__}
    return {**fields, "key": key, "bibtex": found.bibtex or _entry(key, found), "coverage": tallies(module)}


def _read(path: Path) -> About:
    table = read_tables(path)
    unknown = sorted(table.keys() - set(About.__struct_fields__))
    if unknown:
        raise AuditError(f"{_at(path, unknown[0])} is no field; {meant(unknown[0], About.__struct_fields__)}")
    for name in ("title", "authors", "summary"):
        if not table.get(name) or (isinstance(table[name], str) and not table[name].strip()):
            raise AuditError(f"{_at(path, name)} is missing or empty; say what the paper gives")
    try:
        return msgspec.convert(table, About)
    except msgspec.ValidationError as error:
        field = re.search(r"\$\.(\w+)", str(error))
        raise AuditError(f"{_at(path, field[1] if field else '')}: {error}; correct it") from None


def _at(path: Path, name: str) -> str:
    return f"{path}:{line_of_field(path, name)}: {name}"


def _entry(key: str, found: About) -> str:
    """A BibTeX entry of the fields that are given."""
    fields = {
        "author": " and ".join(found.authors),
        "title": found.title,
        "howpublished": found.venue,
        "year": found.year,
        "doi": found.doi,
    }
    lines = [f"@misc{{{key}", *(f"  {name} = {{{value}}}" for name, value in fields.items() if value)]
    return ",\n".join(lines) + "\n}"

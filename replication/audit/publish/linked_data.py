"""What other programs and registers read of an audit, by the templates in `json`, each of which says what it is of.

At the root of a project lie `codecheck.yml` of CODECHECK, the specification of the configuration file in version 2.0
and its published rules, by whose names `unmet` says what is still to be filled in
(https://codecheck.org.uk/spec/config/2.0/); and `.zenodo.json` of Zenodo, the fields of a deposition
(https://developers.zenodo.org/#representation).
"""

import hashlib
import html
import json
import mimetypes
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.inspect.headline import sentence
from replication.audit.parts import PLACEHOLDER, plain_orcid
from replication.audit.store.records import PaperRecord, ResultsFile
from replication.errors import AuditError, one_of
from replication.files import write_atomically
from replication.scaffold import plain_templates

CITATION = "CITATION.cff"
Json = dict[str, Any]
_GROUP = re.compile(
    r"^The |\b(collaboration|consortium|contributors|developers|group|laboratory|project|team|university)\b", re.I
)


class Person(msgspec.Struct, frozen=True, kw_only=True, rename="kebab"):
    """An author: a person with family and given names, or a group with a name."""

    name: str = ""
    family_names: str = ""
    given_names: str = ""
    orcid: str = ""

    def __post_init__(self) -> None:
        _ = self.plain_orcid

    @property
    def full_name(self) -> str:
        """Given and family name, or the name of the group."""
        return self.name or f"{self.given_names} {self.family_names}".strip()

    @property
    def plain_orcid(self) -> str:
        """The ORCID without the address in front of it, which CITATION.cff asks for; ValueError if it is none."""
        return plain_orcid(self.orcid) if self.orcid else ""

    @property
    def linked(self) -> Json:
        """The author in the vocabulary of schema.org; a name that says so is that of a group."""
        kind = "Organization" if _GROUP.search(self.full_name) else "Person"
        address = {"@id": f"https://orcid.org/{self.plain_orcid}"} if self.orcid else {}
        return {"@type": kind, **address, "name": self.full_name}


class Software(msgspec.Struct, frozen=True, kw_only=True, rename="kebab"):
    """The parts of CITATION.cff that the exports repeat; others are left to that file."""

    title: str
    abstract: str
    version: str
    license: str
    authors: tuple[Person, ...]
    keywords: tuple[str, ...] = ()
    repository_code: str = ""
    url: str = ""
    doi: str = ""


def read_software(root: Path) -> Software:
    """Read CITATION.cff of the project at `root`; raises AuditError that names the missing file or the wrong field."""
    path = root / CITATION
    try:
        return msgspec.yaml.decode(path.read_bytes(), type=Software)
    except FileNotFoundError:
        raise AuditError(
            f"{path} is missing; the exports take title, abstract, version, license and authors from it; "
            "write them there, each as `name: text`, the authors as a list such as `authors: [{name: A. Author}]`"
        ) from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise AuditError(f"{path} cannot be used: {error}; correct it") from None


MEDIA_TYPES = {".md": "text/markdown", ".j2": "text/plain", ".cff": "application/yaml", ".yml": "application/yaml"}
_TEMPLATES = plain_templates(Path(__file__).with_name("json"))


def filled(name: str, **fields: Any) -> Json:
    """What the template `json/NAME.j2` says of what it is given, without fields that say nothing."""
    content: Json = without_empty(json.loads(_TEMPLATES.get_template(f"{name}.j2").render(fields)))
    return content


def to_json(content: Json) -> str:
    """Indented JSON with the fields in their order and one newline at the end."""
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _people(paper: PaperRecord) -> list[Person]:
    return [Person(name=name, orcid=paper.orcids.get(name, "")) for name in paper.authors]


def media_type(name: str) -> str:
    """The media type of a file by its name, the same on every machine."""
    known, _ = mimetypes.MimeTypes(filenames=()).guess_type(name)
    return MEDIA_TYPES.get(Path(name).suffix) or known or "application/octet-stream"


def without_empty(value: Any) -> Any:
    """A list, or the fields that say something, at any depth; anything else as it is."""
    if isinstance(value, list):
        return [without_empty(entry) for entry in value]
    if not isinstance(value, dict):
        return value
    fields = {name: without_empty(entry) for name, entry in value.items()}
    return {name: entry for name, entry in fields.items() if entry not in ("", [], None)}


_TEMPLATES.globals |= {
    **{"sentence": sentence, "people": _people, "media_type": media_type},
    **{"sha256": hashlib.sha256, "escape": html.escape},
}


CODECHECK, ZENODO = "codecheck.yml", ".zenodo.json"
MARK = "# Written by `replication export`, from replication.toml, paper.toml, CITATION.cff and the results of the run."
"""A file without this line belongs to a person, and is left as it is; JSON has no place for it."""


def register_texts(results: ResultsFile, software: Software) -> dict[str, str]:
    """Text by name of what lies at the root; of several papers, codecheck.yml is on the one that is to be checked."""
    texts = {ZENODO: to_json(filled("zenodo", results=results, software=software))}
    if (paper := checked(results)) is not None:
        body = msgspec.yaml.encode(codecheck(paper, results, software), order=None).decode()
        texts[CODECHECK] = f"---\n{MARK}\n{body}"
    return texts


def checked(results: ResultsFile) -> PaperRecord | None:
    """The paper of codecheck.yml: the only one, or the one that the settings name; None if that is open."""
    by_key = {paper.key: paper for paper in results.papers}
    if name := results.project.codecheck.paper:
        return by_key[one_of("paper of [codecheck]", name, by_key)]
    return results.papers[0] if len(by_key) == 1 else None


def codecheck(paper: PaperRecord, results: ResultsFile, software: Software) -> Json:
    """What has to be rebuilt for this paper, and what came out; files are relative to the root of the project."""
    check = results.project.codecheck
    claims = [claim for claim in results.claims if claim.paper == paper.key]
    published = " ".join(text for text in (paper.venue, str(paper.year or "")) if text) if paper.venue else ""
    figures = [record for record in results.figures if record.paper == paper.key and not record.error]
    fields = {"results": results, "software": software, "check": check, "claims": claims, "published": published}
    return filled("codecheck", paper=paper, figures=figures, **fields)


def unmet(content: Json) -> Iterator[str]:
    """The rules of the register that a configuration does not meet yet, each with where to fill in what is missing."""
    table = "in [codecheck] of replication.toml"
    missing = {
        "codechecker": f'CC-CFG-008: no codechecker; write codechecker = [{{name = "…", orcid = "…"}}] {table}',
        "report": f'CC-CFG-011: no report; write report = "https://doi.org/…", the address of the certificate, {table}',
        "certificate": f'CC-CFG-025: no certificate; write certificate = "YYYY-NNN", which the register gives, {table}',
    }
    yield from (text for name, text in missing.items() if name not in content)
    for person in content["paper"]["authors"]:
        if "ORCID" not in person:
            yield (
                f"CC-CFG-020: no ORCID of {person['name']}; write "
                f'{{name = "{person["name"]}", orcid = "…"}} among the authors in paper.toml'
            )
    if "reference" not in content["paper"]:
        yield "CC-CFG-021: no reference to the article; write doi, or venue and year, in paper.toml"
    elif not content["paper"]["reference"].startswith("https://"):
        yield "CC-CFG-027: the reference is no address, which the register asks for where there is one; write doi"
    for words in (content["paper"]["title"], *(person["name"] for person in content["paper"]["authors"])):
        if PLACEHOLDER.search(words):
            yield f"CC-CFG-023: {words!r} is of the template; write what it stands for in paper.toml"


def write_registers(results: ResultsFile, software: Software, root: Path) -> Iterator[str]:
    """Write what registers read at `root`, and say so; a file that a person wrote is kept."""
    for name, text in register_texts(results, software).items():
        path = root / name
        content = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else text
        if content != text and MARK not in content:
            yield f"{path}: kept as it is, which is not what this command writes; remove it to have it written"
        else:
            write_atomically(path, text.encode())
            yield str(path)
    texts = (software.title, software.abstract, *(person.full_name for person in software.authors))
    yield from (
        f"{ZENODO}: {words!r} is of the template; write CITATION.cff" for words in texts if PLACEHOLDER.search(words)
    )
    paper = checked(results)
    if paper is None:
        yield f'no {CODECHECK}: it is on one paper; write [codecheck] paper = "{results.papers[0].key}", say'
    else:
        yield from (f"{CODECHECK}: not yet {line}" for line in unmet(codecheck(paper, results, software)))

"""What other programs read of an audit: JSON by the templates in `json`, each of which says what it is of."""

import hashlib
import html
import json
import mimetypes
import re
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.inspect.headline import sentence
from replication.audit.people import plain_orcid
from replication.audit.store.records import PaperRecord
from replication.errors import AuditError
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

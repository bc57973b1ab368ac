"""How this package is cited: what CITATION.cff says, read once for every export."""

from __future__ import annotations

from pathlib import Path

import msgspec

from replication.errors import AuditError

CITATION = "CITATION.cff"


class Person(msgspec.Struct, frozen=True, kw_only=True, rename="kebab"):
    """An author: a person with family and given names, or a group with a name."""

    name: str = ""
    family_names: str = ""
    given_names: str = ""
    orcid: str = ""

    @property
    def full_name(self) -> str:
        """Given and family name, or the name of the group."""
        return self.name or f"{self.given_names} {self.family_names}".strip()


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

"""JSON-LD in the vocabulary of schema.org: papers, reviews of their claims, and the archive as an RO-Crate."""

from __future__ import annotations

import hashlib
import mimetypes
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.inspect.headline import sentence
from replication.audit.people import Reply, plain_orcid
from replication.audit.store.records import ClaimRecord, PaperRecord, ResultsFile
from replication.errors import AuditError

# Citation of this package, from CITATION.cff, read once for every export


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
    def sorted_name(self) -> str:
        """Family name, then given names, where they are told apart."""
        return ", ".join(part for part in (self.family_names, self.given_names) if part) or self.name

    @property
    def plain_orcid(self) -> str:
        """The ORCID without the address in front of it, which CITATION.cff asks for; ValueError if it is none."""
        return plain_orcid(self.orcid) if self.orcid else ""

    def linked(self) -> Json:
        """The author in the vocabulary of schema.org; a name that says so is that of a group."""
        kind = "Organization" if _GROUP.search(self.full_name) else "Person"
        address = f"https://orcid.org/{self.plain_orcid}" if self.orcid else ""
        return without_empty({"@type": kind, "@id": address, "name": self.full_name})


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


SCHEMA = "https://schema.org"
CRATE = "https://w3id.org/ro/crate/1.1"
MEDIA_TYPES = {".md": "text/markdown", ".j2": "text/plain", ".cff": "application/yaml", ".yml": "application/yaml"}


def claims_graph(results: ResultsFile, software: Software) -> Json:
    """The audit as schema.org: each paper an article, each claim a ClaimReview with its verdict in words."""
    replies: dict[str, list[Reply]] = {}
    for reply in (reply for paper in results.papers for reply in paper.replies):
        replies.setdefault(reply.claim, []).append(reply)
    return {
        "@context": SCHEMA,
        "@graph": [
            source_code(software),
            *map(article, results.papers),
            *(_review(claim, results.run.date, replies.get(claim.id, ())) for claim in results.claims),
        ],
    }


def summary_graph(results: ResultsFile) -> Json:
    """The audit in short, for the head of the report: the report as a data set about the papers, with its outcome."""
    return {
        "@context": SCHEMA,
        "@type": "Dataset",
        "name": "Replication report",
        "description": sentence(results.claims),
        "dateCreated": results.run.date,
        "version": results.run.package_version,
        "about": [article(paper) for paper in results.papers],
    }


def source_code(software: Software) -> Json:
    """This package as SoftwareSourceCode."""
    return without_empty(
        {
            "@id": "#software",
            "@type": "SoftwareSourceCode",
            "name": software.title,
            "description": software.abstract,
            "version": software.version,
            "license": f"https://spdx.org/licenses/{software.license}",
            "keywords": list(software.keywords),
            "codeRepository": software.repository_code,
            "programmingLanguage": "Python",
            "author": [person.linked() for person in software.authors],
        }
    )


def article(paper: PaperRecord) -> Json:
    """A source paper as ScholarlyArticle; what its text does not tell is left out."""
    return without_empty(
        {
            "@id": f"#paper-{paper.key}",
            "@type": "ScholarlyArticle",
            "name": paper.title,
            "author": [Person(name=name, orcid=paper.orcids.get(name, "")).linked() for name in paper.authors],
            "datePublished": str(paper.year or ""),
            "isPartOf": paper.venue,
            "sameAs": f"https://doi.org/{paper.doi}" if paper.doi else "",
        }
    )


def crate(results: ResultsFile, software: Software, files: Mapping[str, bytes]) -> Json:
    """The metadata of an RO-Crate 1.1 of `files`, by their names in it: each with its size, type and checksum."""
    run, parts = results.run, [_file(name, content) for name, content in sorted(files.items())]
    return {
        "@context": f"{CRATE}/context",
        "@graph": [
            {
                "@id": "ro-crate-metadata.json",
                "@type": "CreativeWork",
                "conformsTo": {"@id": CRATE},
                "about": {"@id": "./"},
            },
            {
                "@id": "./",
                "@type": "Dataset",
                "name": software.title,
                "description": sentence(results.claims),
                "datePublished": results.run.date,
                "license": {"@id": f"https://spdx.org/licenses/{software.license}"},
                "hasPart": [{"@id": part["@id"]} for part in parts],
                "citation": [{"@id": f"#paper-{paper.key}"} for paper in results.papers],
                "mainEntity": {"@id": "#software"},
            },
            {"@id": f"https://spdx.org/licenses/{software.license}", "@type": "CreativeWork", "name": software.license},
            source_code(software),
            *map(article, results.papers),
            {
                "@id": "#run",
                "@type": "CreateAction",
                "name": "python -m replication run",
                "endTime": run.date,
                "instrument": {"@id": "#software"},
                "result": [{"@id": "report/results.json"}, {"@id": "report/index.html"}],
                "description": f"Python {run.python}, {run.platform}, {run.cpu}, commit {run.commit}",
            },
            *parts,
        ],
    }


def _file(name: str, content: bytes) -> Json:
    return {
        "@id": name,
        "@type": "File",
        "contentSize": str(len(content)),
        "encodingFormat": media_type(Path(name)),
        "sha256": hashlib.sha256(content).hexdigest(),
    }


def media_type(path: Path) -> str:
    """The media type of a file by its name, the same on every machine."""
    known, _ = mimetypes.MimeTypes(filenames=()).guess_type(path.name)
    return MEDIA_TYPES.get(path.suffix) or known or "application/octet-stream"


def _review(claim: ClaimRecord, date: str, replies: Sequence[Reply]) -> Json:
    return without_empty(
        {
            "@id": f"#claim-{claim.id}",
            "@type": "ClaimReview",
            "claimReviewed": claim.claim.statement,
            "itemReviewed": {
                "@type": "Claim",
                "appearance": {"@id": f"#paper-{claim.paper}"},
                "position": claim.claim.place,
                "text": claim.claim.printed,
            },
            "reviewRating": {
                "@type": "Rating",
                "alternateName": str(claim.verdict),
                "ratingExplanation": claim.judgement.reason,
            },
            "datePublished": date,
            "author": {"@id": "#software"},
            "comment": [
                {"@type": "Comment", "text": reply.text, "author": reply.by, "dateCreated": reply.date}
                for reply in replies
            ],
        }
    )


def without_empty(fields: Json) -> Json:
    """The fields that say something, at any depth."""
    told = {name: _told(value) for name, value in fields.items()}
    return {name: value for name, value in told.items() if value not in ("", [], None)}


def _told(value: Any) -> Any:
    if isinstance(value, list):
        return [_told(entry) for entry in value]
    return without_empty(value) if isinstance(value, dict) else value

"""The folder of exports: badges and metadata of one results file, ready to be put beside a paper or a repository."""

from __future__ import annotations

import json
from pathlib import Path

from replication.audit.publish.badges import badge
from replication.audit.publish.linked_data import Json, claims_graph
from replication.audit.publish.metadata import bibtex, codecheck, rescience
from replication.audit.publish.software import Software, read_software
from replication.audit.store.records import ResultsFile
from replication.files import write_atomically


def export_texts(results: ResultsFile, software: Software) -> dict[str, str]:
    """Name and text of each exported file; the same results give the same texts."""
    texts = {
        "badges/all.svg": badge("replication", results.claims),
        "claims.jsonld": to_json(claims_graph(results, software)),
        "citation.bib": bibtex(results, software),
        "metadata.yaml": rescience(results, software),
    }
    for paper in results.papers:
        claims = [claim for claim in results.claims if claim.paper == paper.key]
        texts[f"badges/{paper.key}.svg"] = badge(paper.key, claims)
        texts[f"codecheck/{paper.key}/codecheck.yml"] = codecheck(paper, results, software)
    return dict(sorted(texts.items()))


def write_exports(results: ResultsFile, root: Path, directory: Path) -> tuple[Path, ...]:
    """Write every export of `results` below `directory`; returns the paths. root: of the project, for CITATION.cff."""
    paths = []
    for name, text in export_texts(results, read_software(root)).items():
        write_atomically(directory / name, text.encode())
        paths.append(directory / name)
    return tuple(paths)


def to_json(content: Json) -> str:
    """Indented JSON with the fields in their order and one newline at the end."""
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"

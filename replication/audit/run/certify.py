"""Making the certificates of the papers: wanted theorems in, verified files out."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.project import read_settings
from replication.audit.run.worker import Answer, Task, processes
from replication.audit.store.cache import Dependencies
from replication.audit.store.sources import default_packages
from replication.errors import one_of
from replication.files import write_atomically
from replication.verify.run import check, verify
from replication.verify.subjects import papers, theorems
from replication.verify.theorem import Refused


def certify(root: Path, names: Sequence[str], *, again: bool, jobs: int) -> Iterator[Answer]:
    """Make the certificates of the named papers or theorems (all if none is named), as they are finished.

    Answers are called PAPER/NAME; their error says why none was written, such as one that the verifier refuses. Those
    that are proved already are left alone unless `again`. Raises AuditError for an unknown name.
    """
    pairs = [(paper, name) for paper in papers(root) for name in theorems(paper, root)[0]]
    known = [*dict.fromkeys(paper for paper, _ in pairs), *(name for _, name in pairs)]
    selection = {one_of("paper or theorem", name, known) for name in names}
    chosen = [(paper, name) for paper, name in pairs if not selection or selection & {paper, name}]
    package, folders = read_settings(root).papers, {name: str(path) for name, path in default_packages(root).items()}
    tasks = []
    for paper, name in chosen:
        if again or verify(file_of(paper, name, root), root).theorem is None:
            basis = Dependencies(function=f"{package}.{paper}.certificates:make", inputs=json.dumps({"name": name}))
            tasks.append(Task(f"{paper}/{name}", basis, basis.inputs, folders))
    for answer in processes(tasks, jobs):
        if answer.text is not None:
            paper, name = answer.name.split("/")
            certificate = json.loads(answer.text)
            try:
                check(certificate, root, (paper, name))
                write_atomically(file_of(paper, name, root), to_json(certificate))
            except Refused as refusal:
                answer = msgspec.structs.replace(answer, error=f"the verifier refuses it: {refusal}")
        yield answer


def file_of(paper: str, name: str, root: Path) -> Path:
    """Where the certificate of a theorem lies."""
    return root / "certificates" / paper / f"{name}.json"


def to_json(certificate: Any) -> bytes:
    """The bytes of a certificate: its fields one by one, each entry of the witness and of the plant on a line."""
    lines = []
    for name, value in certificate.items():
        if isinstance(value, dict) and value:
            inner = ",\n".join(f"    {json.dumps(key)}: {json.dumps(entry)}" for key, entry in value.items())
            lines.append(f"  {json.dumps(name)}: {{\n{inner}\n  }}")
        else:
            lines.append(f"  {json.dumps(name)}: {json.dumps(value)}")
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()

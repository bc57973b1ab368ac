"""The evidence of all claims as one packed text, which the page unpacks and draws where a reader opens a claim."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from jinja2 import Environment

from replication.audit.report.claim import anchor
from replication.audit.report.templates import source
from replication.audit.store.records import CertificateRecord, ClaimRecord, ResultsFile
from replication.verify.subjects import subject

_SPACE = re.compile(r">\s+<")


def drawings(environment: Environment, shown: Mapping[str, Any]) -> dict[str, str]:
    """HTML by the id of the element that it belongs into: the evidence of each claim, the inputs of each experiment."""
    made = environment.get_template("evidence.html.j2").make_module(dict(shown))
    claims = {
        anchor("claim", view.record.id): str(made.evidence(view, paper))  # type: ignore[attr-defined]
        for paper in shown["papers"]
        for view in paper.claims
    }
    inputs = {
        anchor("experiment", record.name): str(made.inputs(record))  # type: ignore[attr-defined]
        for record in shown["results"].experiments
        if record.inputs or record.solvers
    }
    return {name: _SPACE.sub("> <", html).strip() for name, html in (claims | inputs).items()}


def packed(parts: Mapping[str, Any]) -> str:
    """`parts` as JSON, deflated, in base64: what no HTML parser can take for anything else."""
    return base64.b64encode(zlib.compress(json.dumps(parts, ensure_ascii=False).encode(), 9)).decode()


def unpacked(text: str) -> dict[str, str]:
    """What `packed` packed."""
    found: dict[str, str] = json.loads(zlib.decompress(base64.b64decode(text)))
    return found


# Proofs that the reader's browser checks: the certificates that `html/check.js` knows, and what each must be about.
#
# The page holds a certificate byte for byte, if it is the file that the run verified; beside it stands what the paper's
# own data say that it must be about, made here from `printed.toml` and `theorems.json`. Both are packed, as the
# evidence is; the script compares them, and checks the rest from the definitions, in exact fractions.


MOST_BYTES = 11_000
"""Of one certificate in the page, which is to stay light enough to be mailed; larger ones are files beside it."""
COUNTEREXAMPLE = "dualrate.counterexample"
_STATEMENT = re.compile(r'^    "((?:multirate|dualrate|delay)\.[a-z0-9-]+)"', re.MULTILINE)


def checkable() -> frozenset[str]:
    """The statements that the script has a check for, by its own table of them."""
    return frozenset(_STATEMENT.findall(source("check.js")))


def checks(results: ResultsFile, root: Path | None) -> dict[str, Any]:
    """`entries` by the path of a certificate: its text, what it must be about, printed numbers; and the `plants`.

    root: of the project; without one, or where it has not the files that the run verified, nothing can be checked.
    """
    entries: dict[str, Any] = {}
    plants: dict[str, Any] = {}
    known = checkable()
    for record in results.certificates:
        text = _verified(record, root) if root is not None and record.proved and record.statement in known else None
        if text is None or root is None:
            continue
        wanted = subject(record.paper, record.name, root)
        plant = f"{record.paper}/{wanted['plant']['name']}"
        plants[plant] = wanted["plant"]
        prints = _prints(record, results.claims)
        entries[record.path] = {"text": text, "wanted": {**wanted, "plant": plant}, "prints": prints}
    return {"entries": entries, "plants": plants}


def played(proofs: Mapping[str, Any]) -> dict[str, str]:
    """By paper, the scalar loop that a certificate proves to diverge, as data for the sliders of `html/play.js`."""
    found = {}
    for entry in proofs["entries"].values():
        plant = proofs["plants"][entry["wanted"]["plant"]]
        if entry["wanted"]["statement"] == COUNTEREXAMPLE and len(plant["A"]) == 1:
            loop = {name: plant[key][0][0] for name, key in zip("abcKL", "ABCKL", strict=True)}
            numbers = {
                key: float(Fraction(value)) for key, value in (loop | {"T": plant["T"], "M": plant["M"]}).items()
            }
            paper = entry["wanted"]["paper"]
            found[paper] = json.dumps({"name": f"play-{paper}"} | numbers)
    return found


def _verified(record: CertificateRecord, root: Path) -> str | None:
    """The text of a certificate, if its file is small enough, and the one that the run verified."""
    path = root / record.path
    content = path.read_bytes() if path.is_file() and path.stat().st_size <= MOST_BYTES else b""
    return content.decode() if hashlib.sha256(content).hexdigest() == record.sha256 else None


def _prints(record: CertificateRecord, claims: Sequence[ClaimRecord]) -> list[str]:
    """The numbers that the paper prints for what a theorem bounds; each once, however often it is repeated."""
    about = [term.of for term in record.says]
    found = [
        claim.claim.printed
        for claim in claims
        if record.path in claim.evidence.certificates
        and claim.claim.tolerance is None
        and claim.claim.kind == "value"
        and all(said.relation == "is" and said.to == claim.claim.printed for said in claim.claim.says)
        and any(said.of in about for said in claim.claim.says)
    ]
    return list(dict.fromkeys(found))

"""What registers read at the root of a project: `codecheck.yml` of CODECHECK, and `.zenodo.json` of Zenodo.

CODECHECK: the specification of the configuration file in version 2.0, and its published rules, by whose names `unmet`
says what is still to be filled in (https://codecheck.org.uk/spec/config/2.0/). Zenodo: the fields of a deposition
(https://developers.zenodo.org/#representation).
"""

from collections.abc import Iterator
from pathlib import Path

import msgspec

from replication.audit.people import PLACEHOLDER
from replication.audit.publish.linked_data import Json, Software, filled, to_json
from replication.audit.store.records import PaperRecord, ResultsFile
from replication.errors import one_of
from replication.files import write_atomically

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

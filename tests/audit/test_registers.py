"""What registers read: codecheck.yml by the published rules of CODECHECK 2.0, .zenodo.json by the fields of Zenodo.

The rules and the schema are restated here, from https://codecheck.org.uk/spec/config/2.0/, the list rules-2.0.yml of
the register beside it, and https://developers.zenodo.org/#representation; no text of theirs is copied.
"""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from msgspec.structs import replace

from replication.audit.parts import Codecheck, Named, Reply, plain_orcid
from replication.audit.project import Settings, read_settings
from replication.audit.publish.linked_data import Person, Software, codecheck, register_texts, unmet, write_registers
from replication.audit.store.records import PaperRecord, ResultsFile
from replication.errors import AuditError

CARBERRY = "0000-0002-1825-0097"
CHECK = Codecheck(
    codechecker=(Named(name="C. Checker", orcid=CARBERRY),),
    certificate="2026-001",
    report="https://doi.org/10.5281/zenodo.3674056",
    check_time="2026-11-24",
)
SOFTWARE = Software(
    title="Gosset, replicated",
    abstract="Sleep & its means.",
    version="1.2",
    license="MIT",
    authors=(Person(family_names="Author", given_names="A.", orcid=f"https://orcid.org/{CARBERRY}"),),
    keywords=("statistics",),
)

ORCID = {"type": "string", "pattern": r"^\d{4}-\d{4}-\d{4}-\d{3}[\dX]$"}
TEXT = {"type": "string", "minLength": 1}
OBJECT = {"type": "object", "additionalProperties": False}
PERSON = {**OBJECT, "properties": {"name": TEXT, "orcid": ORCID, "affiliation": TEXT}, "required": ["name"]}
RELATED = {**OBJECT, "properties": {"identifier": TEXT, "scheme": {"enum": ["doi", "url", "isbn"]}, "relation": {
    "enum": ["isSupplementTo", "references", "cites", "reviews", "isDerivedFrom", "documents"]}},
    "required": ["identifier", "relation"]}  # fmt: skip
ZENODO = {
    **OBJECT,
    "properties": {
        "title": TEXT, "description": TEXT, "version": TEXT, "license": TEXT, "notes": TEXT,
        "upload_type": {"enum": ["publication", "poster", "presentation", "dataset", "image", "video", "software",
                                 "lesson", "physicalobject", "other"]},
        "access_right": {"enum": ["open", "embargoed", "restricted", "closed"]},
        "language": {"type": "string", "pattern": "^[a-z]{2,3}$"},
        "creators": {"type": "array", "minItems": 1, "items": PERSON},
        "keywords": {"type": "array", "items": TEXT, "uniqueItems": True},
        "related_identifiers": {"type": "array", "items": RELATED},
    },
    "required": ["title", "description", "upload_type", "creators"],
    "if": {"properties": {"access_right": {"const": "open"}}}, "then": {"required": ["license"]},
}  # fmt: skip


def people(content: Any) -> list[Any]:
    return [*content["paper"]["authors"], *content["codechecker"]]


def words(content: Any) -> str:
    return json.dumps(content)


RULES: dict[str, Callable[[str, Any], bool]] = {
    "CC-CFG-002": lambda text, _: text.startswith("---\n"),
    "CC-CFG-004": lambda _, c: bool(c["manifest"]),
    "CC-CFG-005": lambda _, c: all(item["file"] for item in c["manifest"]),
    "CC-CFG-006": lambda _, c: not [f for f in c["manifest"] if f["file"].startswith("/") or ".." in f["file"]],
    "CC-CFG-007": lambda _, c: all(item["comment"] for item in c["manifest"]),
    "CC-CFG-008": lambda _, c: len(c["codechecker"]) > 0,
    "CC-CFG-009": lambda _, c: all(person["name"] for person in c["codechecker"]),
    "CC-CFG-010": lambda _, c: all("ORCID" in person for person in c["codechecker"]),
    "CC-CFG-011": lambda _, c: bool(c["report"]),
    "CC-CFG-012": lambda _, c: c["report"].startswith("https://"),
    "CC-CFG-014": lambda _, c: "version" in c,
    "CC-CFG-015": lambda _, c: c["version"] == "https://codecheck.org.uk/spec/config/2.0/",
    "CC-CFG-017": lambda _, c: bool(c["paper"]["title"]),
    "CC-CFG-018": lambda _, c: len(c["paper"]["authors"]) > 0,
    "CC-CFG-020": lambda _, c: all(re.fullmatch(ORCID["pattern"], a["ORCID"]) for a in c["paper"]["authors"]),
    "CC-CFG-021": lambda _, c: bool(c["paper"]["reference"]),
    "CC-CFG-022": lambda _, c: not c["paper"]["reference"].endswith(".pdf"),
    "CC-CFG-023": lambda _, c: not re.search("FIXME|TODO|XXXXX", words(c)),
    "CC-CFG-024": lambda _, c: bool(c["summary"]),
    "CC-CFG-026": lambda _, c: re.fullmatch(r"\d{4}-\d{3}", c["certificate"]) is not None,
    "CC-CFG-028": lambda _, c: c["paper"]["reference"].startswith("https://doi.org/"),
    "CC-MET-001": lambda _, c: all(plain_orcid(person["ORCID"]) for person in people(c)),
}
"""Each rule that can be decided from the file alone."""


@pytest.fixture(scope="module")
def results(made: ResultsFile) -> ResultsFile:
    """A run on one paper, whose authors have ORCIDs."""
    paper: PaperRecord = replace(made.papers[0], doi="10.1/x", orcids=dict.fromkeys(made.papers[0].authors, CARBERRY))
    return replace(made, papers=(paper,), project=Settings(title="Toy", codecheck=CHECK))


def test_codecheck_meets_each_rule(results: ResultsFile) -> None:
    text = register_texts(results, SOFTWARE)["codecheck.yml"]
    content = yaml.load(text, yaml.BaseLoader)
    assert [rule for rule, holds in RULES.items() if not holds(text, content)] == []
    assert not list(unmet(codecheck(results.papers[0], results, SOFTWARE)))


def test_its_files_are_those_of_its_paper_and_are_there(results: ResultsFile, tmp_path: Path) -> None:
    (paper,) = results.papers
    files = {entry["file"] for entry in codecheck(paper, results, SOFTWARE)["manifest"]}
    drawn = {f"figures/{f.name}.{end}" for f in results.figures if not f.error for end in ("svg", "csv")}
    assert files == {"report/results.json", *drawn} and drawn
    others = tuple(replace(figure, paper="other") for figure in results.figures)
    alone = codecheck(paper, replace(results, figures=others), SOFTWARE)
    assert [entry["file"] for entry in alone["manifest"]] == ["report/results.json"]


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        ({"codechecker": ()}, "CC-CFG-008"),
        ({"report": ""}, "CC-CFG-011"),
        ({"certificate": ""}, "CC-CFG-025"),
        ({"orcids": {}}, "CC-CFG-020"),
        ({"doi": "", "venue": "", "year": 1908}, "CC-CFG-021"),
        ({"doi": "", "venue": "Biometrika"}, "CC-CFG-027"),
        ({"title": "TITLE"}, "CC-CFG-023"),
    ],
)
def test_a_rule_that_is_not_met_is_named_with_what_to_do(
    results: ResultsFile, change: dict[str, Any], rule: str
) -> None:
    check, paper = results.project.codecheck, results.papers[0]
    if set(change) <= set(Codecheck.__struct_fields__):
        check = replace(check, **change)
    else:
        paper = replace(paper, **change)
    settings = replace(results.project, codecheck=check)
    found = list(unmet(codecheck(paper, replace(results, project=settings), SOFTWARE)))
    assert found and all(line.startswith(f"{rule}: ") and "write" in line for line in found)


def test_of_several_papers_the_settings_name_the_one(results: ResultsFile, tmp_path: Path) -> None:
    (paper,) = results.papers
    two = replace(results, papers=(paper, replace(paper, key="other")))
    assert "codecheck.yml" not in register_texts(two, SOFTWARE)
    assert list(write_registers(two, SOFTWARE, tmp_path))[-1].startswith("no codecheck.yml: it is on one paper")
    named = replace(CHECK, paper=paper.key)
    assert "codecheck.yml" in register_texts(replace(two, project=Settings(title="Toy", codecheck=named)), SOFTWARE)
    unknown = Settings(title="Toy", codecheck=replace(CHECK, paper="odd"))
    with pytest.raises(AuditError, match=r"unknown paper of \[codecheck\] 'odd'"):
        register_texts(replace(two, project=unknown), SOFTWARE)


def test_zenodo_reads_the_metadata(results: ResultsFile) -> None:
    content = json.loads(register_texts(results, SOFTWARE)[".zenodo.json"])
    jsonschema.validate(content, ZENODO)
    assert content["creators"] == [{"name": "Author, A.", "orcid": CARBERRY}]
    assert content["description"] == "Sleep &amp; its means."
    jsonschema.validate(json.loads((Path(__file__).parents[2] / ".zenodo.json").read_text(encoding="utf-8")), ZENODO)
    for broken in (
        {**content, "odd": 1},
        {**content, "creators": []},
        {k: content[k] for k in content if k != "license"},
    ):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(broken, ZENODO)


def test_what_a_person_wrote_is_kept(results: ResultsFile, tmp_path: Path) -> None:
    said = list(write_registers(results, SOFTWARE, tmp_path))
    assert said == [str(tmp_path / ".zenodo.json"), str(tmp_path / "codecheck.yml")]
    assert list(write_registers(results, SOFTWARE, tmp_path)) == said
    for name in (".zenodo.json", "codecheck.yml"):
        (tmp_path / name).write_text("mine", encoding="utf-8")
    assert all("kept as it is" in line for line in write_registers(results, SOFTWARE, tmp_path))
    assert {(tmp_path / name).read_text(encoding="utf-8") for name in (".zenodo.json", "codecheck.yml")} == {"mine"}


def test_an_orcid_with_a_wrong_digit_and_a_reply_without_a_text_or_date_are_none() -> None:
    for text in ("0000-0002-1825-0098", "0000-0002-1825", "1825-0097", "", "0000-0002-1825-00971"):
        with pytest.raises(ValueError, match="is none; copy it from"):
            plain_orcid(text)
    for known in (CARBERRY, "0000-0001-5109-3700", "0000-0002-1694-233X"):
        assert plain_orcid(known) == plain_orcid(f"https://orcid.org/{known}") == known
    for text, date, said in ((" ", "", "is empty"), ("No.", "24.11.2026", "year, month and day")):
        with pytest.raises(ValueError, match=said):
            Reply(claim="a", text=text, **({"date": date} if date else {}))


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ('certificate = "2026-1"', "is no number of the register"),
        ('report = "https://doi.org/10.5281/zenodo.FIXME"', "is a placeholder"),
        ('codechecker = [{name = " "}]', "a name is empty"),
        ('codechecker = [{name = "A", orcid = "0000-0002-1825-0098"}]', "is none; copy it from orcid.org"),
        ('codechecker = [{name = "A", orcid = "https://orcid.org/0000-0002-1825-0097"}]', "has an address in front"),
        ('checker = "A"', "unknown field `checker`"),
    ],
)
def test_a_mistake_in_the_table_is_told(tmp_path: Path, table: str, said: str) -> None:
    (tmp_path / "replication.toml").write_text(f"[codecheck]\n{table}\n", encoding="utf-8")
    with pytest.raises(AuditError, match=rf"(?s)replication.toml.*{re.escape(said)}"):
        read_settings(tmp_path)

"""Results of the schema before this one: compared with those of today, and refused by all that does not compare."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from cases import RECORDS_OF_EVERY_KIND as RECORDS
from cases import errata_of, results_file
from msgspec import to_builtins
from msgspec.structs import replace
from sample import paper_record

from replication.audit.inspect.compare import compare
from replication.audit.model import Proof
from replication.audit.store.records import SCHEMA_VERSION, read_results
from replication.errors import AuditError

FILE = replace(results_file(*RECORDS), papers=(replace(paper_record(()), readings=(), coverage=()),))


def flat(record: dict[str, Any]) -> dict[str, Any]:
    """A claim as schema 2 stored it: one flat record."""
    claim, evidence, judgement = record["claim"], dict(record["evidence"]), dict(record["judgement"])
    printed, computed = evidence.pop("as_printed"), evidence.pop("value")
    del evidence["draws"], evidence["outcomes"], evidence["over_inputs"]
    known_later = ("expected", "uses", "reading", "optimum", "repeats")
    kept = ("value", "lower", "upper", "holds", "margin", "threshold", "threshold_reason", "probability")
    del judgement["intervals"]
    return {
        **{name: value for name, value in claim.items() if name not in known_later},
        **evidence,
        **judgement,
        "paper": claim["id"].partition(".")[0],
        "computed": computed,
        "as_printed": printed and {name: printed[name] for name in kept},
        "expected_verdict": claim["expected"],
        "experiments": claim["uses"],
    }


def older() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(json.dumps(to_builtins(FILE)))
    content["schema_version"] = 2
    content["claims"] = [flat(record) for record in content["claims"]]
    for paper in content["papers"]:
        paper["formulas"] = [[formula["text"], formula["latex"]] for formula in paper["formulas"]]
        # These came later in that schema, and may be absent.
        del paper["notebook"], paper["sensitivity"], paper["common"], paper["readings"], paper["coverage"]
    return content


def written(content: Any, folder: Path) -> Path:
    path = folder / "results.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def test_the_same_results_in_the_older_schema_have_no_change(tmp_path: Path) -> None:
    read = read_results(written(older(), tmp_path), also_older=True)
    assert read.schema_version == SCHEMA_VERSION
    assert read.papers == FILE.papers
    assert compare(read, FILE) == []


def test_a_number_that_moved_since_is_found(tmp_path: Path) -> None:
    content = older()
    content["claims"][0]["computed"] += 1e-9
    content["claims"][2]["as_printed"]["value"] = [[1.0, 2.0], [3.0, 6.0]]
    changes = compare(read_results(written(content, tmp_path), also_older=True), FILE)
    assert [(change.claim, [field.field for field in change.fields]) for change in changes] == [
        ("toy.matrix", ["as_printed"]),
        ("toy.value", ["value"]),
    ]


@pytest.mark.parametrize(
    ("kind", "probability", "inference", "old", "new"),
    [
        ("order", None, False, "differs", "refuted"),
        ("feasible", None, False, "differs", "refuted"),
        ("statistical", None, False, "differs", "refuted"),
        ("statistical", 0.001, False, "differs", "differs"),
        ("statistical", 0.5, False, "consistent", "compatible"),
        ("statistical", None, False, "consistent", "consistent"),
        ("value", None, False, "differs", "differs"),
        ("cited", None, False, "not checkable", "undetermined"),
        ("value", None, False, "reproduced after erratum", "reproduced after erratum"),
        ("value", None, True, "reproduced after erratum", "compatible"),
        ("statistical", 0.5, False, "reproduced after erratum", "compatible"),
        ("value", None, False, "reproduced", "reproduced"),
    ],
)
def test_verdicts_of_the_older_schema_follow_the_present_rules(
    kind: str, probability: float | None, inference: bool, old: str, new: str, tmp_path: Path
) -> None:
    content = older()
    content["claims"] = [flat(to_builtins(RECORDS[2]))]
    content["claims"][0] |= {"kind": kind, "probability": probability, "verdict": old, "expected_verdict": old}
    proof = Proof(holds=True, text="")
    content["errata"] = [to_builtins(replace(errata_of(RECORDS[2], proof)["toy.e1"], inference=inference))]
    (record,) = read_results(written(content, tmp_path), also_older=True).claims
    assert (record.verdict, record.claim.expected) == (new, new)


def without(content: dict[str, Any], *path: str | int) -> dict[str, Any]:
    place: Any = content
    for step in path[:-1]:
        place = place[step]
    del place[path[-1]]
    return content


@pytest.mark.parametrize(
    "spoil",
    [
        lambda content: without(content, "claims"),
        lambda content: without(content, "claims", 0, "computed"),
        lambda content: without(content, "claims", 0, "seconds"),
        lambda content: without(content, "run", "cpu"),
        lambda content: content | {"claims": 3},
        lambda content: content | {"claims": ["x"]},
        lambda content: content | {"papers": [{"formulas": [["a"]]}]},
    ],
)
def test_a_damaged_older_file_is_refused(spoil: Callable[[dict[str, Any]], Any], tmp_path: Path) -> None:
    path = written(spoil(older()), tmp_path)
    with pytest.raises(AuditError, match="is not a results file"):
        read_results(path, also_older=True)


def test_only_a_comparison_reads_the_older_schema(tmp_path: Path) -> None:
    path = written(older(), tmp_path)
    with pytest.raises(AuditError, match=f"has schema version 2, and this program reads {SCHEMA_VERSION};"):
        read_results(path)


@pytest.mark.parametrize("also_older", [False, True])
@pytest.mark.parametrize("version", [-1, 0, 1, SCHEMA_VERSION + 1, 99])
def test_any_other_schema_is_refused(version: int, also_older: bool, tmp_path: Path) -> None:
    for content in (to_builtins(FILE), older(), {}):
        path = written({**content, "schema_version": version}, tmp_path)
        with pytest.raises(AuditError, match=f"has schema version {version}, .*make it again with"):
            read_results(path, also_older=also_older)

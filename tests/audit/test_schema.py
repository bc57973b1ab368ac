"""results.json: the published schema is the derived one, an independent reader accepts a run, and damage is refused."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import msgspec
import pytest
from cases import PROOF, errata_of, results_file
from cases import RECORDS_OF_EVERY_KIND as RECORDS
from lab import make_lab

from benchmarks.readme import schema_text
from replication.audit.inspect.check import check
from replication.audit.model import Verdict
from replication.audit.store.records import (
    SCHEMA_VERSION,
    ResultsFile,
    read_results,
    to_json,
    write_results,
)
from replication.errors import AuditError

PUBLISHED = Path(__file__).parents[2] / "docs" / "results.schema.json"
WRONG = [["x"]]
"""A value that no field accepts."""

FILE = results_file(*RECORDS, errata=tuple(errata_of(RECORDS[2], PROOF).values()))
Location = tuple[str | int, ...]


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    schema = json.loads(PUBLISHED.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def leaves(value: Any, path: Location = ()) -> Iterator[Location]:
    """Paths of all numbers, words and nulls, except in the inputs of experiments, which may be anything."""
    if isinstance(value, dict):
        for key, entry in value.items():
            if key != "inputs":
                yield from leaves(entry, (*path, key))
    elif isinstance(value, list):
        for index, entry in enumerate(value):
            yield from leaves(entry, (*path, index))
    else:
        yield path


def damaged(path: Location, *, remove: bool) -> Any:
    content = json.loads(to_json(FILE))
    place = content
    for key in path[:-1]:
        place = place[key]
    if remove:
        del place[path[-1]]
    else:
        place[path[-1]] = WRONG
    return content


def last_name(path: Location) -> str:
    """The innermost field of a record on the path: msgspec shows keys of dictionaries and indices as `...`."""
    names = [key for key in path if isinstance(key, str)]
    free = [index for index, key in enumerate(names) if key in ("quantities", "packages", "options", "residuals")]
    return names[free[0]] if free else names[-1]


def test_published_schema_is_the_derived_one() -> None:
    assert PUBLISHED.read_text(encoding="utf-8") == schema_text(), "write it anew with `make readme`"


def test_a_run_is_accepted_by_an_independent_reader(tmp_path: Path, validator: jsonschema.Draft202012Validator) -> None:
    results = msgspec.convert(make_lab(tmp_path).audit()["file"], ResultsFile)
    assert {claim.verdict for claim in results.claims} >= {Verdict.REPRODUCED}
    validator.validate(json.loads(to_json(results)))


def test_file_survives_writing_and_reading(tmp_path: Path, validator: jsonschema.Draft202012Validator) -> None:
    path = tmp_path / "results.json"
    write_results(path, FILE)
    assert read_results(path) == FILE
    assert to_json(read_results(path)) == path.read_bytes()
    validator.validate(json.loads(path.read_bytes()))
    assert {problem.cause for problem in check(read_results(path), None)} == {"changed verdict"}


def refusal(content: Any, file: Path) -> str:
    file.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(AuditError) as caught:
        read_results(file)
    return str(caught.value)


def test_a_damaged_field_is_refused_with_its_path(tmp_path: Path, validator: jsonschema.Draft202012Validator) -> None:
    file, paths = tmp_path / "results.json", list(leaves(json.loads(to_json(FILE))))
    assert len(paths) > 100
    for path in paths:
        content = damaged(path, remove=False)
        assert not validator.is_valid(content), path
        said = refusal(content, file)
        assert str(file) in said and last_name(path) in said


@pytest.mark.parametrize(
    "where",
    [
        (),
        ("run",),
        ("claims", 0),
        ("claims", 0, "claim"),
        ("claims", 0, "evidence"),
        ("claims", 0, "judgement"),
        ("claims", 0, "evidence", "solvers", 0),
        ("claims", 2, "evidence", "as_printed"),
        ("errata", 0),
        ("experiments", 0),
    ],
)
def test_every_field_is_required_and_no_other_is_known(
    where: Location, tmp_path: Path, validator: jsonschema.Draft202012Validator
) -> None:
    place = json.loads(to_json(FILE))
    for key in where:
        place = place[key]
    for field in place:
        content = damaged((*where, field), remove=True)
        assert not validator.is_valid(content)
        assert f"`{field}`" in refusal(content, tmp_path / "results.json")
    assert "trusted" in refusal(damaged((*where, "trusted"), remove=False), tmp_path / "results.json")


def test_what_is_no_json_or_of_any_other_schema_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "results.json"
    with pytest.raises(AuditError, match="does not exist"):
        read_results(file)
    for text in (b"", b"{", b"\xff"):
        file.write_bytes(text)
        with pytest.raises(AuditError, match="not a results file"):
            read_results(file)
    for version in (-1, 0, 2, SCHEMA_VERSION + 1):
        for content in ({**json.loads(to_json(FILE)), "schema_version": version}, {"schema_version": version}):
            said = refusal(content, file)
            assert f"has schema version {version}, " in said and "make it again with" in said

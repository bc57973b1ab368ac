"""Claims that the file of printed data declares: what they answer, and which mistakes are told."""

from pathlib import Path

import pytest

from replication.audit.declare import Part
from replication.audit.model import Kind, Verdict
from replication.audit.numbers import numbers
from replication.audit.run.assemble import Available
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError

FILE = """
[rate]
place = "Sec. 1, the rate"
value = {{ slow = "0.25", fast = "1.50" }}
[rate.claim]
statement = "The {{key}} rate."
result = "model.rates.{{key}}"
method = "By the model."
check = "closed.{{key}}.0"
{more}
[size]
place = "Table 2"
value = "{printed}"
[size.claim]
statement = "The size."
result = "model.size"
method = "By the model."
"""
RESULTS = {
    "model": {"rates": {"slow": 0.25, "fast": 1.5}, "size": [1.0, 2.5]},
    "closed": {"slow": [0.2501], "fast": [1.5]},
}


def written(tmp_path: Path, printed: str = "(1.0, 2.5)", more: str = "") -> Path:
    path = tmp_path / "printed.toml"
    path.write_text(FILE.format(printed=printed, more=more), encoding="utf-8")
    return path


def test_each_entry_is_a_claim_of_the_part_that_its_place_begins_with(tmp_path: Path) -> None:
    rates, size = numbers(written(tmp_path))
    assert (rates.title, size.title) == ("Sec. 1", "Table 2")
    assert [claim.id for claim in rates.claims] == ["rate.slow", "rate.fast"]
    slow = rates.claims[0]
    assert (slow.statement, slow.printed, slow.place) == ("The slow rate.", "0.25", "Sec. 1, the rate")
    assert slow.kind is Kind.VALUE and slow.uses == ("model", "closed") and slow.expected is Verdict.REPRODUCED
    evidence = slow.answer(RESULTS)
    assert evidence.value == 0.25 and "0.2501" in evidence.cross_check


def test_points_in_capitals_have_ids_in_lower_case(tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_text(path.read_text(encoding="utf-8").replace("slow = ", "P = "), encoding="utf-8")
    claim = numbers(path)[0].claims[0]
    assert (claim.id, claim.statement) == ("rate.p", "The P rate.")
    points = {"model": {"rates": {"P": 0.25}}, "closed": {"P": [0.2501]}}
    assert claim.answer(points).value == 0.25


@pytest.mark.parametrize(("printed", "kind"), [("(1.0, 2.5)", Kind.MATRIX), (">1", Kind.BOUND), ("1.0", Kind.VALUE)])
def test_the_kind_follows_from_the_print(tmp_path: Path, printed: str, kind: Kind) -> None:
    assert numbers(written(tmp_path, printed))[1].claims[0].kind is kind


def test_a_list_is_answered_in_its_layout(tmp_path: Path) -> None:
    assert numbers(written(tmp_path))[1].claims[0].answer(RESULTS).value == (1.0, 2.5)


def test_what_is_meant_pins_its_verdict(tmp_path: Path) -> None:
    claim = numbers(written(tmp_path, more='erratum = "digits"\nmeant = "0.26"'))[0].claims[0]
    assert (claim.erratum, claim.meant, claim.expected) == ("digits", "0.26", Verdict.REPRODUCED_AFTER_ERRATUM)


def test_two_methods_that_differ_in_print_are_an_error(tmp_path: Path) -> None:
    claim = numbers(written(tmp_path))[0].claims[0]
    with pytest.raises(AuditError, match=r"\[rate.claim\].*0.25 and closed.slow.0 is 0.26, more than half"):
        claim.answer({**RESULTS, "closed": {"slow": [0.26]}})


@pytest.mark.parametrize(
    ("results", "said"),
    [
        ({"model": {"rates": {"quick": 1.0}}}, "in model.rates there is quick"),
        ({"model": {"rates": {"slow": "much"}}}, "'much', which is no number"),
        ({"model": {"rates": {"slow": True}}}, "True, which is no number"),
        ({"model": 3.0}, "in model there is only 3.0"),
    ],
)
def test_a_way_that_ends_is_told_with_what_is_there(tmp_path: Path, results: dict[str, object], said: str) -> None:
    with pytest.raises(AuditError, match=said):
        numbers(written(tmp_path))[0].claims[0].answer(results)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("colour = 1", "unknown field `colour`"),
        ("chekc = 'a'", "unknown field `chekc`; did you mean check"),
        ("meant = 3", "Expected a string, or a table by entry, got `int`"),
    ],
)
def test_a_field_that_does_not_do_names_file_and_entry(tmp_path: Path, more: str, said: str) -> None:
    with pytest.raises(AuditError, match=rf"printed.toml:5: \[rate.claim\]: .*{said}"):
        numbers(written(tmp_path, more=more))


def test_the_result_is_no_second_method_for_itself(tmp_path: Path) -> None:
    path = written(tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("closed.{key}.0", "model.rates.{key}"), encoding="utf-8")
    with pytest.raises(AuditError, match=r"\[rate.claim\]: check is 'model.rates.slow', the result itself; .*or leave"):
        numbers(path)


def test_code_is_the_line_of_the_declaration(tmp_path: Path) -> None:
    path = written(tmp_path, more='[other]\nplace = "Sec. 2"\nvalue = "1"')
    tree = SourceTree({"papers": tmp_path})
    parts = numbers(path)
    assert [tree.location(claim.answer) for part in parts for claim in part.claims] == [
        "papers/printed.toml:5",
        "papers/printed.toml:5",
        "papers/printed.toml:16",
    ]
    here = Part("Sec. 1", reading="none")
    here.cited("time", "3", place="Sec. 1", statement="Seconds.", reason="Of that computer.")
    assert path.read_text(encoding="utf-8").splitlines()[15] == "[size.claim]"
    found = SourceTree({"tests": Path(__file__).parent}).location(here.claims[0].answer)
    line = int(found.removeprefix("tests/test_numbers.py:"))
    assert "here.cited" in Path(__file__).read_text(encoding="utf-8").splitlines()[line - 1]


def test_an_experiment_that_failed_is_told_as_that_and_counts_as_used(tmp_path: Path) -> None:
    results = Available({"closed": RESULTS["closed"]}, {"model": "experiment model failed: ValueError"})
    with pytest.raises(AuditError, match=r"^experiment model failed: ValueError$"):
        numbers(written(tmp_path))[0].claims[0].answer(results)
    assert results.read == {"model"}


def test_an_experiment_that_is_asked_for_by_a_wrong_name_is_told_with_those_there_are() -> None:
    with pytest.raises(AuditError, match=r"experiment modle is not among those it says it uses; did you mean model\?"):
        Available({"model": 1.0}, {"closed": "failed"})["modle"]


def test_what_holds_for_one_entry_of_a_table_stands_in_a_table(tmp_path: Path) -> None:
    more = 'erratum = { fast = "digits" }\nmeant = { fast = "1.60" }\nreading = { slow = "slowly" }'
    slow, fast = numbers(written(tmp_path, more=more))[0].claims
    assert (slow.erratum, slow.meant, slow.reading, slow.expected) == (None, "", "slowly", Verdict.REPRODUCED)
    assert (fast.erratum, fast.meant, fast.reading) == ("digits", "1.60", "none")
    assert fast.expected is Verdict.REPRODUCED_AFTER_ERRATUM
    pinned = numbers(written(tmp_path, more='pinned = { fast = "differs" }'))[0].claims
    assert [claim.expected for claim in pinned] == [Verdict.REPRODUCED, Verdict.DIFFERS]


@pytest.mark.parametrize("field", ["erratum", "meant", "reading", "pinned"])
def test_an_entry_that_is_not_there_is_told_with_its_line(tmp_path: Path, field: str) -> None:
    path = written(tmp_path, more=f'{field} = {{ fats = "x" }}')
    with pytest.raises(
        AuditError, match=rf"printed\.toml:5: \[rate\.claim\]: {field} speaks of the entry 'fats'; did you mean fast"
    ):
        numbers(path)

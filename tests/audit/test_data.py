"""Printed data and paper.toml: strings with place and unit, every slip refused; numbers only typed are told."""

import pickle
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from tables import rows

from replication.audit.data import PrintedValue, read_printed
from replication.audit.judge.numerals import require_found
from replication.audit.project import about
from replication.errors import AuditError

GOOD = """
[period]
place = "Sec. V"
unit = "s"
note = "the scan shows it blurred"
value = "0.20"

[level]
place = "Table 1, column ({key})"
value = { "2,1" = "1.14", count = 3, all = ["1", "2"] }
"""


def read(tmp_path: Path, text: str | bytes) -> Any:
    path = tmp_path / "printed.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_printed(path)


def test_a_value_is_its_string_with_place_and_unit(tmp_path: Path) -> None:
    data = read(tmp_path, GOOD)
    assert data["period"] == "0.20" and isinstance(data["period"], PrintedValue)
    assert (data["period"].place, data["period"].unit) == ("Sec. V", "s")
    level = data["level"]
    assert level == {"2,1": "1.14", "count": 3, "all": ["1", "2"]}
    assert (level["2,1"].place, level["2,1"].unit) == ("Table 1, column (2,1)", "")
    assert [entry.place for entry in level["all"]] == ["Table 1, column (all, 1)", "Table 1, column (all, 2)"]
    assert read_printed(str(tmp_path / "printed.py"))["period"] == "0.20", "the module beside it names it"
    copy = pickle.loads(pickle.dumps(data["period"]))
    assert (copy, copy.place, copy.unit) == ("0.20", "Sec. V", "s"), "also in another process"


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(AuditError, match=r"printed.toml cannot be read: No such file"):
        read_printed(tmp_path / "printed.toml")
    with pytest.raises(AuditError, match=r"paper\.toml cannot be read"):
        about(str(tmp_path / "paper.py"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *rows("no data"),
        (b"[a]\nplace = '\xff'\nvalue = '1'", "is not valid TOML"),
        (f'[a]\nplace = "x"\nvalue = {"9" * 5000}', "is not valid TOML"),
    ],
)
def test_what_is_no_printed_data_is_refused_by_file_and_entry(tmp_path: Path, text: str | bytes, message: str) -> None:
    with pytest.raises(AuditError, match=message) as caught:
        read(tmp_path, text)
    assert str(tmp_path / "printed.toml") in str(caught.value)


def test_a_name_that_is_not_there_is_told_with_the_one_that_is_meant(tmp_path: Path) -> None:
    data = read(tmp_path, '[energy]\nplace = "x"\nvalue = { water = "1" }')
    with pytest.raises(AuditError, match=r"printed.toml has no 'enrgy' there; did you mean energy\?"):
        data["enrgy"]
    with pytest.raises(AuditError, match=r"has no 'acid' there; there is: water"):
        data["energy"]["acid"]
    assert "enrgy" not in data and data.get("enrgy") is None


# paper.toml: what it gives, and that each mistake names the file, the line and what to do


GIVEN = 'title = "A note"\nauthors = ["A. Author", "B. Author"]\nsummary = "Of two numbers."\n'
COVERAGE = '[paper]\nruns = 1\n[[paper.places]]\nplace = "Sec. 1"\nnumerals = [["1", "excused:label"]]\n'


def written(tmp_path: Path, text: str) -> str:
    package = tmp_path / "papers" / "note"
    package.mkdir(parents=True)
    (package / "paper.toml").write_text(text, encoding="utf-8")
    (package / "coverage.toml").write_text(COVERAGE, encoding="utf-8")
    return str(package / "paper.py")


def test_key_coverage_and_bibtex_follow_from_the_rest(tmp_path: Path) -> None:
    found = about(written(tmp_path, GIVEN + "year = 2031\n"))
    assert (found["key"], found["year"], found["venue"], found["authors"]) == (
        "note",
        2031,
        "",
        ("A. Author", "B. Author"),
    )
    assert [(tally.text, tally.total, tally.aside) for tally in found["coverage"] if tally.of == "numerals"] == [
        ("paper", 0, 1)
    ]
    assert found["bibtex"] == (
        "@misc{note,\n  author = {A. Author and B. Author},\n  title = {A note},\n  year = {2031}\n}"
    )
    entry = "@article{note, title = {A {N}ote}}"
    kept = about(written(tmp_path / "again", GIVEN + f"bibtex = '{entry}'\n"))
    assert kept["bibtex"] == entry and kept["year"] is None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", r"paper\.toml:1: title is missing"),
        (GIVEN.replace('"A note"', '" "'), r"paper\.toml:1: title is missing or empty"),
        (GIVEN.replace('["A. Author", "B. Author"]', "[]"), r"paper\.toml:2: authors is missing or empty"),
        (GIVEN + "\njear = 2031\n", r"paper\.toml:5: jear: unknown field 'jear'; did you mean year\?"),
        (GIVEN + 'year = "2031"\n', r"paper\.toml:4: year: Expected `int \| null`, got `str`.*; correct it"),
        (GIVEN.replace('["A. Author", "B. Author"]', '"A. Author"'), r"paper\.toml:2: authors: Expected `array`"),
        ("title = ", r"paper\.toml is not valid TOML"),
    ],
)
def test_a_mistake_names_file_line_and_cure(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(AuditError, match=told):
        about(written(tmp_path, text))


RESULTS = {"model": {"rate": 1.0, "mean": 12.345, "all": [1.5, 2.5, 4.5], "n": 1005, "rows": [0.0] * 240, "on": True}}
Ask = Callable[[Any], Sequence[str]]


@pytest.mark.parametrize(
    "ask",
    [
        lambda given: [f"The mean is {given['model']['mean']:.1f} hours."],
        lambda given: [f"Together {sum(given['model']['all']):.2f}, at most {max(given['model']['all']):.3f}."],
        lambda given: [f"Stable up to {given['model']['n'] - 1}, of {given['model']['n']:,}."],
        lambda given: ["One of 240 draws, the last 239 of them."],
        lambda given: ["Printed as 0.75, at 1.2 s, in Theorem 3 with 24 cases."],
        lambda given: ["It rises 12-fold."],
        lambda given: [f"{'More' if given['model']['mean'] > 1 else 'Less'} than 24."],
    ],
)  # fmt: skip
def test_a_number_of_results_or_prints_may_stand(ask: Ask) -> None:
    require_found("finding", ask, RESULTS, ["0.75", "(1.2, 3.4)"])


@pytest.mark.parametrize(
    ("ask", "number"),
    [
        (lambda given: ["The mean is 99.9 hours."], "99.9"),
        (lambda given: [f"The mean is {given['model']['mean']:.1f}, not 12.4 hours."], "12.4"),
        (lambda given: ["Of 7,635,996 settings none does."], "7,635,996"),
        (lambda given: ["It is .75 of that.", f"Mean {given['model']['mean']:.1f}."], ".75"),
        (lambda given: ["Patients: 242."], "242"),
        (lambda given: [f"From {given['model']['rate']:g} on, the mean is 99.9 hours."], "99.9"),
    ],
)
def test_a_number_that_is_typed_is_told(ask: Ask, number: str) -> None:
    with pytest.raises(AuditError, match=rf"^the finding '.*' says {number}, which the paper does not print"):
        require_found("finding", ask, RESULTS, ["0.74", "(1.2, 3.4)"])


def test_what_fails_on_moved_numbers_decides_nothing() -> None:
    def ask(given: Any) -> list[str]:
        if given != RESULTS:
            raise ValueError
        return ["The mean is 99.9 hours."]

    require_found("finding", ask, RESULTS, [])

"""paper.toml: what it gives, and that each mistake names the file, the line and what to do."""

from pathlib import Path

import pytest

from replication.audit.project import about
from replication.errors import AuditError

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


def test_bibtex_that_is_given_is_kept(tmp_path: Path) -> None:
    entry = "@article{note, title = {A {N}ote}}"
    found = about(written(tmp_path, GIVEN + f"bibtex = '{entry}'\n"))
    assert found["bibtex"] == entry and found["year"] is None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", r"paper\.toml:1: title is missing"),
        (GIVEN.replace('"A note"', '" "'), r"paper\.toml:1: title is missing or empty"),
        (GIVEN.replace('["A. Author", "B. Author"]', "[]"), r"paper\.toml:2: authors is missing or empty"),
        (GIVEN + "\njear = 2031\n", r"paper\.toml:5: jear is no field; did you mean year\?"),
        (GIVEN + 'year = "2031"\n', r"paper\.toml:4: year: Expected `int \| null`, got `str`.*; correct it"),
        (GIVEN.replace('["A. Author", "B. Author"]', '"A. Author"'), r"paper\.toml:2: authors: Expected `array`"),
        ("title = ", r"paper\.toml is not valid TOML"),
    ],
)
def test_a_mistake_names_file_line_and_cure(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(AuditError, match=told):
        about(written(tmp_path, text))


def test_without_the_file_the_error_says_which(tmp_path: Path) -> None:
    with pytest.raises(AuditError, match=r"paper\.toml cannot be read"):
        about(str(tmp_path / "paper.py"))

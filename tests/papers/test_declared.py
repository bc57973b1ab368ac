"""What the texts hold and what papers declare: nothing is lost, next to nothing is open, and a change is noticed."""

import importlib
import pkgutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import papers
from replication.audit.declare import Part
from replication.audit.inspect.coverage import faults
from replication.audit.judge.validate import validate_claims
from replication.cli import main

FOLDER = Path(papers.__file__).parent
LEAST_BOUND = 0.95
"""The share of the numerals of all texts that are bound to something."""


@pytest.mark.parametrize("key", papers.KEYS)
def test_every_binding_exists_and_holds_its_numerals(key: str) -> None:
    (paper,) = papers.load([key])
    assert faults(FOLDER / key, paper) == []
    assert paper.coverage


def test_everything_is_bound_or_excused_and_most_is_bound() -> None:
    counts = [tally for paper in papers.load() for tally in paper.coverage]
    assert sum(tally.open for tally in counts) == 0
    numerals = [tally for tally in counts if tally.of == "numerals"]
    assert sum(tally.bound for tally in numerals) >= LEAST_BOUND * sum(tally.total for tally in numerals)


def test_the_command_counts_and_compares_a_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["coverage", "shao"]) == 0
    counts = capsys.readouterr().out
    assert "shao, paper: " in counts and " items: " in counts and "  " in counts
    assert main(["coverage", "--open"]) == 0
    assert capsys.readouterr().out == ""

    text = tmp_path / "text.txt"
    text.write_text("12345.6 of it", encoding="utf-8")
    assert main(["coverage", "--text", str(text), "--paper", "okajima2023/blog"]) == 1
    assert "12345.6: 1 in the text, 0 in the list" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--text", "x"], "give both or neither"),
        (["--paper", "shao"], "give both or neither"),
        (["--text", "x", "--paper", "shoa"], "did you mean shao"),
        (["--text", "x", "--paper", "shao/blog"], "unknown text of the list 'blog'"),
        (["--text", "/none.txt", "--paper", "shao"], "/none.txt"),
    ],
)
def test_bad_usage_is_told(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["coverage", *arguments]) == 2
    assert words in capsys.readouterr().err


def parts(key: str) -> Iterator[Part]:
    """The parts that are names of some module of a paper."""
    package = importlib.import_module(f"papers.{key}")
    for found in pkgutil.walk_packages(package.__path__, f"papers.{key}."):
        yield from (value for value in vars(importlib.import_module(found.name)).values() if isinstance(value, Part))


@pytest.mark.parametrize("key", papers.KEYS)
def test_a_paper_is_well_formed_and_every_part_is_in_its_scope(key: str) -> None:
    (paper,) = papers.load([key])
    validate_claims([paper])
    scope = {item.part: item for item in paper.scope}
    for part in parts(key):
        assert {f"{key}.{claim.id}" for claim in part.claims} <= set(scope[part.title].claims), part.title

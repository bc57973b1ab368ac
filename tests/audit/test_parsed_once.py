"""A printed value is read once in a build of the report, and what it stands for comes from the judgement."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from cases import altered
from msgspec.structs import replace
from sample import results

from replication.audit.inspect.controls import moved
from replication.audit.judge import agreement, printed
from replication.audit.judge.printed import Printed
from replication.audit.parts import Sensitivity
from replication.audit.report.page import build_report
from replication.audit.report.sections.lineage import rooms
from replication.audit.store.records import ResultsFile


@pytest.fixture
def file(tmp_path: Path) -> ResultsFile:
    """The sample, with a claim whose parameters were moved: all sections of the report have something to show."""
    made = results(tmp_path)
    claim = made.claims[0]
    move = Sensitivity(claim=claim.id, parameter="p", printed="0.5", base=1.33, low=1.32, high=1.34)
    return replace(made, papers=(replace(made.papers[0], sensitivity=(move,)),))


@pytest.fixture
def parsed(monkeypatch: pytest.MonkeyPatch) -> Iterator[Counter[str]]:
    """How often each printed value is read from now on, wherever `parse` is called."""
    count: Counter[str] = Counter()
    original = printed.parse

    def counted(text: str) -> Printed:
        count[text] += 1
        return original(text)

    for module in (printed, agreement):
        monkeypatch.setattr(module, "parse", counted)
    yield count
    count.clear()


def reads(file: ResultsFile) -> Counter[str]:
    """What a build may read: the print of each claim, and each print that a negative control puts in its place."""
    claims = [record.claim.printed for record in file.claims if record.claim.printed]
    return Counter(claims)


def test_no_other_room_calls_the_reader_of_prints() -> None:
    root = Path(printed.__file__).parents[1]
    importers = {
        path.relative_to(root).as_posix()
        for path in root.glob("*/**/*.py")
        if "printed import" in (text := path.read_text(encoding="utf-8")) and "parse" in _taken(text)
    }
    # `perturb` reads printed parameters while an experiment runs, and no claim.
    assert importers == {"judge/agreement.py", "judge/perturb.py"}


def _taken(text: str) -> str:
    (line,) = (line for line in text.splitlines() if "judge.printed import" in line)
    return line.partition(" import ")[2]


def test_a_build_reads_each_printed_value_once(file: ResultsFile, parsed: Counter[str], tmp_path: Path) -> None:
    altered_prints = {
        text for record in file.claims if record.claim.printed for text in moved(printed.parse(record.claim.printed))
    }
    parsed.clear()
    build_report(file, tmp_path, tmp_path / "index.html")
    own = reads(file)
    assert {text: number for text, number in parsed.items() if text in own and number > own[text]} == {}
    assert sum(own.values()) == sum(parsed[text] for text in own)
    mended = {text for text in parsed if text not in own and text not in altered_prints}
    assert len(mended) <= sum(record.verdict == "differs" for record in file.claims)


def test_a_second_reader_is_found_out(
    file: ResultsFile, parsed: Counter[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from replication.audit.report import paper

    once: Callable[..., object] = vars(paper)["views"]
    monkeypatch.setattr(paper, "views", lambda claims, read: once(claims, paper_targets(claims)))
    from replication.audit.report.claim import targets as paper_targets

    build_report(file, tmp_path, tmp_path / "index.html")
    own = reads(file)
    assert all(parsed[text] > number for text, number in own.items())


def test_what_a_print_stands_for_comes_from_the_judgement(file: ResultsFile, parsed: Counter[str]) -> None:
    (room,) = rooms(file)
    assert room.agrees
    elsewhere = altered(file.claims[0], intervals=(("2/1", "3/1"),))
    (room,) = rooms(replace(file, claims=(elsewhere, *file.claims[1:])))
    assert not room.agrees
    assert not parsed

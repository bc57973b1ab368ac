"""What is committed and pinned, figures, README and verdicts, against a fresh run."""

import math
import re
from pathlib import Path

import msgspec
import pytest
from tables import number, read_csv

import papers
from benchmarks import readme
from benchmarks.readme import example_block, noted, results_block, run_example, verdicts
from papers import KEYS
from replication.audit.judge.numerals import MORE
from replication.audit.judge.verdict import rejudge
from replication.audit.model import Kind, Policy, Verdict
from replication.audit.publish.archive import badges
from replication.audit.report.claim import targets, views
from replication.audit.run.draw import write_figure
from replication.audit.run.runner import Outcome
from replication.audit.store.sources import SourceTree

ROOT = Path(__file__).resolve().parents[2]
FIGURE_TOLERANCE = 1e-6


@pytest.mark.slow
def test_figures_hold_the_data_of_a_fresh_run(fresh_run: Outcome, tmp_path: Path) -> None:
    results, tree = fresh_run.results_by_experiment, SourceTree({})
    records = tuple(
        write_figure(one, paper.key, results, tmp_path, tree) for paper in papers.load() for one in paper.figures
    )
    assert [record.error for record in records if record.error] == []
    for record in records:
        committed, fresh = (read_csv(folder / f"{record.name}.csv") for folder in (ROOT / "figures", tmp_path))
        assert list(committed) == list(fresh), record.name
        for column, values in fresh.items():
            assert committed[column] == pytest.approx(values, abs=FIGURE_TOLERANCE), (record.name, column)
        assert (ROOT / "figures" / f"{record.name}.svg").is_file()
    assert {path.stem for path in (ROOT / "figures").iterdir()} == {record.name for record in records}


@pytest.mark.slow
def test_each_number_shown_lies_in_the_bracket_shown(fresh_run: Outcome) -> None:
    """Of all claims, in their lines and in their evidence; the bracket in words holds the one in digits.

    A bracket that is narrower than the digits shown is that of the number itself, rounded.
    """
    claims, shown = fresh_run.results.claims, 0
    for view in views(claims, targets(claims)):
        for entry in view.entries:
            low, high = (number(end) for end in (entry.lower or "-inf", entry.upper or "inf"))
            assert low <= number(entry.full) <= high, view.record.id
            assert number(entry.head + entry.tail) == entry.shown
            narrow = 10.0 ** (-len((entry.head + entry.tail).partition(".")[2]) - MORE)
            assert low <= entry.shown <= high or high - low < narrow, view.record.id
            shown += math.isfinite(low) and low < high
        said = re.search(r"[Bb]racket \[([^,]+), ([^]]+)\]", view.record.judgement.reason)
        # Under several readings the words give the bracket of each, the digits that of the claim.
        if said is not None and len(view.entries) == 1 and not view.record.evidence.outcomes:
            (entry,) = view.entries
            assert number(said[1]) <= number(entry.lower) <= number(entry.upper) <= number(said[2]), view.record.id
    assert shown >= 40


@pytest.mark.slow
def test_readme_holds_the_results_of_a_fresh_run(fresh_run: Outcome) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    committed = text[text.index(readme.BEGIN) : text.index(readme.END) + len(readme.END)]
    assert committed == results_block(fresh_run.results), "write it anew with `make readme`"


@pytest.mark.slow
def test_badges_and_picture_of_the_readme_are_of_a_fresh_run(fresh_run: Outcome) -> None:
    shown = badges(fresh_run.results, readme.BADGES, "claims")
    assert {f"docs/badges/{path.name}" for path in (ROOT / "docs" / "badges").iterdir()} == set(shown)
    for name, text in shown.items():
        assert (ROOT / name).read_text(encoding="utf-8") == text, "write it anew with `make readme`"
    assert noted(ROOT / "docs" / "answer.png")[readme.VERDICTS] == verdicts(fresh_run.results), (
        "`make picture` takes it anew"
    )


def test_the_picture_is_of_sources_that_were_committed() -> None:
    assert re.fullmatch("[0-9a-f]{40}", noted(ROOT / "docs" / "answer.png")[readme.COMMIT])


def test_the_example_of_the_readme_is_the_file_and_what_it_gives() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    ran, picture = (run_example(ROOT / name) for name in (readme.EXAMPLE, readme.DRAWN))
    committed = text[text.index(readme.EXAMPLE_BEGIN) : text.index(readme.EXAMPLE_END) + len(readme.EXAMPLE_END)]
    assert committed == example_block(ran, picture), "write it anew with `make readme`"
    drawn, fresh = (re.sub(r"[-0-9.,]+", "", text) for text in ((ROOT / readme.PICTURE).read_text(), picture.drawing))
    assert drawn == fresh
    assert text.count("```python") == committed.count("```python") > 0, "all of its code is that of the file"


def test_readme_names_every_command_that_exists() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, flags=re.M))
    assert set(re.findall(r"`?make ([a-z-]+)", text)) <= targets


PAPERS = {paper.key: paper for paper in papers.load()}
FLIPPED = {"mustafa": 4, "okajima2023": 50}
"""Prints of one number that come out, moved up and down: at least so many."""
COMES_OUT = (Verdict.REPRODUCED, Verdict.REPRODUCED_AFTER_ERRATUM)


@pytest.mark.slow
@pytest.mark.parametrize("key", KEYS)
def test_every_claim_has_its_pinned_verdict_and_every_erratum_is_proved(key: str, fresh_run: Outcome) -> None:
    claims = [claim for claim in fresh_run.results.claims if claim.paper == key]
    assert len(claims) == len(PAPERS[key].claims) >= 30
    assert {claim.id: claim.judgement.reason for claim in claims if claim.unexpected} == {}
    assert fresh_run.failures == ()
    (findings,) = (paper.findings for paper in fresh_run.results.papers if paper.key == key)
    assert len(findings) == len(set(findings)) >= 10
    errata = [erratum for erratum in fresh_run.results.errata if erratum.paper == key]
    assert len(errata) == len(PAPERS[key].errata)
    assert [erratum.id for erratum in errata if not erratum.holds or erratum.error] == []


def test_no_number_differs_that_is_computed_from_printed_results(fresh_run: Outcome) -> None:
    """Where gains or a filter went in as printed, the evidence would have to hold the range over their rounding."""
    papers_ = [PAPERS[key] for key in FLIPPED]
    inputs = {experiment.name: set(experiment.inputs) for paper in papers_ for experiment in paper.experiments}
    differing = [record.claim for record in fresh_run.results.claims if record.verdict is Verdict.DIFFERS]
    differing = [claim for claim in differing if claim.id.partition(".")[0] in FLIPPED]
    assert differing
    for claim in differing:
        used = set().union(*(inputs[name] for name in claim.uses))
        assert not used & {"gains", "printed_gains", "printed", "stated_poles"}, claim.id


@pytest.mark.slow
@pytest.mark.parametrize("key", FLIPPED)
def test_one_unit_in_the_last_place_flips_the_verdict(key: str, fresh_run: Outcome) -> None:
    errata = {erratum.id: erratum for erratum in fresh_run.results.errata}
    flipped = 0
    for record in fresh_run.results.claims:
        if record.paper != key or record.claim.kind is not Kind.VALUE or record.verdict not in COMES_OUT:
            continue
        places = len(record.claim.printed.partition(".")[2])
        for sign in (1, -1):
            other = f"{float(record.claim.printed) + sign * 10.0**-places:.{places}f}"
            reprinted = msgspec.structs.replace(record.claim, printed=other)
            moved = rejudge(msgspec.structs.replace(record, claim=reprinted), errata, readings=PAPERS[key].readings)
            # One unit more of an optimum may be where a solver stopped; that is no agreement as printed.
            by_solver = sign > 0 and Policy.SOLVER in moved.policies
            assert moved.verdict is (Verdict.COMPATIBLE if by_solver else Verdict.DIFFERS), (record.id, moved.reason)
            flipped += moved.verdict not in COMES_OUT
    assert flipped >= FLIPPED[key]

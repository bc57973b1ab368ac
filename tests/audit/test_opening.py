"""The opening of the report: its sentences are short and true, its picture holds each claim once and ranks by rule."""

import re
from dataclasses import replace as replaced
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import html5lib
import pytest
from cases import altered, results_file
from looking import evidence
from msgspec.structs import replace
from sample import KEY, brief, claims, paper_record, results

from replication.audit.brief import Bars, Consequence, Curve, Entries, Pair, Traces
from replication.audit.inspect.headline import tally
from replication.audit.judge.numerals import require_short
from replication.audit.model import Kind, Outcome, Policy, Verdict
from replication.audit.parts import CELL, CommonLevel
from replication.audit.report.claim import Standing, anchor, consequence, standing, targets, views
from replication.audit.report.opening import picture_of
from replication.audit.report.page import build_report, render
from replication.audit.report.paper import cell_of, paper_view
from replication.audit.report.sections import across
from replication.audit.report.templates import TERMS, environment, linked, terms
from replication.audit.report.told import briefs, sentences
from replication.audit.run import assemble
from replication.audit.run.assemble import Available
from replication.audit.store.records import ResultsFile
from replication.errors import AuditError


@pytest.fixture(scope="module")
def made(made: ResultsFile) -> ResultsFile:
    return replace(made, figures=())


def test_a_finding_has_25_words_and_two_numbers_and_a_run_refuses_any_other() -> None:
    """What has a number in its name is no number, and a link counts as its words."""
    words = " ".join(["word"] * 22)
    assert require_short(f"{words} 0.5 1.2×10⁻³ end.")
    with pytest.raises(AuditError, match="at most 25 words, this one 26"):
        require_short(f"{words} one word too many")
    with pytest.raises(AuditError, match=r"at most 2 numbers, this one \.5, 3, 17"):
        require_short("It is .5 for 3 of 17.")
    names = ("Theorem 3", "Examples 1-3", "Table 1", "eq. (34)", "degree 2", "periods (2, 1)", "offsets [0, 1, 2]")
    for name in (*names, "Sec. IV", "L2", "Case 2 and 3"):
        assert require_short(f"By {name} the level is 0.5, not 0.7.")
    assert require_short("[" + " ".join(["word"] * 25) + "](+gamma.1-2-3-4)")
    empty = dict.fromkeys(("claims", "errata", "experiments"), ())
    wordy = SimpleNamespace(findings=lambda results: ("It holds.", "word " * 26), title="", **empty)
    with pytest.raises(AuditError, match="at most 25 words"):
        vars(assemble)["_sentences"](wordy, Available({}, {}))


@pytest.mark.parametrize(
    ("place", "kind", "printed", "expected"),
    [
        ("Theorem 1, case U3", Kind.FEASIBLE, "", Consequence.THEOREM),
        ("Sec. VI-A; Theorem 3; eq. (8)", Kind.FEASIBLE, "", Consequence.THEOREM),
        ("Sec. I; Sec. III, before Lemma 2", Kind.FEASIBLE, "", Consequence.HEADLINE),
        ("abstract; Sec. VII", Kind.ORDER, "", Consequence.HEADLINE),
        ("Sec. VI-B", Kind.VALUE, "0.0952", Consequence.HEADLINE),
        ("Table I, n = 1", Kind.VALUE, "1.33", Consequence.TABLE),
        ("Sec. X, Example 2, table", Kind.VALUE, "2.3", Consequence.TABLE),
        ("Sec. IV-A", Kind.VALUE, "73", Consequence.DIGIT),
        ("Eq. (33)", Kind.VALUE, "1.33", Consequence.DIGIT),
        ("Sec. VI-B", Kind.MATRIX, "[0 1]", Consequence.DIGIT),
        ("Sec. V, parameters", Kind.VALUE, "3.66", Consequence.DIGIT),
        ("Sec. II", Kind.ORDER, "", Consequence.REMARK),
        ("Table I, n = 1", Kind.CITED, ".516", Consequence.REMARK),
    ],
)
def test_consequence_by_rule(place: str, kind: Kind, printed: str, expected: Consequence) -> None:
    stated = altered(claims()[0], place=place, kind=kind, printed=printed).claim
    assert consequence(stated) is expected
    assert consequence(replace(stated, consequence=Consequence.THEOREM)) is Consequence.THEOREM


def test_each_claim_is_one_mark_in_its_cell_and_repeats_are_none(made: ResultsFile) -> None:
    again = altered(made.claims[1], repeats=made.claims[0].id)
    text = render(replace(made, claims=(made.claims[0], again, *made.claims[2:])), Path())
    assert "1 repeat, not counted" in text and "repeat, not counted" not in render(made, Path())
    page = html5lib.parse(text)
    marks = [e for e in page.iter() if e.get("class") == "k"]
    expected = {f"#{anchor('claim', record.id)}" for record in made.claims if record.id != again.id}
    assert {mark.get("href") for mark in marks} == expected and len(marks) == len(expected)
    told = ["".join(e.itertext()) for e in page.iter() if str(e.tag).endswith("}h4")]
    groups = [re.search(r" (\d+)(?:, and (\d+) that repeat)?", text) for text in told if "not counted" not in text]
    found = [(int(one[1]), int(one[2] or 0)) for one in groups if one is not None]
    assert sum(number for number, _ in found) + 1 == len(made.claims) and sum(number for _, number in found) == 1


SOUND = Standing(theorems=1, refuted=0, broken=0, sound=True, corrected=False, open=False, failing=0, claims=9)
OPEN, FALSE = replaced(SOUND, sound=False), replaced(SOUND, sound=False, refuted=1, broken=1, failing=1)


def answer(*given: Any) -> str:
    return str(environment().get_template("headings.html.j2").module.answer(*given))  # type: ignore[attr-defined]


def answered(*papers: Any) -> str:
    heads: Any = environment().get_template("headings.html.j2").module
    broken, sound = ([paper for paper in papers if bool(paper.standing.broken) is fails] for fails in (True, False))
    return answer(
        [paper.standing for paper in papers],
        tally(view.record for paper in papers for view in paper.claims),
        heads.broken(broken),
        heads.off([paper for paper in sound if paper.standing.failing]),
        heads.named([paper for paper in sound if paper.standing.corrected]),
    )


@pytest.mark.parametrize(
    ("papers", "sentence"),
    [
        ([FALSE], "Doe is false."),
        ([replaced(FALSE, refuted=0)], "Doe fails."),
        ([SOUND], "Every theorem of the paper passes our tests."),
        ([SOUND, OPEN], "No theorem of both papers is refuted."),
        ([replaced(OPEN, failing=1)], "No theorem of the paper is refuted; one result of Roe differs."),
        (
            [FALSE, replaced(SOUND, failing=2), replaced(SOUND, corrected=True), replaced(SOUND, failing=1)],
            "Doe is false. Theorems of the other three papers survive our tests, some of Moe once corrected.",
        ),
        ([FALSE, replaced(FALSE, refuted=2, broken=2, failing=2)], "Doe is false."),
        (
            [FALSE, FALSE, FALSE, SOUND],
            "Doe is false. Every theorem of the other paper passes our tests.",
        ),
        ([], "There is no claim to judge."),
    ],
)
def test_the_answer(papers: list[Standing], sentence: str) -> None:
    off = "Roe" * any(paper.failing for paper in papers)
    mended = "Moe" * any(paper.corrected for paper in papers)
    assert answer(papers, tally([]), "Doe", off, mended) == sentence


def paper_of(records: Any) -> Any:
    record = SimpleNamespace(
        cited="Doe (2020)", named="Doe (2020)", key=KEY, title="Observers", findings=(), brief=None
    )
    shown = views(records, targets(records))
    cells = [cell_of(shown, kind) for kind in Consequence]
    return cast(Any, SimpleNamespace(record=record, claims=shown, standing=standing(records), cells=cells))


@pytest.mark.parametrize(
    ("verdicts", "words"),
    [
        ("reproduced, consistent, compatible, reproduced after erratum", "Of 4 results, 3 hold, 1 possible."),
        (
            "reproduced, differs, refuted, undetermined, error",
            "Of 5 results, 1 holds, 2 fail, 1 undetermined, 1 in error.",
        ),
        ("refuted", "Of 1 result, 0 hold, 1 fails."),
    ],
)
def test_results_without_a_theorem_are_counted_by_what_comes_out(made: ResultsFile, verdicts: str, words: str) -> None:
    by_verdict = {record.verdict: altered(record, place="Sec. II") for record in made.claims}
    assert answered(paper_of([by_verdict[Verdict(verdict)] for verdict in verdicts.split(", ")])) == words


def test_a_refuted_theorem_changes_the_answer_and_a_paper_without_one_has_none_that_passes(made: ResultsFile) -> None:
    holds = next(record for record in made.claims if record.verdict is Verdict.REPRODUCED and not record.unexpected)
    sound, plain = (paper_of([altered(holds, place=place)]) for place in ("Theorem 1", "Sec. II"))
    assert "passes our tests" in answered(sound) and "passes" not in answered(sound, plain)
    (refuted,) = [record for record in made.claims if record.verdict is Verdict.REFUTED]
    theorem = altered(refuted, place="Theorem 1")
    assert answered(paper_of([theorem])) == "The shorter is better guarantee of Doe (2020) is false."
    assert tally([theorem, altered(refuted, place="Sec. II")]).numbers["fail"] == 2


@pytest.mark.parametrize(
    ("holds", "place", "verdict", "expected"),
    [
        ((True, False), "Abstract", Verdict.UNDETERMINED, True),
        ((True, None), "Abstract", Verdict.UNDETERMINED, False),
        ((True, False), "Sec. II", Verdict.UNDETERMINED, False),
        ((True, True), "Abstract", Verdict.CONSISTENT, False),
    ],
)
def test_a_promise_that_holds_under_one_reading_and_fails_under_another_is_open(
    made: ResultsFile, holds: tuple[bool | None, ...], place: str, verdict: Verdict, expected: bool
) -> None:
    first = next(record for record in made.claims if record.claim.kind is not Kind.CITED and not record.claim.printed)
    outcomes = tuple(Outcome(reading=f"reading {i}", holds=one) for i, one in enumerate(holds))
    told = replace(first.evidence, outcomes=outcomes)
    judged = replace(altered(first, place=place), evidence=told, judgement=replace(first.judgement, verdict=verdict))
    assert standing([judged]).open is expected


def with_brief(made: ResultsFile, **changed: Any) -> ResultsFile:
    return replace(made, papers=(replace(made.papers[0], brief=replace(brief(), **changed)),))


@pytest.mark.parametrize(
    ("changed", "match"),
    [
        ({"holds": "[This](absent) holds."}, "links 'absent', which is no claim"),
        ({"holds": "[This](column-5-7) holds."}, "'column-5-7' holds, and the results do not"),
        ({"correct": "[This](column-2-3) is wrong."}, "'column-2-3' does not hold as printed"),
        ({"guess": "[This](column-2-3) is open."}, "'column-2-3' is a guess"),
        ({"guess": "[This](denominator) is open."}, "'denominator' is a guess"),
        ({"card": "[This](column-2-3) holds."}, "without a sign"),
        ({"card": "word " * 26}, "at most 25 words"),
        ({"card": "1.5, 2.5 and 3.5"}, "at most 2 numbers"),
        ({"card": "The level is 1.9391."}, r"1\.9391.* and the results hold no such number"),
        ({"card": "The level is {root:lower}."}, "which has no single one"),
        ({"headline": "It is {column-2-3:not}."}, "says that 1.33 is not 1.33"),
        ({"headline": "[This](+column-5-7) holds."}, "'column-5-7' holds, and the results do not"),
        ({"headline": "[This](absent) holds."}, "links 'absent', which is no claim"),
        ({"correct": "The level is {absent}."}, "links 'absent', which is no claim"),
        ({"correct": "The level is {root}."}, "as {root}, which has no single one"),
        ({"correct": "{column-5-7}, {column-5-7}, {column-5-7}"}, "at most 2 numbers"),
    ],
)
def test_a_sentence_of_a_brief_that_is_not_so_stops_the_build(
    made: ResultsFile, tmp_path: Path, changed: dict[str, str], match: str
) -> None:
    with pytest.raises(AuditError, match=match):
        build_report(with_brief(made, **changed), tmp_path, tmp_path / "index.html")


def test_a_brief_takes_the_number_of_a_claim_from_the_run(made: ResultsFile) -> None:
    (level,) = [record for record in made.claims if record.id == f"{KEY}.column-5-7"]
    for value, how, number in (
        (1.91712, "", "1.9171"),
        (2.5, "", "2.5"),
        (2.5, ":rounded", "2.5"),
        (1.91712, ":rounded", "1.92"),
        (None, "", "(not computed)"),
    ):
        claims = tuple(altered(level, value=value) if record is level else record for record in made.claims)
        told = with_brief(replace(made, claims=claims), correct=f"The [level](column-5-7) is {{column-5-7{how}}}.")
        assert briefs(told)[KEY].lines[1][1].text == f"The level is {number}."


def test_a_card_has_sentences_and_each_may_be_as_long_as_any(made: ResultsFile) -> None:
    assert len(sentences("It holds. [That](+x) fails.")) == len(sentences("Is it 1.33? {x} says so.")) == 2
    assert len(sentences("By Sec. IV and eq. (41) of Doe et al. It holds.")) == 1
    short = " ".join(["Word", *["word"] * 19])
    assert f"{short}. {short}." in render(with_brief(made, card=f"{short}. {short}."), Path())
    with pytest.raises(AuditError, match="at most 25 words"):
        briefs(with_brief(made, card=f"{short}. {short} {short}."))


def test_a_print_within_the_accuracy_of_a_solver_is_a_guess_and_no_correction(made: ResultsFile) -> None:
    """A print that needs a correction may be told as wrong, although it is compatible; this one may not."""
    (level,) = [record for record in made.claims if record.id == f"{KEY}.column-5-7"]

    def told(policy: Policy, **changed: Any) -> ResultsFile:
        judgement = replace(level.judgement, verdict=Verdict.COMPATIBLE, policies=(policy,))
        expected = replace(level, claim=replace(level.claim, expected=Verdict.COMPATIBLE), judgement=judgement)
        claims = tuple(expected if record is level else record for record in made.claims)
        plain = {"card": "It is so.", "correct": "Nothing."}
        return replace(with_brief(made, **{**plain, **changed}), claims=claims)

    assert briefs(told(Policy.SOLVER, guess="Did it stop at [this](column-5-7)?"))
    assert briefs(told(Policy.ERRATUM, correct="[This](column-5-7) is wrong."))
    for wrong in ({"correct": "[This](column-5-7) is wrong."}, {"card": "[This](-column-5-7) is wrong."}):
        with pytest.raises(AuditError, match="'column-5-7' does not hold as printed, and the results do not"):
            briefs(told(Policy.SOLVER, **wrong))
    with_solver = told(Policy.SOLVER)
    assert heading(with_solver, "errata").endswith(
        "; 1 print above the least level, within the accuracy that we assume of its solver"
    )


def heading(made: ResultsFile, name: str) -> str:
    view = paper_view(made.papers[0], made, Path(), targets(made.claims))
    return str(environment().get_template("headings.html.j2").module.heading(view, name, "")).strip()


def test_the_heading_of_the_tables_counts_their_numbers_by_verdict(made: ResultsFile) -> None:
    (table,) = made.papers[0].tables

    def of(*cells: str) -> str:
        short = replace(made.papers[0], tables=(replace(table, header=cells, rows=(cells,)),))
        return heading(replace(made, papers=(short,)), "tables")

    assert of(*table.rows[0]) == "Of 4 table numbers, 2 hold, 1 fails, 1 undetermined"
    assert of(table.rows[0][1]) == "Of 1 table number, 1 holds"
    assert of(f"{CELL}{KEY}.order") == "Tables as printed, and ours"
    noise, random = f"{CELL}{KEY}.noise", f"{CELL}{KEY}.random"
    assert of(noise, noise, random) == "Of 2 table numbers, 2 hold; 1 is a random draw"


def test_where_a_verdict_has_changed_the_sentence_says_so_and_the_page_is_built(made: ResultsFile) -> None:
    (wide,) = [record for record in made.claims if record.id == f"{KEY}.far"]
    assert wide.unexpected
    changed = with_brief(made, holds="[This](far) holds.")
    assert briefs(changed)[KEY].lines[0][1].shaken
    assert "A claim that this rests on has changed its verdict." in render(changed, Path())


@pytest.mark.parametrize("number", [0, 300])
def test_a_paper_with_no_claim_or_with_300_has_a_page(made: ResultsFile, tmp_path: Path, number: int) -> None:
    base = next(record for record in made.claims if record.verdict is Verdict.CONSISTENT)
    many = tuple(altered(base, id=f"{KEY}.statement-{index}", certificates=()) for index in range(number))
    bare = replace(made.papers[0], tables=(), scope=(), brief=None)
    path = build_report(replace(made, papers=(bare,), claims=many), tmp_path, tmp_path / "index.html")
    page = path.read_text(encoding="utf-8")
    html5lib.HTMLParser(strict=True).parse(page)
    assert page.count('<details class="claim"') == page.count('class="k"') == number
    assert len(evidence(page)) == number + 1
    assert ("There is no claim to judge." in page) is (number == 0)


def shown(made: ResultsFile, figures: Path, **changed: Any) -> Any:
    """The picture of the sample."""
    told = with_brief(made, **changed)
    return picture_of(paper_view(told.papers[0], told, figures, targets(told.claims)), figures)


def test_a_paper_without_a_picture_shows_the_numbers_of_its_first_table(made: ResultsFile) -> None:
    picture = shown(made, Path())
    first, second, *_ = picture.rows[0][1]
    assert picture.columns == made.papers[0].tables[0].header[1:]
    assert first.view.record.id == f"{KEY}.column-2-3" and not first.instead and 16 < first.at < 84
    cells = [cell for _, row in picture.rows for cell in row if cell is not None]
    assert (len(cells), sum(bool(cell.instead) for cell in cells)) == (4, 2)
    assert "ours rounds differently (2 of 4)" in render(made, Path())
    assert second.ours.startswith(second.entry.full[:4])
    bare = replace(made.papers[0], brief=None, tables=())
    assert picture_of(paper_view(bare, made, Path(), targets(made.claims)), Path()) is None
    page = render(replace(made, papers=(bare,)), Path())
    assert f">{bare.findings[0]}</h2>\n<p><bdi>{bare.summary}</bdi></p>" in page


def test_several_rows_are_a_table_and_the_headline_brings_its_proof(made: ResultsFile) -> None:
    rows_of = tuple((name, ("column-5-7", "column-2-3")) for name in ("one", "two"))
    told = with_brief(
        made, picture=Entries(columns=("a", "b"), rows=rows_of), headline="It is [so](column-2-3)", verdict="so"
    )
    page = html5lib.parse(render(told, Path()))
    (table,) = [e for e in page.iter() if str(e.tag).endswith("}table") and e.get("class") == "boxes"]
    assert len([e for e in table.iter() if str(e.tag).endswith("}th")]) == 4
    (known,) = [record for record in made.claims if record.id == f"{KEY}.column-2-3"]
    assert briefs(told)[KEY].headline.proofs == known.evidence.certificates
    assert briefs(with_brief(made, headline="It is so"))[KEY].headline.proofs == ()
    cell = shown(made, Path(), picture=Entries(columns=("a", "b"), rows=rows_of)).rows[0][1][0]
    assert cell.entry.printed != cell.instead == f"{float(cell.entry.full):.2f}"


def test_bars_are_as_long_as_print_and_bound(made: ResultsFile) -> None:
    pair = Pair(label="level", printed="column-5-7", bound="column-2-3")
    picture = Bars(pairs=(pair,), printed="printed", bound="bound")
    (bar,) = shown(made, Path(), picture=picture)
    ratio = bar.drawn[1] / bar.drawn[0]
    assert ratio == pytest.approx(bar.times, rel=0.01) and bar.times < ratio
    page = render(replace(with_brief(made, picture=picture), figures=()), Path())
    widths = [float(width) for width in re.findall(r'<i class="[a-z]+" style="width:([\d.]+)%"></i></dd>', page)]
    assert max(widths) == 100 and widths[1] / widths[0] == pytest.approx(ratio, rel=0.01)


@pytest.mark.parametrize(
    ("picture", "match"),
    [
        (Entries(columns=("one",), rows=(("level", ("absent",)),)), "shows 'absent', which is no claim"),
        (Bars(pairs=(Pair(label="", printed="order", bound="column-2-3"),), printed="", bound=""), "which lack a"),
    ],
)
def test_a_picture_of_what_the_paper_does_not_have_is_refused(made: ResultsFile, picture: Any, match: str) -> None:
    with pytest.raises(AuditError, match=match):
        shown(made, Path(), picture=picture)


def test_traces_end_at_their_last_value_and_name_the_columns_that_there_are(tmp_path: Path) -> None:
    drawn = results(tmp_path)

    def traces(column: str) -> Traces:
        return Traces(figure="doe1999-fig2", across="k", x="k", y="e", curves=(Curve(label="e", columns=(column,)),))

    (curve,) = shown(drawn, tmp_path, picture=traces("error 1")).curves
    assert curve.path.startswith("M0 ") and curve.path.split("L")[-1].startswith("1000 ")
    with pytest.raises(AuditError, match="shows 'absent' of doe1999-fig2, which has the columns k, error 1"):
        shown(drawn, tmp_path, picture=traces("absent"))


# What a sensor costs, as a factor over the ideal one


def level(sensor: str, multiple: int, lower: float, upper: float) -> CommonLevel:
    return CommonLevel(sensor=sensor, multiple=multiple, lower=lower, upper=upper, measure="gain")


def file_with(*levels: CommonLevel) -> ResultsFile:
    return replace(results_file(), papers=(replace(paper_record(()), common=levels),))


def test_factors_are_brackets_over_the_ideal_sensor() -> None:
    slow, late = across(file_with(level("slow", 1, 2.0, 2.5), level("slow", 3, 5.0, 6.0), level("late", 1, 1.0, 1.0)))
    assert slow.costs[3] == pytest.approx((2.0, 3.0)) and slow.costs[1] == (1.0, 1.0)
    assert set(late.costs) == {1}
    assert across(file_with()) == across(file_with(level("slow", 2, 1.0, 1.0))) == (), "no ideal sensor, no factor"


# Words


@pytest.mark.parametrize(
    ("html", "expected"),
    [
        ("<p>two readings, a reading</p>", '<p>two <a class="term" href="#word-reading">readings</a>, a reading</p>'),
        ("<h2>A box</h2><p><a>box</a></p>", "<h2>A box</h2><p><a>box</a></p>"),
        ('<p title="box">inbox</p>', '<p title="box">inbox</p>'),
        ("<p><svg><path/></svg> box</p>", '<p><svg><path/></svg> <a class="term" href="#word-box">box</a></p>'),
    ],
)
def test_the_first_mention_of_a_term_leads_to_its_meaning(html: str, expected: str) -> None:
    assert linked(html, TERMS) == expected


def test_each_term_that_is_met_has_its_entry_and_a_paper_adds_its_own(made: ResultsFile) -> None:
    page = html5lib.parse(
        render(with_brief(made, terms={"sensors": "What measures."}, card="Sensors have a bracket."), Path())
    )
    met = {str(e.get("href"))[1:] for e in page.iter() if e.get("class") == "term"}
    assert {"word-bracket", "word-sensors"} <= met <= {e.get("id") for e in page.iter()}
    added = [list(terms(with_brief(made, terms=dict.fromkeys(order, "")).papers)) for order in ("ab", "ba")]
    assert added[0] == added[1] == [*TERMS, "a", "b"], "the same before and after the results are written"

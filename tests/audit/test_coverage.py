"""Coverage of a text: what is bound to nothing, or was taken out, is noticed; a draft of it is whole and of use."""
# ruff: noqa: E501 - a case on a line

import shutil
import tomllib
from pathlib import Path

import msgspec
import pytest
from cases import claim, paper
from hypothesis import given
from hypothesis import strategies as st
from lab import Lab
from sample import figure
from tables import rows

from replication.audit.data import printed_values
from replication.audit.inspect.coverage import (
    REASONS,
    Text,
    differences,
    excuses,
    faults,
    problems,
    read_coverage,
    still_open,
    tallied,
)
from replication.audit.inspect.draft import draft
from replication.audit.model import Reading
from replication.audit.parts import ScopeItem
from replication.errors import AuditError

TEXTS = Path(__file__).parent / "texts"
"""A list of what a text prints, and two texts of which to draft one."""
TEXT = "In Sec. 7 A is 0.5, -0.1, 0, 1 in 2 states; (2, 1) gives 1.14. Then 1.33 after 9 and 3 of 8 steps."
PAPER = paper(
    claim(printed="1.33"),
    claim(id="toy.order", printed=""),
    figures=(figure("toy-fig1"),),
    readings=(Reading(name="norm", place="", text=""),),
    scope=(ScopeItem(part="Appendix", reason="It is not at hand."), ScopeItem(part="all", claims=("toy.value",))),
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("printed.toml", "coverage.toml"):
        shutil.copy(TEXTS / name, tmp_path)
    return tmp_path


def change(folder: Path, old: str, new: str) -> None:
    path = folder / "coverage.toml"
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_a_whole_list_has_no_faults_and_is_counted(folder: Path) -> None:
    assert faults(folder, PAPER) == []
    numerals, items = tallied("paper", read_coverage(folder / "coverage.toml")["paper"])
    assert (numerals.of, numerals.bound, numerals.excused, numerals.open) == ("numerals", 10, 1, 1)
    assert (numerals.total, numerals.aside) == (12, 1)
    assert (items.of, items.total, items.bound, items.excused) == ("items", 5, 4, 1)


def test_what_is_open_is_listed_and_excuses_are_counted(folder: Path) -> None:
    text = read_coverage(folder / "coverage.toml")["paper"]
    assert list(still_open(text)) == ["Sec. III: 8: which horizon?"]
    assert excuses(text) == {"symbol": 1, "elsewhere": 1} and excuses(text).keys() <= REASONS.keys()
    assert [tally.text for tally in tallied("blog", text)] == ["blog", "blog"]


@pytest.mark.parametrize(("old", "new", "words"), rows("slips"))
def test_each_slip_is_noticed(folder: Path, old: str, new: str, words: str) -> None:
    change(folder, old, new)
    found = faults(folder, PAPER)
    assert any(words in fault for fault in found), found
    assert all(fault.startswith(("toy: paper", "toy: printed.toml")) for fault in found)


@pytest.mark.parametrize(
    ("more", "fault"),
    [
        ('[made]\nplace = "Sec. IX"\nvalue = "4.5"', "toy: printed.toml, made: no row is bound to '4.5' (Sec. IX)"),
        ('[made]\nplace = "Sec. IX"\nvalue = { a = ["4.5"] }', "printed.toml, made.a.1: no row is bound to '4.5'"),
        ('[made]\nplace = "Table 2"\nvalue = "1.33"', "no row is bound to '1.33' (Table 2)"),
        ('[made]\nplace = "Table 1"\nvalue = "1.33"', ""),
        ('[made]\nplace = "Sec. IX"\nvalue = { a = "grid", b = 4 }', ""),
    ],
)
def test_a_print_that_no_row_is_bound_to_is_a_fault(folder: Path, more: str, fault: str) -> None:
    with (folder / "printed.toml").open("a", encoding="utf-8") as printed:
        printed.write(more)
    found = faults(folder, PAPER)
    assert [fault in told for told in found] == ([True] if fault else []), found


@pytest.mark.parametrize(("text", "words"), rows("no lists"))
def test_a_list_that_is_none_is_refused_with_file_and_entry(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "coverage.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(AuditError) as caught:
        read_coverage(path)
    assert str(path) in str(caught.value) and words in str(caught.value)
    with pytest.raises(AuditError, match="cannot be read"):
        read_coverage(tmp_path / "none.toml")


def test_a_text_and_its_list_are_compared_numeral_by_numeral(folder: Path) -> None:
    listed = read_coverage(folder / "coverage.toml")["paper"]
    assert list(differences(listed, TEXT)) == []
    assert list(differences(listed, TEXT.replace("1.33", "1.34"))) == [
        "1.33: 0 in the text, 1 in the list",
        "1.34: 1 in the text, 0 in the list",
    ]
    assert list(differences(listed, TEXT + " 8")) == ["8: 2 in the text, 1 in the list"]
    assert next(differences(listed, TEXT.replace("0.5", ".5"))) == ".5: 1 in the text, 0 in the list"


def test_a_text_of_which_nothing_is_listed_is_a_fault(folder: Path) -> None:
    (folder / "coverage.toml").write_text("[paper]\nruns = 3\n", encoding="utf-8")
    assert "toy: paper: 0 numerals are listed, and the text has 3; one was taken out or added" in faults(folder, PAPER)


TEX, PLAIN = ((TEXTS / name).read_text(encoding="utf-8") for name in ("paper.tex", "paper.txt"))


def read(text: str, *, tex: bool) -> tuple[dict[str, object], list[tuple[str, str, tuple[str, ...]]], list[str]]:
    """The printed data, the rows with their places, and what is wrong with the draft as it stands."""
    printed, coverage = draft(text, tex=tex)
    data = printed_values(Path(__file__), tomllib.loads(printed))
    texts = msgspec.toml.decode(coverage, type=dict[str, Text])
    rows = [(place.place, row[0], row[1:]) for place in texts["paper"].places for row in place.numerals]
    wrong = [*problems(texts, paper(), data), *differences(texts["paper"], text)]
    return dict(data), rows, wrong


@pytest.mark.parametrize(
    ("text", "tex", "expected"),
    [
        (TEX, True, {
            "1908": "open: line 4", "24": "open: line 4", r"0.75 \pm 0.03": "data:sec-2-line-6", "< 0.001": "data:sec-2-line-6-2",
            "7": "excused:furniture", r"3.00\times10^{8}": "data:sec-2-1-line-8", "0.75 [0.70, 0.80]": "data:sec-2-1-line-8-2",
            "-0.5": "data:sec-2-1-line-8-3", ".33": "data:sec-2-1-line-8-4", "66,033": "data:sec-2-1-line-8-5",
            "0.75***": "data:table-1.treated.rate", "-1.2": "data:table-1.control.rate", "14": "data:table-1.control.n",
            "2.5": "data:eq-1-line-19", "98": "excused:bibliography", "5": "excused:citation", "11": "excused:furniture",
        }),
        (PLAIN, False, {
            "1898": "excused:bibliography", "4.5 %": "data:sec-1-line-4", ".75": "data:table-1-line-8",
            "6.6": "data:sec-2-line-11", "3.84(5) × 10^4": "data:sec-2-line-12", "(3.84 ± 0.06) × 10^4": "data:sec-2-line-12-2",
            "666": "open: line 14", ".8873": "data:sec-2-line-14", "-0.5": "data:sec-2-line-14-2",
            "1.2e-3": "data:sec-2-line-14-3", "12": "excused:bibliography", "2.33": "data:table-1-line-8-2",
        }),
    ],
)  # fmt: skip
def test_each_numeral_has_its_place_and_a_guess(text: str, tex: bool, expected: dict[str, str]) -> None:
    data, rows, wrong = read(text, tex=tex)
    assert wrong == []
    assert expected.items() <= {numeral: binding[0] for _, numeral, binding in rows}.items()
    reasons = {numeral: place for place, numeral, _ in rows}
    assert reasons["24" if tex else "666"].startswith("Sec. ")
    assert "table-1" in data or "table-1-line-8" in data


PIECES = st.sampled_from(
    [*"0123456789.,-−±%()[]{}^_&$\\ \nab", "\\section{", "\\begin{table}", "Table ", "\\pm ", "10^", "References\n"]
)


@given(st.lists(PIECES, max_size=60).map(lambda pieces: f"{''.join(pieces)}\n7"), st.booleans())
def test_a_draft_of_any_text_is_whole_and_fits_itself(text: str, tex: bool) -> None:
    assert read(text, tex=tex)[2] == []


@pytest.mark.slow
def test_drafts_lie_beside_the_paper_and_replace_nothing(lab: Lab) -> None:
    (lab.root / "text.tex").write_text(TEX, encoding="utf-8")
    asked = ("coverage", "--draft", "text.tex", "--paper")
    assert "begin the paper with `replication new roe`" in lab.cli(*asked, "roe").stderr
    before = set(lab.path("toy2020").iterdir())
    done = lab.cli(*asked, "toy2020")
    assert done.returncode == 0 and "next: read each entry" in done.stdout
    made = set(lab.path("toy2020").iterdir()) - before
    assert {path.name for path in made} == {"printed.draft.toml", "coverage.draft.toml"}
    again = lab.cli(*asked, "toy2020")
    assert again.returncode == 2 and "exists; move what you take from it into place" in again.stderr
    (lab.root / "text.tex").write_bytes(b"\xff\xfe")
    for path in made:
        path.unlink()
    assert "is no text in UTF-8" in lab.cli(*asked, "toy2020").stderr
    (lab.root / "text.tex").write_text("none", encoding="utf-8")
    assert "holds no number" in lab.cli(*asked, "toy2020").stderr
    assert "cannot be read" in lab.cli("coverage", "--draft", "none.tex", "--paper", "toy2020").stderr
    assert "give both or neither" in lab.cli("coverage", "--draft", "text.tex").stderr

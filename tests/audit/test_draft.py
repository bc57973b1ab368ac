"""A draft of the printed data and the coverage of a text: whole, valid, and of use where a text is usual."""
# ruff: noqa: E501 - a case on a line

from __future__ import annotations

import tomllib
from pathlib import Path

import msgspec
import pytest
from cases import paper
from hypothesis import given
from hypothesis import strategies as st
from lab import Lab, make_inside

from replication.audit.data import printed_values
from replication.audit.inspect.coverage import Text, differences, problems
from replication.audit.inspect.draft import draft

TEX = r"""\documentclass[11pt]{article}
\begin{document}
\section{Introduction}
In 1908 we saw 24 patients \cite{roe98}, see Table~\ref{tab1} and [3, 5].
\section{Results}
The slope is $0.75 \pm 0.03$ mg ($p < 0.001$), or 12.5\,\% of $x_1^2$.
\subsection{More} % comment 7
A speed of $3.00\times10^{8}$ m/s; 0.75 [0.70, 0.80], -0.5 and .33 in 66,033 cases.
\begin{table}[h2]
\caption{Rates in 3 groups}
\begin{tabular}{lcc}
\hline
Group & Rate & $n$ \\ \hline
Treated & 0.75*** & 12 \\
Control & $-1.2$ & 14 \\
\end{tabular}
\end{table}
\begin{equation}
 y = 2.5 x + 3
\end{equation}
\begin{thebibliography}{9}
\bibitem{roe98} Roe, 1998, 12--34.
\end{thebibliography}
\end{document}
"""
PLAIN = """A note of 1908

1. Introduction
As Roe (1898) and others [2] say, see Section 2 and Eq. (3), it is 4.5 %.

Table 1. Hours of sleep
Patient 1   0.7  1.9
mean        .75  2.33

2. Results
Table 1 gives 6.6 of them, and Table 2,
Table 3, too: 3.84(5) × 10^4 and (3.84 ± 0.06) × 10^4.

The odds are 666 to 1; P = .8873, from -0.5 to 1.2e-3.

References
[1] Roe, Journal 12, 1898.
"""


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


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return make_inside(tmp_path / "lab")


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

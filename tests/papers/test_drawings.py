"""The committed figures: drawn again from their tables they are the same bytes, and keep the rules of the house."""

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from tables import read_csv

import papers
from papers.okajima2023 import figures as periods
from replication.audit.parts import FigureData, Paper
from replication.audit.run.draw import write_figure
from replication.audit.store.sources import SourceTree
from replication.drawing.panels import inner
from replication.drawing.style import house_style

FOLDER = Path(__file__).resolve().parents[2] / "figures"
LARGEST_FILE, LARGEST_OF_ALL = 40_000, 450_000
TELEPHONE, SMALLEST_TEXT = 358, 11
"""Pixels of a drawing in the margins of a screen of 390, and the height of text there."""

FIGURES = {figure.name: figure for paper in papers.load() for figure in paper.figures}


def data(name: str) -> FigureData:
    return FigureData(columns=read_csv(FOLDER / f"{name}.csv"))


def texts(drawing: str) -> list[str]:
    return [re.sub(r"<[^>]*>", "", text) for text in re.findall(r"<text\b[^>]*>(.*?)</text>", drawing, flags=re.S)]


@pytest.fixture(scope="module")
def again(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """All figures drawn from their committed tables, and their records."""
    folder = tmp_path_factory.mktemp("figures")
    made = [
        dataclasses.replace(figure, uses=(), data=lambda results, name=name: data(name))
        for name, figure in FIGURES.items()
    ]
    paper = cast(Paper, SimpleNamespace(key="all", figures=made))
    # Kept as they lie there: data that agree with a table beside them are not rounded again.
    for name in FIGURES:
        (folder / f"{name}.csv").write_bytes((FOLDER / f"{name}.csv").read_bytes())
    records = [write_figure(one, paper.key, {}, folder, SourceTree({})) for one in paper.figures]
    return folder, {record.name: record for record in records}


@pytest.mark.parametrize("name", FIGURES)
def test_the_committed_drawing_is_that_of_its_table(name: str, again: tuple[Path, dict[str, Any]]) -> None:
    folder, records = again
    assert records[name].error == ""
    for suffix in ("csv", "svg"):
        assert (folder / f"{name}.{suffix}").read_bytes() == (FOLDER / f"{name}.{suffix}").read_bytes(), suffix


@pytest.mark.parametrize("name", FIGURES)
def test_a_drawing_is_small_and_large_enough_to_read(name: str) -> None:
    drawing = (FOLDER / f"{name}.svg").read_text()
    assert len(drawing.encode()) <= LARGEST_FILE
    width = float(inner(drawing)[0].split()[2])
    sizes = [float(size) for size in re.findall(r"font:?[^;\"]*?[:\s]([0-9.]+)px", drawing)]
    assert sizes and min(sizes) * TELEPHONE / width >= SMALLEST_TEXT


def test_all_drawings_together_are_small() -> None:
    assert sum(path.stat().st_size for path in FOLDER.glob("*.svg")) <= LARGEST_OF_ALL


@pytest.mark.parametrize("name", FIGURES)
def test_units_stand_in_brackets_and_curves_have_no_box_of_names(name: str) -> None:
    said = texts((FOLDER / f"{name}.svg").read_text())
    assert said
    for text in said:
        assert not re.search(r"\[(s|rad|%|1)[^\]]*\]|, (s|rad|rad/s|percent)$", text), text
    with house_style():
        drawing = FIGURES[name].plot(data(name))
    assert not drawing.legends and all(axes.get_legend() is None for axes in drawing.axes)


@pytest.mark.parametrize("name", FIGURES)
def test_the_numbers_of_a_title_stand_in_the_words_of_the_figure(name: str, again: tuple[Path, dict[str, Any]]) -> None:
    record = again[1][name]
    number = r"(?<![\w.])\d+(?:\.\d+)?"
    title = re.sub(r"1/s|(?:Table|Theorem|degree) \w+", "", record.title)
    assert set(re.findall(number, title)) <= set(re.findall(number, record.alt))
    assert callable(FIGURES[name].title) and len(record.alt) > 40


def changed(name: str, **columns: tuple[float, ...]) -> FigureData:
    return FigureData(columns=data(name).columns | columns)


def title(name: str, **columns: tuple[float, ...]) -> str:
    """The message of a figure with other columns."""
    return cast(Any, FIGURES[name].title)(changed(name, **columns))


def test_messages_follow_the_data() -> None:
    """A title that no longer holds is not printed: each of these says something else of other data."""
    plain = {"gamma_synchronous": tuple(float(k) for k in range(1, 37))}
    assert "(5, 6) exceeds (6, 6)" in title("okajima2023-periods")
    assert title("okajima2023-periods", **plain) == "Up to 6 instants a longer period never lowers the level"
    rates = data("shao-rates").columns["alternating_predictive"]
    assert "grows at every T shown" in title("shao-rates")
    assert "not unstable at every T shown" in title("shao-rates", alternating_predictive=tuple(-x for x in rates))


def test_what_was_seen_in_some_draws_or_pairs_is_said_of_these() -> None:
    """Another number of draws, a larger error or a larger saving are told; a ratio that is called a bound is one."""
    few = {"draws": (7.0,), "band_high": (0.301,)}
    alt = FIGURES["mustafa-fig2"].alt(changed("mustafa-fig2", **few))
    assert "of 7 draws of uniform periods at 0.31 at most" in alt
    assert title("mustafa-fig2", **few).startswith("In our uniform draws the error peaks at 0.31 at most")
    half = title("okajima2023-timing", gamma_3_3=(2.0, 1.0))
    assert half.startswith("For periods (3, 3) ") and "50.0 %" in half
    shown = data("okajima2023-fig2-5").columns
    sizes = {name: periods.rms_of_all(name, shown) for name in periods.CASES}
    (stated,) = re.findall(r"^One draw: .* at most (\d\.\d\d) of any other's", title("okajima2023-fig2-5"))
    assert all(sizes["proposed"] <= float(stated) * sizes[name] for name in "ABC")


def test_the_print_is_compared_with_the_errors_at_the_frequencies_of_the_table() -> None:
    """The extreme factors are the quotients themselves, as in the claims, whatever lies between the drawn points."""
    first, *others = data("shao-error-frequency").columns["literal_apo"]
    tripled = (first, *(3 * x for x in others))
    assert "1.00 to 3.00 times" in title("shao-error-frequency", table_apo=tripled)
    assert "1.00 to 4.00 times" in title("shao-error-frequency", table_apo=(*tripled[:-1], 4 * others[-1]))


def test_the_frequencies_of_the_table_lie_above_the_slowest_rate_of_the_printed_predictor() -> None:
    """What the caption on the lag says."""
    (rate,) = data("shao-lag").columns["rate_at_printed_ratio"]
    assert 0 < rate < min(data("shao-error-frequency").columns["table_frequency_rad_s"])


def test_extremes_keep_every_peak() -> None:
    values = data("okajima2023-fig2-5").columns["A_e_1"]
    k, kept = periods.extremes(data("okajima2023-fig2-5").columns["k"], values)
    assert (min(kept), max(kept)) == (min(values), max(values))
    assert sum(abs(e) > periods.AXIS_LIMIT for e in kept) >= 5
    assert list(k) == sorted(set(k)) and len(kept) < len(values) / 3

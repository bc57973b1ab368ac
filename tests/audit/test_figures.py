"""Figures: from results to data to files, the same bytes every time, and one failure leaves the others."""

import hashlib
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample import KEY, draw, figure, trace, write_figures
from tables import read_csv

from replication.audit.parts import FigureData
from replication.audit.run.draw import settled, to_csv
from replication.audit.store.sources import SourceTree
from replication.drawing import panels, style
from replication.errors import AuditError, InvalidInputError

LARGEST_FILE = 150_000
WHITE, NEAR_BLACK = "#ffffff", "#15181c"


def luminance(colour: str) -> float:
    """Relative luminance of an sRGB colour (WCAG 2)."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_the_same_data_give_the_same_small_files_and_a_record(tmp_path: Path) -> None:
    (record,), (again,) = (write_figures(tmp_path / run, figure()) for run in ("one", "two"))
    assert record == again and (record.name, record.paper, record.error) == ("doe1999-fig2", KEY, "")
    assert "501 steps" in record.alt
    (linked,) = write_figures(tmp_path / "two", figure(), sources=SourceTree({"tests": Path(__file__).parent}))
    assert linked.code == f"tests/sample.py:{draw.__code__.co_firstlineno}"
    (svg_file, other), (table, same) = (
        [tmp_path / run / f"doe1999-fig2.{suffix}" for run in ("one", "two")] for suffix in ("svg", "csv")
    )
    assert svg_file.read_bytes() == other.read_bytes() and table.read_bytes() == same.read_bytes()
    assert hashlib.sha256(table.read_bytes()).hexdigest() == record.csv_sha256
    assert svg_file.stat().st_size < LARGEST_FILE


def test_the_title_is_a_short_message_from_the_data_and_the_words_hold_a_number(tmp_path: Path) -> None:
    (record,) = write_figures(tmp_path, figure(title=lambda data: f"All {len(data.columns['k'])} steps"))
    assert record.title == "All 501 steps"
    for title, reason in (("word " * 16, "at most 15 words"), ("1 and 2 and 3", "at most 2 numbers")):
        (record,) = write_figures(tmp_path, figure(title=lambda data, title=title: title))
        assert reason in record.error and record.title == record.name
        (record,) = write_figures(tmp_path, figure(title=title))
        assert reason in record.error
    for text in ("", "Two curves."):
        (record,) = write_figures(tmp_path / "wordless", figure(alt=lambda data, text=text: text))
        assert "holds no number" in record.error and not (tmp_path / "wordless").exists()


def test_a_failing_figure_leaves_the_others_and_no_old_files(tmp_path: Path) -> None:
    def fail(data: FigureData) -> Any:
        raise ValueError("no axes")

    write_figures(tmp_path, figure("bad"))
    bad, good = write_figures(tmp_path, figure("bad", plot=fail), figure("good"))
    assert bad.error == "ValueError: no axes"
    assert (bad.alt, bad.csv_sha256) == ("", "")
    assert good.error == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == ["good.csv", "good.svg"]


def test_only_results_in_use_reach_the_figure(tmp_path: Path) -> None:
    seen: list[dict[str, Any]] = []

    def data(results: Any) -> FigureData:
        seen.append(dict(results))
        return trace(results)

    made = figure(uses=("doe1999.a",), data=data)
    (without,) = write_figures(tmp_path, made, results={"doe1999.b": 1})
    assert "no result of doe1999.a" in without.error
    (record,) = write_figures(tmp_path, made, results={"doe1999.a": 2, "doe1999.b": 1})
    assert record.error == ""
    assert seen == [{"a": 2}]


@given(
    st.dictionaries(
        st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Zl", "Zp")), min_size=1),
        st.lists(st.floats(allow_nan=False, allow_infinity=False)).map(tuple),
        min_size=1,
    ).filter(lambda columns: any(columns.values()))
)
def test_csv_reads_back_exactly(
    tmp_path_factory: pytest.TempPathFactory, columns: dict[str, tuple[float, ...]]
) -> None:
    path = tmp_path_factory.mktemp("csv") / "data.csv"
    path.write_bytes(to_csv(FigureData(columns=columns)))
    assert read_csv(path) == columns


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"x": (1.0, math.nan)}, "'x'"),
        ({"x": (math.inf,)}, "'x'"),
        ({}, "no data"),
        ({"x": ()}, "no data"),
    ],
)
def test_csv_refuses_no_data_and_what_is_not_finite(columns: dict[str, tuple[float, ...]], said: str) -> None:
    with pytest.raises(AuditError, match=said):
        to_csv(FigureData(columns=columns))


def test_svg_follows_the_page_and_is_self_contained(tmp_path: Path) -> None:
    write_figures(tmp_path, figure("one"), figure("two"))
    texts = {name: (tmp_path / f"{name}.svg").read_text() for name in ("one", "two")}
    ids = {name: {element.get("id") for element in ET.fromstring(text).iter()} - {None} for name, text in texts.items()}
    for name, text in texts.items():
        assert "currentColor" in text
        assert style.FOREGROUND not in text
        assert "<text" in text, "text stays text"
        assert not re.search(r"\d\.\d{3,}", text), "coordinates are rounded"
        referred = set(re.findall(r'(?:href="|url\()#([^")]+)', text))
        assert referred == ids[name]
    assert not ids["one"] & ids["two"], "two figures fit into one page"


def points_of(path: str) -> list[tuple[float, float]]:
    """Absolute points of a path of lines as `tidy` writes it."""
    points: list[tuple[float, float]] = []
    for letter, body in re.findall(r"([Ml])([^Mlz]*)", path):
        numbers = [float(number) for number in re.findall(r"-?(?:[0-9]+\.?[0-9]*|\.[0-9]+)", body)]
        for x, y in zip(numbers[::2], numbers[1::2], strict=True):
            start = points[-1] if letter == "l" else (0.0, 0.0)
            points.append((start[0] + x, start[1] + y))
    return points


@pytest.mark.parametrize(("count", "error"), [(3, 0.0051), (panels.MANY_POINTS, 0.0051), (500, 0.051)])
def test_tidied_paths_go_through_the_same_points(count: int, error: float) -> None:
    points = [(i * 0.7133, 50 * math.sin(i)) for i in range(count + 1)]
    data = "M " + " \nL ".join(f"{x:.6f} {y:.6f}" for x, y in points)
    raw = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 10 10"><path d="{data}"/></svg>'
    body = panels.inner(panels.tidy(raw, "name"))[1]
    path = re.search(r' d="([^"]*)"', body)
    assert path is not None
    assert len(path[1]) < len(data) / 2
    for tidied, point in zip(points_of(path[1]), points, strict=True):
        assert tidied == pytest.approx(point, abs=error)


def test_other_paths_keep_their_letters() -> None:
    raw = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 10 10"><g id="axes"><path d="M 1.23456 2 \nL 3.001 -4.5 '
        '\nL -0.0004 6 \nM 7 8 \nL 9 9.999 \nz"/><path d="M 0 0 \nC 1 1 2 2 3 3 \nL 4 4"/></g></svg>'
    )
    body = panels.inner(panels.tidy(raw, "name"))[1]
    assert 'd="M1.23,2l1.77-6.5-3,10.5M7,8l2,2z"' in body
    assert 'd="M0,0C1,1,2,2,3,3L4,4"' in body


def test_ids_do_not_tell_the_processor() -> None:
    """matplotlib hashes coordinates into ids; a last digit more or less must not change a committed file."""

    def drawn(names: tuple[str, str]) -> str:
        shapes = "".join(f'<clipPath id="{name}"><rect x="1" y="2" width="3" height="4"/></clipPath>' for name in names)
        lines = "".join(f'<path d="M 0 0 L 1 {k}" clip-path="url(#{name})"/>' for k, name in enumerate(names))
        return panels.tidy(f'<svg viewBox="0 0 9 9">{shapes}{lines}</svg>', "name")

    assert drawn(("p0a", "p0b")) == drawn(("p1f", "p1e"))
    assert re.findall(r'id="([^"]*)"', drawn(("p0a", "p0b"))) == ["name-1", "name-2"]


def test_groups_that_say_nothing_go_with_their_own_ends() -> None:
    groups = '<g id="a"><g clip-path="url(#c)"><g id="b"><g opacity="0.5"/><path d="M 0 0"/></g></g></g><g id="d"/>'
    raw = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"><clipPath id="c"/>{groups}</svg>'
    body = panels.inner(panels.tidy(raw, "name"))[1].replace("\n", "")
    wanted = '<g clip-path="url(#name-1)"><g opacity="0.5"/><path d="M0,0"/></g>'
    assert body == f'<clipPath id="name-1"/>{wanted}'


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        *(
            (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1">{part}</svg>', "does not take in")
            for part in (
                *("<script>1</script>", '<image href="data:,"/>', '<g onload="f()"/>'),
                '<use href="https://a.example/#b"/>',
            )
        ),
        *((text, "SVG") for text in ("", "<svg></svg>", "<p>no figure</p>")),
    ],
)
def test_svg_that_could_run_or_load_and_what_is_none_are_refused(raw: str, said: str) -> None:
    with pytest.raises(AuditError, match=said):
        panels.tidy(raw, "name")
    with pytest.raises(AuditError, match=said):
        panels.inner(raw)


def test_colours_are_those_of_the_report_and_hold_in_light_and_dark() -> None:
    css = (Path(__file__).parents[2] / "replication/audit/report/html/palette.css").read_text()
    themes = [dict(re.findall(r"(--[a-z0-9-]+): (#[0-9a-f]{6})", part)) for part in css.split("@media")[:2]]
    for theme, ground in zip(themes, (WHITE, NEAR_BLACK), strict=True):
        for colour in (style.OURS, style.GREY):
            assert contrast(theme[style.TOKENS[colour]], ground) >= 4.5, "names of curves are text"
    assert {token: colour for colour, token in style.TOKENS.items()}.items() <= themes[0].items()


def test_an_inlined_figure_takes_the_colours_of_its_page() -> None:
    raw = f'<svg viewBox="0 0 1 1"><path d="M 0 0" style="stroke: {style.OURS}; fill: #123456"/></svg>'
    alone = panels.tidy(raw, "name")
    assert style.OURS in alone and "var(" not in alone
    assert f"stroke:var(--ours,{style.OURS});fill:#123456" in panels.inner(alone)[1]


def test_house_style_leaves_the_global_settings_alone() -> None:
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    with style.house_style():
        assert mpl.rcParams["text.color"] == style.FOREGROUND
        assert len({str(style.line(index)["linestyle"]) for index in range(6)}) == 6, "curves differ without colours"
        draw(trace({}))
    assert dict(mpl.rcParams) == before


def test_axes_share_the_width_of_the_house() -> None:
    made, axes = style.new_axes(3, 2, row_height=1.0)
    assert len(axes) == 6
    assert made.get_figwidth() == style.WIDTH
    with pytest.raises(InvalidInputError, match="at least one row"):
        style.new_axes(0)


def test_data_that_agree_with_those_that_lie_there_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "f.csv"
    kept = FigureData(columns={"x": (1 / 3, 2e-9, 0.0), "y": (5.0,)})
    path.write_bytes(to_csv(kept))
    for near in ((1 / 3 + 3e-7, 2e-9, 0.0), (1 / 3, 3e-9, -2e-8)):
        assert settled(FigureData(columns={"x": near, "y": (5.0,)}), path) == kept
    for far in (
        (1 / 3 + 5e-7, 2e-9, 0.0),
        (1 / 3, 5e-8, 0.0),
        (1 / 3, 2e-9),
        (1 / 3, 2e-9, 0.0, 0.0),
        (-1 / 3, 0.0, 0.0),
    ):
        fresh = settled(FigureData(columns={"x": far, "y": (5.0,)}), path)
        assert fresh.columns["x"] == tuple(float(f"{number:.10g}") for number in far)
    assert list(settled(FigureData(columns={"x": (1.0,), "z": (5.0,)}), path).columns) == ["x", "z"]


@pytest.mark.parametrize("content", [b"", b"x,y\n1\n", b"x\none\n", b"\xff\xfe", b"x\n1\n2"[:-1]])
def test_what_is_no_table_is_not_kept(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_bytes(content)
    assert settled(FigureData(columns={"x": (2.0,)}), tmp_path / "f.csv").columns == {"x": (2.0,)}


def test_a_figure_is_drawn_from_the_data_that_are_written(tmp_path: Path) -> None:
    moved = figure("doe1999-moved", data=lambda results: FigureData(columns=shifted(0.0)))
    (first,) = write_figures(tmp_path, moved)
    files = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    again = figure("doe1999-moved", data=lambda results: FigureData(columns=shifted(1e-9)))
    assert write_figures(tmp_path, again) == (first,)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == files
    other = figure("doe1999-moved", data=lambda results: FigureData(columns=shifted(1e-3)))
    assert write_figures(tmp_path, other) != (first,)


def shifted(by: float) -> dict[str, tuple[float, ...]]:
    columns = trace({}).columns
    return {name: tuple(number + by for number in column) for name, column in columns.items()}


def test_names_stand_at_their_curves() -> None:
    with style.house_style():
        made, (axes,) = style.new_axes()
        (curve,) = axes.plot([3.0, 1.0, 2.0], [30.0, 10.0, 20.0], **style.line(0))
        style.name_line(axes, curve, "above", 1.5)
        style.name_end(axes, curve, "end")
    above, end = axes.texts
    assert (above.xy, end.xy) == ((1.5, 15.0), (2.0, 20.0))
    assert {text.get_color() for text in axes.texts} == {style.OURS}
    assert made.axes == [axes]


def test_what_leaves_the_axes_is_marked() -> None:
    with style.house_style():
        _, (axes,) = style.new_axes()
        assert style.mark_clipped(axes, [0, 1, 2, 3], [0.4, 0.6, -0.7, 0.5], 0.5, style.OURS) == 2
    high, low = axes.lines
    assert (high.get_xdata(), low.get_xdata()) == ([1], [2])


def test_decades_are_as_large_as_all_text_and_a_root_mean_square() -> None:
    said = {1e-3: "0.001", 1.0: "1", 1e3: "1000", 1e-4: "10⁻⁴", 1e5: "10⁵"}
    assert {value: style.decade(value) for value in said} == said
    assert style.rms([3.0, -4.0, 0.0, 0.0]) == pytest.approx(2.5)

"""Figures of the library's results, drawn from their panels in the house style; and every figure as SVG text.

matplotlib's SVG is tidied: unique ids, small, and ready to stand alone or inside a page.
"""

from __future__ import annotations

import hashlib
import io
import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from replication.drawing.style import BAND, FONTS, FOREGROUND, TOKENS, house_style, line, name_axes, new_axes, say
from replication.errors import AuditError

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Figure
    from matplotlib.lines import Line2D

ROW, MARK, ROOM = 52, 9, 0.25
"""Characters of a row of names, those that the mark of each takes, and the share of the axes that a row is given."""


MARKS = "o^sxv"


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over a common axis x (M,). levels: horizontal lines. steps: values are held until the next x. band: lower
    and upper end of what is shaded, each (M,) or a number. dots: values are apart, and none lies between them."""

    x: npt.NDArray[Any]
    x_label: str
    y_label: str
    lines: Mapping[str, npt.NDArray[Any]]
    levels: Mapping[str, float]
    steps: bool = False
    band: tuple[Any, Any] | None = None
    dots: bool = False


def draw(panels: Sequence[Panel]) -> Figure:
    """One set of axes for each panel, one above the other."""
    alike = len({panel.x_label for panel in panels}) == 1
    with house_style():
        height = 2.4 if len(panels) == 1 else 1.6
        figure, every = new_axes(len(panels), row_height=height, share_x=alike and len(panels) > 1)
        for axes, panel, below in zip(every, panels, (*panels[1:], None), strict=True):
            _draw_panel(axes, panel)
            if below is None or below.x_label != panel.x_label:
                axes.set_xlabel(panel.x_label)
    return figure


def _draw_panel(axes: Axes, panel: Panel) -> None:
    """The curves of one panel and its levels, each level with its name and value on it."""
    drawn = "steps-post" if panel.steps else "default"

    def apart(i: int) -> dict[str, Any]:
        """Another mark for each curve, if its values are."""
        return {"linestyle": "none", "marker": MARKS[i % len(MARKS)], "markersize": 2.5} if panel.dots else {}

    if panel.band:
        axes.fill_between(panel.x, *panel.band, facecolor=BAND, alpha=0.55, linewidth=0, zorder=0)
    curves = [
        axes.plot(panel.x, values, label=name, drawstyle=drawn, **line(i) | apart(i))[0]
        for i, (name, values) in enumerate(panel.lines.items())
    ]
    for i, (name, level) in enumerate(panel.levels.items(), start=len(panel.lines)):
        axes.axhline(level, label=name, **line(i))
        highest = level == max(panel.levels.values())
        say(axes, f"{name} {level:.4g}", (panel.x[0], level), side=1 if highest else -1, ha="left")
    if panel.levels:
        # A gain is told against zero: a curve that is flat to rounding then looks flat, too.
        top = max(*panel.levels.values(), *(max(values) for values in panel.lines.values()))
        axes.set_ylim(0, 1.2 * top)
    name_axes(axes, panel.y_label)
    if len(curves) > 1:
        _legend(axes, curves)


def _legend(axes: Axes, curves: Sequence[Line2D]) -> None:
    """The names in rows above the curves, with room made for them: no curve runs through a name."""
    names = [str(curve.get_label()) for curve in curves]
    columns = next(count for count in (len(names), 2, 1) if count == 1 or _width(names, count) <= ROW)
    low, high = axes.get_ylim()
    rows = -(-len(names) // columns)
    axes.set_ylim(low, high + rows * ROOM * (high - low))
    axes.legend(handles=curves, loc="upper left", ncols=columns)


def _width(names: Sequence[str], columns: int) -> int:
    """Characters of a row of names with their marks, each as wide as the widest of its column."""
    rows = -(-len(names) // columns)
    return sum(MARK + max(map(len, names[i : i + rows])) for i in range(0, len(names), rows))


def as_svg(figure: Figure, name: str) -> str:
    """A figure in the house style as a small stand-alone SVG file, the same bytes every time; `name` starts its ids."""
    import matplotlib as mpl

    with house_style(), mpl.rc_context({"svg.hashsalt": name}):
        stream = io.StringIO()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return tidy(stream.getvalue(), name)


DECIMALS = 2
"""Coordinates are rounded to this many decimals of a point (1/72 inch): far below what a screen or a printer shows."""

MANY_POINTS, CURVE_DECIMALS = 60, 1
"""A line through more points than that is a curve of data; a tenth of a point is then still less than its width."""

STANDALONE = "background:#fff;color:#1c1f23"
"""Paper and ink of a figure opened by itself; an inlined one takes both from its page."""

JOINS = 'stroke-linejoin="round" stroke-linecap="butt"'
"""matplotlib's defaults, which it writes as a rule for every element: inlined, that rule would reach the whole page."""

_ROOT = re.compile(r"<svg\b[^>]*>")
_NUMBER = re.compile(r"-?[0-9]+\.[0-9]+(?:e-?[0-9]+)?")
_FOREIGN = re.compile(
    r"""<(?:script|foreignObject|image|style|a)\b|\son[a-z]+=|href="(?!#)|url\((?!#)|@import|<[!?]""", re.IGNORECASE
)
_COLOUR = re.compile("|".join(TOKENS))
_PLAIN_STYLE = re.compile(r""" style="([\w\s#:;.,'%()-]+)\"""")
_GEOMETRY = re.compile(r'(?<![\w-])(?:x|y|x1|y1|x2|y2|width|height|cx|cy|r|points|transform)="[^"]*"')


def tidy(raw: str, prefix: str) -> str:
    """Return matplotlib's SVG `raw` as a small stand-alone file whose ids all start with `prefix`.

    The foreground of the house style becomes `currentColor`, coordinates are rounded, metadata go.
    Raises AuditError if `raw` is not one SVG element, or could run or load anything (an image, for example).
    """
    root = _ROOT.search(raw)
    view_box = re.search(r'viewBox="([-0-9. ]+)"', root.group()) if root else None
    if root is None or view_box is None or not raw.rstrip().endswith("</svg>"):
        raise AuditError(f"figure {prefix} is not an SVG element with a viewBox; draw it with matplotlib's SVG backend")
    body = raw[root.end() :]
    body = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", "", body, flags=re.DOTALL)
    body = _with_prefix(body.replace("xlink:href", "href"), prefix)
    body = body.replace(FOREGROUND, "currentColor")
    body = body.replace(f"'{FONTS[0]}'", f"'{FONTS[0]}', {FONTS[1]}")
    body = _GEOMETRY.sub(lambda match: _rounded(match.group()), body)
    body = re.sub(r'(?<![\w-])d="([^"]*)"', lambda match: f'd="{_short_path(match[1])}"', body)
    body = re.sub(r'<path d="[^"]*" style="fill:\s*none"/>|<g/>', "", body)
    body = re.sub(r' transform="rotate\(-?0 [^"]*"', "", body)
    body = _without_bare_groups(re.sub(r">\s+<", ">\n<", re.sub(r"<defs>\s*</defs>", "", body)))
    body = re.sub(r"(?<=[;:]) (?=[^\"<>]*\"/?>)", "", body)
    body = re.sub(r"\n\s*\n", "\n", body).strip()
    _refuse_foreign(body)
    width, height = view_box[1].split()[2:]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{_rounded(view_box[1])}" '
        f'width="{_rounded(width)}pt" height="{_rounded(height)}pt" {JOINS} style="{STANDALONE}">'
    )
    return head + body + "\n"


def inner(standalone: str) -> tuple[str, str]:
    """Return the viewBox and the content of a file made by `tidy`, for a page whose own <svg> tag carries `JOINS`.

    The colours of the house style become those of the page's style sheet, where it has them.
    Raises AuditError if the text is not such a file, or could run or load anything.
    """
    match = re.fullmatch(r'<svg [^>]*viewBox="([-0-9. ]+)"[^>]*>(.*)</svg>\s*', standalone, flags=re.DOTALL)
    if match is None:
        raise AuditError("a figure is not an SVG file as `replication run` writes it; run `python -m replication run`")
    _refuse_foreign(match[2])
    return match[1], _COLOUR.sub(lambda colour: f"var({TOKENS[colour[0]]},{colour[0]})", match[2].strip())


def with_classes(content: str) -> tuple[str, dict[str, str]]:
    """The content of a drawing with classes for its styles, which repeat a lot, and the rules of the classes."""
    rules: dict[str, str] = {}

    def named(match: re.Match[str]) -> str:
        name = "f" + hashlib.sha256(match[1].encode()).hexdigest()[:6]
        rules[name] = match[1]
        return f' class="{name}"'

    return _PLAIN_STYLE.sub(named, content), rules


def _refuse_foreign(body: str) -> None:
    foreign = _FOREIGN.search(body)
    if foreign:
        raise AuditError(f"a figure holds {foreign.group()!r}, which the report does not take in; draw lines and text")


def _with_prefix(body: str, prefix: str) -> str:
    """Two figures inlined into one page share a name space: ids get the name of their figure, unused ones go.

    matplotlib hashes coordinates into its ids, with digits that differ between processors: they are counted instead.
    """
    used = set(re.findall(r'(?:href="|url\()#([^")]+)', body))
    defined = [name for name in dict.fromkeys(re.findall(r' id="([^"]*)"', body)) if name in used]
    names = {name: f"{prefix}-{k}" for k, name in enumerate(defined, start=1)}
    body = re.sub(r' id="([^"]*)"', lambda match: f' id="{names[match[1]]}"' if match[1] in used else "", body)
    return re.sub(r'(href="|url\()#([^")]+)', lambda match: f"{match[1]}#{names.get(match[2], match[2])}", body)


def _without_bare_groups(body: str) -> str:
    """Groups that lost their id carry nothing; an opened one is remembered, so that its own end goes with it."""
    bare: list[bool] = []

    def keep(match: re.Match[str]) -> str:
        if match.group() != "</g>":
            bare.append(match.group() == "<g>")
            return "" if bare[-1] else match.group()
        return "" if bare.pop() else match.group()

    return re.sub(r"<g(?: [^>]*[^/])?>|</g>", keep, body)


def _rounded(text: str) -> str:
    return _NUMBER.sub(lambda match: _short(float(match.group())), text)


def _short(number: float) -> str:
    text = f"{number:.{DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _short_path(data: str) -> str:
    """A path in fewer characters: straight lines as steps from point to point, numbers parted by commas only.

    A comma needs no escape in a data URI. A path of many points is a curve, which `CURVE_DECIMALS` serve.
    """
    data = re.sub(r"\s*([A-Za-z])\s*", r"\1", data.strip())
    if re.search("[QCSTAHV]", data, re.IGNORECASE):
        return re.sub(r"\s+", ",", _rounded(data))
    decimals = CURVE_DECIMALS if data.count("L") > MANY_POINTS else DECIMALS
    return "".join(_steps(part, decimals) for part in re.findall(r"M[^Mz]*|z", data))


def _steps(part: str, decimals: int) -> str:
    """One run of lines as its start and relative steps; they do not drift, because the points are rounded first."""
    if part == "z":
        return part
    numbers = [round(float(number) * 10**decimals) for number in part[1:].replace("L", " ").split()]
    points = list(zip(numbers[::2], numbers[1::2], strict=True))
    steps = [axis for (x, y), (u, v) in itertools.pairwise(points) for axis in (u - x, v - y)]
    start, rest = ([_short(number / 10**decimals) for number in group] for group in (points[0], steps))
    text = f"M{','.join(start)}" + (f"l{','.join(rest)}" if rest else "")
    return re.sub(r",-", "-", re.sub(r"(?<![0-9])0\.", ".", text))

"""Figures as SVG text: tidied after matplotlib, unique ids, small, and ready to stand alone or inside a page."""

import hashlib
import itertools
import re

from replication.drawing.style import FONTS, FOREGROUND, TOKENS
from replication.errors import AuditError

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

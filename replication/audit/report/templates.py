"""The templates of the report: one file `html/<name>.html.j2` for each section; formulas as MathML, terms as links.

A paper adds terms of its own in its brief.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

import msgspec
from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup, escape

from replication.audit.data import words
from replication.audit.judge import numerals
from replication.audit.model import Verdict
from replication.audit.report.claim import anchor
from replication.audit.store.records import PaperRecord
from replication.errors import AuditError
from replication.verify.predicate import in_words

VERDICTS = {Verdict(name): text for name, text in words("verdicts").items()}
TERMS = words("terms")
_FORMS = {"hold, possible, fail, undetermined": "possible|undetermined"}
"""How a term is met in a text, where it is not itself or its plural."""
_MARKED = re.compile(r"(<[^>]*>)")
_TAG = re.compile(r"</?([a-z][a-z0-9]*)")
_UNTOUCHED = frozenset("a button h1 h2 h3 h4 svg math script style summary label code nav dt th caption".split())  # noqa: SIM905
"""Elements in which no link is put."""


def terms(papers: Iterable[PaperRecord]) -> dict[str, str]:
    """The terms of the report, and those that these papers add, in the order in which the results file has them."""
    briefs = (paper.brief for paper in papers if paper.brief is not None)
    return TERMS | {term: text for brief in briefs for term, text in sorted(brief.terms.items())}


def word(term: str) -> str:
    """The id of the entry of a term."""
    return anchor("word", term.partition(",")[0].replace(" ", "-"))


def linked(html: str, known: Mapping[str, str]) -> Markup:
    """A page with the first mention of each of the terms as a link to its meaning."""
    forms = (rf"(?P<t{i}>{_FORMS.get(term, re.escape(term) + 's?')})" for i, term in enumerate(known))
    pattern = re.compile(rf"(?<![\w-])(?:{'|'.join(forms)})(?![\w-])", re.IGNORECASE)
    ids = [word(term) for term in known]
    met: set[int] = set()

    def link(match: re.Match[str]) -> str:
        index = int(str(match.lastgroup)[1:])
        if index in met:
            return match[0]
        met.add(index)
        return f'<a class="term" href="#{ids[index]}">{match[0]}</a>'

    parts: list[str] = []
    untouched = 0
    for part in _MARKED.split(html):
        tag = _TAG.match(part)
        if tag is not None and tag[1] in _UNTOUCHED and not part.endswith("/>"):
            untouched += -1 if part.startswith("</") else 1
        parts.append(part if untouched or tag is not None or part.startswith("<") else pattern.sub(link, part))
    return Markup("".join(parts))


_INLINE = re.compile(r"(?<![\\$\w])\$(?!\s)([^$\n]+?)(?<!\s)\$(?!\w)")
_ELEMENT = re.compile(r"\{http://www\.w3\.org/1998/Math/MathML\}m[a-z]+")
_ATTRIBUTE = re.compile(r"(?!on|href|src)[a-z]+", re.IGNORECASE)

_GREEK = {
    "alpha": "α", "gamma": "γ", "mu": "μ", "tau": "τ", "theta": "θ", "Gamma": "Γ", "Sigma": "Σ",
}  # fmt: skip
_LETTER = rf"(?:{'|'.join(_GREEK)}|[^\W\d_])[\u0300-\u036f]*"
_INDEX = rf"\{{[^{{}}]*\}}|(?:{'|'.join(_GREEK)}|[A-Za-z]{{1,4}}\d*(?:,[A-Z]−\d)?)(?![A-Za-z_])|\d+[ijkn]*|[α-ω]"
_POWER = r"\{[^{}]*\}|\((?:[^()]|\([^()]*\))*\)|[-−]?(?:\d+|\w)"
_SET = re.compile(
    rf"`(?P<code>[^`]+)`|(?<![A-Za-z_])(?P<of>(?:d|[A-Z]{{1,2}})?{_LETTER})_(?P<index>{_INDEX})|(?<=[\w)|}}\]])\^(?P<power>{_POWER})|"
    r"(?<!\w)(?P<name>[A-Za-z][A-Za-z0-9]*(?:_[A-Za-z0-9]+)+)(?!\w)"
)

# The converter lets the fences of these matrices stay small, and stretches those after \\left and \\right.
_FENCED = (
    (r"\begin{bmatrix}", r"\left[\begin{matrix}"),
    (r"\end{bmatrix}", r"\end{matrix}\right]"),
    (r"\begin{pmatrix}", r"\left(\begin{matrix}"),
    (r"\end{pmatrix}", r"\end{matrix}\right)"),
)


def mathml(latex: str) -> Markup:
    """`latex` as MathML in display style.

    Raises AuditError that names the formula if it cannot be set, or gives anything but MathML: the converter takes the
    text of `\\text{...}` over as it is.
    """
    import latex2mathml.converter
    import latex2mathml.exceptions

    source = latex
    for short, fenced in _FENCED:
        source = source.replace(short, fenced)
    try:
        text = latex2mathml.converter.convert(source, display="block")
        elements = list(ET.fromstring(text).iter())
    except (latex2mathml.exceptions.NoAvailableTokensError, ET.ParseError, ValueError, LookupError, TypeError) as error:
        raise AuditError(f"the formula {latex!r} cannot be set as MathML: {error!r}; simplify its LaTeX") from error
    for element in elements:
        if not _ELEMENT.fullmatch(str(element.tag)) or not all(map(_ATTRIBUTE.fullmatch, element.attrib)):
            raise AuditError(f"the formula {latex!r} brings {element.tag!r} into the page; write it in plain LaTeX")
    return Markup(text)


def set_inline(text: str) -> str:
    """Markdown with the formulas between single dollar signs as MathML in the line; raises as `mathml`."""
    return _INLINE.sub(lambda match: mathml(match[1]).replace('display="block"', 'display="inline"'), text)


def prose(text: str) -> Markup:
    """A sentence with indices and powers set, as in "A_e" and "e^{At}"; names of a program and backticks are code."""
    parts, end = [], 0
    for match in _SET.finditer(text):
        parts += [escape(text[end : match.start()]), _set(match)]
        end = match.end()
    return Markup("").join([*parts, escape(text[end:])])


def _set(match: re.Match[str]) -> Markup:
    if match["of"]:
        of, index = match["of"], _bare(match["index"])
        return Markup("{}<sub>{}</sub>").format(_GREEK.get(of, of), _GREEK.get(index, index))
    if match["power"]:
        return Markup("<sup>{}</sup>").format(prose(_bare(match["power"])))
    return Markup("<code>{}</code>").format(match["code"] or match["name"])


def _bare(text: str) -> str:
    """An index or a power without the brackets that keep it together."""
    return text[1:-1] if text[0] in "{(" else text.replace("-", "−")


SOURCES = Path(__file__).resolve().parent / "html"
"""Templates, style sheet and script."""

_UNSEEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ufdd0-\ufdef\ufffe\uffff]")
_PATH = re.compile(r"[A-Za-z0-9_./-]+")
_CODE = re.compile(rf"({_PATH.pattern}):([0-9]+)")


def source(name: str) -> str:
    """The text of one of the sources of the report; raises AuditError if it is missing."""
    try:
        return (SOURCES / name).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise AuditError(f"{SOURCES / name} is missing; install the package again") from None


def style_sheet(more: str) -> Markup:
    """The style of every page of ours, on screen and on paper, with one sheet more, and without indentation."""
    return Markup(re.sub(r"\n\s+", "\n", "".join(map(source, ("palette.css", "style.css", "print.css", more)))))


@cache
def environment() -> Environment:
    """Templates in which a value that is forgotten or None is an error, and every string is text."""
    templates = Environment(
        loader=FunctionLoader(source),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        finalize=_shown,
    )
    templates.filters |= {
        "short": numerals.short,
        "rough": numerals.rough,
        "in_words": in_words,
        "prose": lambda text: prose(seen(text)),
        "full": numerals.full,
        "signed": numerals.signed,
        "seconds": numerals.seconds,
        "layout": numerals.layout,
        "bound_below": partial(numerals.layout, write=partial(numerals.at_least, digits=numerals.SHOWN)),
        "bound_above": partial(numerals.layout, write=partial(numerals.at_most, digits=numerals.SHOWN)),
        "anchor": lambda name, kind: anchor(kind, name),
        "slug": lambda verdict: str(verdict).replace(" ", "-"),
        "exact": numerals.exact,
        "linked": linked,
        "word": word,
        "code_link": code_link,
        "file_link": file_link,
        "pretty": lambda value: msgspec.json.format(
            msgspec.json.encode(value, order="deterministic"), indent=2
        ).decode(),
    }
    return templates


def seen(text: str) -> str:
    """`text` without what HTML cannot hold."""
    return _UNSEEN.sub("\N{REPLACEMENT CHARACTER}", text)


def code_link(code: str, root: str) -> str:
    """Address of `file:line` from the folder of the report; empty if `code` is not of that form."""
    match = _CODE.fullmatch(code)
    return f"{root}{match[1]}#L{match[2]}" if match else ""


def file_link(path: str, root: str) -> str:
    """Address of a file of the project from the folder of the report; empty if `path` is not a plain path."""
    return f"{root}{path}" if _PATH.fullmatch(path) else ""


def _shown(value: Any) -> Any:
    """Refuse a forgotten value, and keep out of the page what HTML cannot hold."""
    if value is None:
        raise AuditError("the template shows a value that is None; give it a condition")
    return seen(value) if type(value) is str else value

"""Formulas as MathML, which every browser sets without a script; indices and powers inside a sentence."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

from markupsafe import Markup, escape

from replication.errors import AuditError

_INLINE = re.compile(r"(?<![\\$\w])\$(?!\s)([^$\n]+?)(?<!\s)\$(?!\w)")
_ELEMENT = re.compile(r"\{http://www\.w3\.org/1998/Math/MathML\}m[a-z]+")
_ATTRIBUTE = re.compile(r"(?!on|href|src)[a-z]+", re.IGNORECASE)

_GREEK = {
    "alpha": "α", "gamma": "γ", "mu": "μ", "tau": "τ", "theta": "θ", "Gamma": "Γ", "Sigma": "Σ",
}  # fmt: skip
_LETTER = rf"(?:{'|'.join(_GREEK)}|[^\W\d_])[\u0300-\u036f]*"
_INDEX = rf"\{{[^{{}}]*\}}|(?:{'|'.join(_GREEK)}|[A-Za-z]{{1,4}}\d*(?:,[A-Z]−\d)?)(?![A-Za-z_])|\d+[ijkn]*|[α-ω]"
_POWER = r"\{[^{}]*\}|\((?:[^()]|\([^()]*\))*\)|-?\w"
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
    return _INLINE.sub(lambda found: mathml(found[1]).replace('display="block"', 'display="inline"'), text)


def prose(text: str) -> Markup:
    """A sentence with indices and powers set, as in "A_e" and "e^{At}"; names of a program and backticks are code."""
    parts, end = [], 0
    for found in _SET.finditer(text):
        parts += [escape(text[end : found.start()]), _set(found)]
        end = found.end()
    return Markup("").join([*parts, escape(text[end:])])


def _set(found: re.Match[str]) -> Markup:
    if found["of"]:
        return Markup("{}<sub>{}</sub>").format(_letter(found["of"]), _letter(_bare(found["index"])))
    if found["power"]:
        return Markup("<sup>{}</sup>").format(prose(_bare(found["power"])))
    return Markup("<code>{}</code>").format(found["code"] or found["name"])


def _bare(text: str) -> str:
    """An index or a power without the brackets that keep it together."""
    return text[1:-1] if text[0] in "{(" else text.replace("-", "−")


def _letter(name: str) -> str:
    """A Greek letter for its name."""
    return _GREEK.get(name, name)

"""Forms in which fields write a number, brought to the few that `printed` reads, and what to write for any other.

LaTeX, a name before a number and marks behind it are taken away; what stands for an uncertainty is read.
"""

import re
from decimal import Decimal

from replication.audit.data import words

UNSIGNED = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,2})?"
"""Two digits of exponent keep a typing slip such as 1e99999999 from filling the memory."""
REAL = rf"[+-]?{UNSIGNED}"

_PLAINER = tuple(
    (re.compile(pattern), plain)
    for pattern, plain in (
        (r"−", "-"),
        (r"\\(?:math\w\w|text(?:bf|it|rm)?|boldsymbol|bm)\s*\{([^{}]*)\}", r"\1"),
        (r"\\pm(?![A-Za-z])", "±"),
        (r"\\(?:times|cdot)(?![A-Za-z])\s*", "×"),
        (r"\\leq?(?:slant)?(?![A-Za-z])", "≤"),
        (r"\\geq?(?:slant)?(?![A-Za-z])", "≥"),
        (r"\\(?:sim|approx)(?![A-Za-z])", "~"),
        (r"\\(?:left|right)(?![A-Za-z])|^\\\(|\\\)$|\\!", ""),
        (r"\\([%&#$])", r"\1"),
        (r"\\[,;: ]|(?<=[0-9}])~(?=[0-9±(\[])", " "),
        (r"\{([-+,])\}", r"\1"),
        # A name before a relation: p = 0.75, R² = 0.9, t(24) < 2.1.
        (r"^\s*[^\W\d][\w^{}\\]*\s*(?:\([^()]*\))?\s*(?:=\s*|(?=[<>≤≥]))", ""),
        # Marks behind a number: stars of significance, signs and letters of notes.
        (r"(?<=[0-9)\]}%])\s*(?:\^\s*\{?\s*(?:\*+|\\(?:ast|dagger)\b|[†‡a-d])\s*\}?|\*{1,4}|[†‡§¶]+)\s*$", ""),
        (r"(?:\s*(?:%|per ?cent)|(?<=[0-9])\*{1,4}(?=\s))(?=\s*(?:±|\+/-|\[|\())", ""),
    )
)
_LAST = re.compile(r"([+-]?[0-9]+(?:\.[0-9]*)?|[+-]?\.[0-9]+)\(([0-9]{1,3})\)((?:[eE][+-]?[0-9]{1,2})?)")
_SPREAD = re.compile(rf"({REAL})\s*(?:±|\+/-)\s*({UNSIGNED})")
_ERROR = re.compile(rf"({REAL})\s+\(([0-9]*\.[0-9]+)\)")
_TIMES = re.compile(r"\(([^()]*)\)([eE][+-]?[0-9]{1,2})")
_APART = tuple(
    re.compile(rf"({REAL})\s*{apart}")
    for apart in (
        rf"\^\s*\{{?\s*\+\s*(?P<above>{UNSIGNED})\s*\}}?\s*_\s*\{{?\s*-\s*(?P<below>{UNSIGNED})\s*\}}?",
        rf"_\s*\{{?\s*-\s*(?P<below>{UNSIGNED})\s*\}}?\s*\^\s*\{{?\s*\+\s*(?P<above>{UNSIGNED})\s*\}}?",
        rf"\(?\s*\+\s*(?P<above>{UNSIGNED})\s*[/,;]?\s*-\s*(?P<below>{UNSIGNED})\s*\)?",
    )
)
_LEVEL = r"(?:([0-9.]+)\s*%\s*)?(?:(?:CI|CrI|HDI|confidence interval)\b)?\s*[:,]?\s*"
_LIMITS = re.compile(rf"({REAL})\s*[\[(]\s*{_LEVEL}({REAL})\s*(?:,|;|–|—|-|\bto\b)\s*({REAL})\s*[\])]")

_COMMA, _THOUSANDS = (
    re.compile(r"(?<=[0-9]),(?=[0-9])"),
    re.compile(r"(?<![0-9,])[1-9][0-9]{0,2}(?:,[0-9]{3})+(?![0-9,])"),
)

ADVICE = words("advice")
"""By what stands in a text that is no number, what may be meant, and what to write for it."""


def simplified(text: str) -> str:
    """The text without LaTeX, names and marks, with hyphens for minus signs."""
    plain = text.replace("$", "") if text.count("$") % 2 == 0 else text
    for pattern, instead in _PLAINER:
        plain = pattern.sub(instead, plain)
    return plain.strip()


def with_spread(body: str) -> tuple[str, Decimal, Decimal, tuple[str, ...]] | None:
    """The number of a simplified print, and how far its uncertainty reaches down and up; None where there is none.

    Last the numbers that are printed for the uncertainty: one, two sides, or two limits.
    """
    scaled = _TIMES.fullmatch(body)
    if scaled is not None and (inner := with_spread(scaled[1])) is not None:
        times = Decimal(f"1{scaled[2]}")
        texts = tuple(f"{number}{scaled[2]}" for number in (inner[0], *inner[3]))
        return texts[0], inner[1] * times, inner[2] * times, texts[1:]
    if (last := _LAST.fullmatch(body)) is not None:
        number = last[1] + last[3]
        both = int(last[2]) * Decimal(1).scaleb(int(Decimal(number).as_tuple().exponent))
        return number, both, both, (str(both),)
    if (beside := _SPREAD.fullmatch(body) or _ERROR.fullmatch(body)) is not None:
        return beside[1], Decimal(beside[2]), Decimal(beside[2]), (beside[2],)
    for form in _APART:
        if (apart := form.fullmatch(body)) is not None:
            sides = apart["below"], apart["above"]
            return apart[1], Decimal(sides[0]), Decimal(sides[1]), sides
    if (limits := _LIMITS.fullmatch(body)) is not None:
        below, above = Decimal(limits[1]) - Decimal(limits[3]), Decimal(limits[4]) - Decimal(limits[1])
        return limits[1], below, above, (limits[3], limits[4])
    plain = _THOUSANDS.sub(lambda match: match[0].replace(",", ""), body)
    if plain == body and "." not in body:
        plain = _COMMA.sub(".", body)
    return None if plain == body or _COMMA.search(plain) else with_spread(plain)


def level_of(text: str) -> str:
    """The level of the limits that a print names itself, such as `95 %`; empty if it names none."""
    limits = _LIMITS.fullmatch(simplified(text))
    return f"{limits[2]} %" if limits is not None and limits[2] else ""

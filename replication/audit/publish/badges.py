"""SVG badges: what an audit came to, as a word and a shape, so that no reader depends on colour."""

from __future__ import annotations

import html
from collections.abc import Iterable

from replication.audit.inspect.headline import counts
from replication.audit.model import Verdict
from replication.audit.store.records import ClaimRecord

HEIGHT, PADDING, MARK = 20, 7, 16
CHARACTER = 6.6
"""Width in pixels that one character of 11 px text is given; `textLength` then makes the text as wide as its box."""

GOOD, BAD = "#0b6b46", "#a11d2f"
"""Both with a contrast of more than 4.5:1 to white text."""

TICK, CROSS = "M4 10.5l3.5 3.5l6-8", "M4.5 5.5l8 8m0-8l-8 8"


def badge(label: str, claims: Iterable[ClaimRecord]) -> str:
    """One badge: how many of the claims that could be checked agree, and whether every verdict is the pinned one.

    A tick says that nothing is off its pin, a cross that something is; a known disagreement is no defect of the audit.
    """
    chosen = tuple(claims)
    found = counts(chosen)
    checked = len(chosen) - found[Verdict.NOT_CHECKABLE] - found[Verdict.ERROR]
    agree = found[Verdict.REPRODUCED] + found[Verdict.REPRODUCED_AFTER_ERRATUM] + found[Verdict.CONSISTENT]
    moved = sum(claim.unexpected for claim in chosen)
    text = f"{moved} off the pin" if moved else f"{agree} of {checked} agree"
    return draw(label, text, fine=not moved)


def draw(label: str, text: str, *, fine: bool) -> str:
    """A badge of two boxes as stand-alone SVG: `label`, then a tick or a cross and `text`."""
    left = _width(label)
    right = _width(text) + MARK
    full = html.escape(f"{label}: {text}")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + right:g}" height="{HEIGHT}" role="img" '
        f'aria-label="{full}"><title>{full}</title>'
        f'<rect width="{left + right:g}" height="{HEIGHT}" rx="3" fill="#3a3f45"/>'
        f'<path d="M{left:g} 0h{right - 3:g}a3 3 0 0 1 3 3v{HEIGHT - 6}a3 3 0 0 1-3 3h-{right - 3:g}z" '
        f'fill="{GOOD if fine else BAD}"/>'
        f'<path d="{TICK if fine else CROSS}" transform="translate({left:g})" fill="none" stroke="#fff" '
        f'stroke-width="2"/>'
        f'<g fill="#fff" font-family="Verdana,DejaVu Sans,sans-serif" font-size="11">'
        f"{_text(label, PADDING)}{_text(text, left + MARK)}</g></svg>\n"
    )


def _width(text: str) -> float:
    return CHARACTER * len(text) + 2 * PADDING


def _text(text: str, x: float) -> str:
    return f'<text x="{x:g}" y="14" textLength="{CHARACTER * len(text):g}">{html.escape(text)}</text>'

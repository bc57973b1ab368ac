"""Sentences that a reader can take in: few words and few numbers; names that hold a number do not count as one."""

from __future__ import annotations

import re

from replication.errors import AuditError

MOST_WORDS, MOST_WORDS_OF_TITLE, MOST_NUMBERS = 25, 15, 2

LINK = re.compile(r"\[([^\[\]]+)\]\(([+\-?]?)([\w.\-]+)\)")
"""`[words](name)`: words that link a claim or an erratum, perhaps with a sign of what they say of it."""

_NAMED = re.compile(
    r"\b(?:Theorem|Lemma|Corollary|Algorithm|Example|Table|Section|Sec|Fig|Case|step|eq|degree|column|period)s?\.?\s+"
    r"[\dIVX]+(?:(?:\s*[-–,]\s*|\s+(?:and|or)\s+)\d+)*|[(\[][\d,\s]+[)\]]",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"(?<![\w.])\d+(?:,\d{3})*(?:\.\d+)?(?:×10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+|e[-+]?\d+)?|(?<![\w.])\.\d+")


def require_short(sentence: str, most_words: int = MOST_WORDS, what: str = "finding") -> str:
    """`sentence` itself; AuditError that says by how much it is too long, or has too many numbers.

    Links count as their words. Theorem 3, degree 2 or (34) is a name, no number.
    """
    text = LINK.sub(r"\1", sentence)
    words, numbers = text.split(), _NUMBER.findall(_NAMED.sub(" ", text))
    if len(words) > most_words:
        raise AuditError(
            f"a {what} has at most {most_words} words, this one {len(words)}: {text!r}; shorten or split it"
        )
    if len(numbers) > MOST_NUMBERS:
        raise AuditError(
            f"a {what} has at most {MOST_NUMBERS} numbers, this one {', '.join(numbers)}: {text!r}; say it with fewer"
        )
    return sentence


def require_title(title: str) -> str:
    """The same for the title of a figure or picture, which is its message."""
    return require_short(title, MOST_WORDS_OF_TITLE, "title")

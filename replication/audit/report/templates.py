"""The templates of the report: one file `html/<name>.html.j2` for each section, with the words and no number."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from replication.audit.judge import numerals
from replication.audit.report.claim import anchor
from replication.audit.report.formulas import prose
from replication.errors import AuditError
from replication.verify.predicate import in_words

SOURCES = Path(__file__).resolve().parent / "html"
"""Templates, style sheet and script."""

CLAIM_CELL = "claim:"
"""How the cell of a table begins that stands for a claim."""


def claim_of(cell: str) -> str:
    """The id of the claim that a cell of a table stands for; empty if it is a text."""
    return cell.removeprefix(CLAIM_CELL).partition("|")[0] if cell.startswith(CLAIM_CELL) else ""


_UNSEEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ufdd0-\ufdef\ufffe\uffff]")
_PATH = re.compile(r"[A-Za-z0-9_./-]+")
_CODE = re.compile(rf"({_PATH.pattern}):([0-9]+)")


def source(name: str) -> str:
    """The text of one of the sources of the report; raises AuditError if it is missing."""
    try:
        return (SOURCES / name).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise AuditError(f"{SOURCES / name} is missing; install the package again") from None


def style_sheet() -> str:
    """The style of every page of ours, on screen and on paper."""
    return source("style.css") + source("print.css")


def environment() -> Environment:
    """Templates in which a value that is forgotten or None is an error, and every string is text."""
    source("template.html.j2")
    made = Environment(
        loader=FileSystemLoader(SOURCES),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        finalize=_shown,
    )
    made.filters |= {
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
        "code_link": code_link,
        "file_link": file_link,
        "pretty": lambda value: msgspec.json.format(
            msgspec.json.encode(value, order="deterministic"), indent=2
        ).decode(),
    }
    return made


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

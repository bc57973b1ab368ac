"""Hook of the documentation site: what is wide may scroll; colours of the report; index of the search."""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from replication.audit.publish.notebooks import colours
from replication.audit.report.templates import source

HEADINGS = ("h1", "h2", "h3", "h4")
PERMALINK = "#"
UNREAD = ("svg", "math", "style", "script")
"""Drawings and formulas are not searched."""
INLINE = ("span", "a", "code", "em", "strong", "b", "i", "sub", "sup")

_sections: list[Section] = []


@dataclass
class Section:
    """What the search finds: page and heading, where they are, and the words below."""

    page: str
    heading: str
    address: str
    text: str = ""


def on_pre_build(**_: Any) -> None:
    """Forget the sections of the build before."""
    _sections.clear()


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Wrap the tables, and note the words of the page."""
    reader = _Reader(str(page.title), str(page.url))
    reader.feed(html)
    _sections.extend(reader.sections)
    html = re.sub(r"<th( [^>]*)?></th>", "<td></td>", html)  # a corner that heads nothing
    return re.sub(r"(<table\b.*?</table>)", r'<div class="scroll">\1</div>', html, flags=re.DOTALL)


def on_post_build(config: Any) -> None:
    """Write the colours, and the index as a script, which a page that was opened as a file may load."""
    site = Path(config.site_dir)
    found = [asdict(section) | {"text": " ".join(section.text.split())} for section in _sections]
    (site / "index.js").write_text(f"window.searchIndex = {json.dumps(found, ensure_ascii=False)};\n", encoding="utf-8")
    (site / "palette.css").write_text(colours(), encoding="utf-8")
    (site / "site.css").write_text(source("site.css"), encoding="utf-8")


class _Reader(HTMLParser):
    """The sections of a page, each from one heading to the next."""

    def __init__(self, title: str, url: str) -> None:
        super().__init__()
        self.title, self.url = title, url
        self.sections = [Section(title, title, url)]
        self.inside: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._part(tag)
        anchor = dict(attrs).get("id")
        if tag in HEADINGS and anchor:
            self.sections.append(Section(self.title, "", f"{self.url}#{anchor}"))
        if tag in (*HEADINGS, *UNREAD):
            self.inside.append(tag)

    def handle_endtag(self, tag: str) -> None:
        self._part(tag)
        if self.inside and self.inside[-1] == tag:
            self.inside.pop()

    def _part(self, tag: str) -> None:
        """Words of two paragraphs, items or cells are two words; code that is coloured stays in one piece."""
        if tag not in INLINE:
            self.sections[-1].text += " "

    def handle_data(self, data: str) -> None:
        where = self.inside[-1] if self.inside else ""
        if where in UNREAD or data == PERMALINK:
            return
        section = self.sections[-1]
        if where in HEADINGS and section.address != self.url:
            section.heading += data
        else:
            section.text += data

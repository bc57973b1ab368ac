"""Hook of the documentation site: formulas between dollar signs become MathML, which needs no script and no network."""

from __future__ import annotations

import re
from typing import Any

from replication.audit.report.templates import mathml, set_inline

_CODE = re.compile(r"(^```.*?^```|`[^`\n]+`)", re.DOTALL | re.MULTILINE)
_DISPLAY = re.compile(r"\$\$(.+?)\$\$", re.DOTALL)
_AT_START = re.compile(r"^( *)(<math\b.*?</math>)", re.DOTALL | re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the formulas of a page, those in code aside."""
    parts = _CODE.split(markdown)
    return "".join(part if index % 2 else _typeset(part) for index, part in enumerate(parts))


def _typeset(text: str) -> str:
    text = _DISPLAY.sub(lambda found: f'<div class="formula">{mathml(found[1].strip())}</div>', text)
    # A line that begins with <math> would be taken for a block of its own, and part the sentence.
    return _AT_START.sub(r"\1<span>\2</span>", set_inline(text))

"""Hook of the documentation site: examples run while it is built; a page shows their code, output and picture.

`<!-- example: NAME -->` stands for `docs/examples/NAME.py`, and `<!-- picture: NAME -->` for `docs/pictures/NAME.py`,
whose picture comes first and whose code is folded.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError

from benchmarks.readme import Ran, run_example
from replication.drawing.panels import JOINS, inner
from replication.errors import AuditError

ROOT = Path(__file__).resolve().parents[2]
_MARK = re.compile(r"^<!-- (example|picture): (\w+) -->$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the marks of a page by what they stand for."""
    try:
        return _MARK.sub(lambda found: _SHOWN[found[1]](found[2]), markdown)
    except AuditError as error:
        raise PluginError(str(error)) from None


def inline(drawing: str, label: str) -> str:
    """A stand-alone drawing as a part of the page, whose colours it takes."""
    view_box, body = inner(drawing)
    name = escape(label, quote=True)
    body = re.sub(r"\n\s*\n", "\n", body)
    return f'<svg viewBox="{view_box}" role="img" aria-label="{name}" {JOINS}>{body}</svg>'


@functools.cache
def _ran(folder: str, name: str) -> Ran:
    path = ROOT / "docs" / folder / f"{name}.py"
    if not path.is_file():
        raise AuditError(f"a page shows {path}, which does not exist")
    return run_example(path)


def _example(name: str) -> str:
    ran = _ran("examples", name)
    return f"```python\n{ran.code}\n```\n\n" + "\n".join(_results(ran))


def _picture(name: str) -> str:
    ran = _ran("pictures", name)
    code = f"<details><summary>The code of this picture</summary>\n\n```python\n{ran.code}\n```\n\n</details>"
    return "\n".join([*_results(ran), code]).replace("<details>", '<details markdown="1">')


def _results(ran: Ran) -> Iterator[str]:
    if ran.drawing:
        yield f"<figure>{inline(ran.drawing, ran.caption)}<figcaption>{escape(ran.caption)}</figcaption></figure>\n"
    if ran.output:
        yield f'<div class="output"><p>It prints</p><pre><code>{escape(ran.output)}</code></pre></div>\n'


_SHOWN = {"example": _example, "picture": _picture}

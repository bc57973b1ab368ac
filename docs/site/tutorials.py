"""Hook of the documentation site: each tutorial is a page, with the outputs of its cells."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

from examples import inline
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

from replication.audit.publish.notebooks import executed
from replication.drawing.panels import tidy
from replication.errors import AuditError

ROOT = Path(__file__).resolve().parents[2]


def on_files(files: Files, config: Any) -> Files:
    """Add one page for each notebook."""
    try:
        for name, notebook, _ in executed(ROOT):
            text = "\n\n".join(_cells(notebook, name))
            files.append(File.generated(config, f"tutorials/{name}.md", content=text))
    except AuditError as error:
        raise PluginError(str(error)) from None
    return files


def _cells(notebook: Any, name: str) -> Iterator[str]:
    for number, cell in enumerate(notebook.cells):
        if cell.cell_type == "markdown":
            yield cell.source
        else:
            yield f"```python\n{cell.source}\n```"
            label = cell.source.splitlines()[-1]
            yield from (_output(output, f"{name}-{number}", label) for output in cell.outputs)


def _output(output: Any, name: str, label: str) -> str:
    """One output as HTML without empty lines, which would end it for Markdown."""
    data = output.get("data", {})
    if "image/svg+xml" in data:
        body = f"<figure>{inline(tidy(data['image/svg+xml'].strip(), name), label)}</figure>"
    elif "text/html" in data:
        body = data["text/html"]
    else:
        body = f"<pre><code>{escape((output.get('text') or data['text/plain']).rstrip())}</code></pre>"
    return '<div class="output">' + re.sub(r"\n\s*\n", "\n", body) + "</div>"

"""The tutorial notebooks: executed, then written as pages that load nothing."""

import importlib
import re
import tempfile
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Any

from markupsafe import Markup

from replication.audit.project import read_settings
from replication.audit.report.templates import environment, set_inline, source
from replication.audit.store.cache import Cache, Dependencies, Entry
from replication.audit.store.provenance import LOCK
from replication.errors import AuditError, one_of
from replication.files import sha256, write_atomically

FOLDER, CACHE = "docs/notebooks", ".cache/notebooks"
SECONDS = 600
"""What one cell may take."""

_NO_ALT = re.compile(r'alt="No description has been provided for this image"')
SET_UP = """import matplotlib, matplotlib_inline.backend_inline as inline
inline.set_matplotlib_formats("svg")
matplotlib.rcParams["svg.hashsalt"] = "tutorial"
matplotlib.rcParams["svg.fonttype"] = "none"
"""


def build_notebooks(root: Path, output: Path, names: Sequence[str] = ()) -> Iterator[tuple[Path, bool]]:
    """Write the notebooks, as `executed`, as pages to `output`: each page, and whether its notebook was executed."""
    for name, notebook, fresh in executed(root, names):
        page = output / f"{name}.html"
        write_atomically(page, _page(notebook).encode())
        yield page, fresh


def executed(root: Path, names: Sequence[str] = ()) -> Iterator[tuple[str, Any, bool]]:
    """The notebooks in docs/notebooks of the project at `root` (all unless named) with their outputs.

    Each with its name, and whether it had to be executed: the cache of `root` keeps it until the notebook, the sources
    or the lock change.
    Raises AuditError for an unknown name, and for a notebook with an error, which it names with the cell.
    """
    paths = {path.stem: path for path in sorted((root / FOLDER).glob("*.ipynb"))}
    cache, sources = Cache(root / CACHE), _sources(root)
    for name in [one_of("notebook", name, paths) for name in names] or paths:
        needed = Dependencies(sources=sources, function=__name__, inputs=paths[name].read_text(encoding="utf-8"))
        kept = cache.lookup(name, needed).entry
        entry = kept or Entry(dependencies=needed, seconds=0.0, solvers=(), result=execute(paths[name], root))
        if kept is None:
            cache.store(name, entry)
        yield name, _needed("nbformat").from_dict(entry.result), kept is None


def execute(path: Path, root: Path) -> Any:
    """The notebook at `path` with the outputs of all its cells, run in `root`; AuditError if a cell fails."""
    nbformat, nbclient, config = map(_needed, ("nbformat", "nbclient", "traitlets.config"))
    failed = (nbclient.exceptions.CellExecutionError, nbclient.exceptions.CellTimeoutError)
    notebook = nbformat.read(path, as_version=4)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(SET_UP))
    where = {"metadata": {"path": str(root)}}
    with tempfile.TemporaryDirectory() as sockets:
        # Sockets of the file system: no port of the machine is opened.
        transport = config.Config({"KernelManager": {"transport": "ipc", "ip": f"{sockets}/kernel"}})
        options = {"kernel_name": "python3", "timeout": SECONDS, "resources": where}
        client = nbclient.NotebookClient(notebook, config=transport, **options)
        try:
            client.execute()
        except failed as error:
            raise AuditError(f"{path}: {error}; run it in Jupyter and correct the cell") from None
    del notebook.cells[0]
    return notebook


def _needed(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise AuditError(f"the notebooks need {error.name}: install the extra `notebooks`") from None


def _page(notebook: Any) -> str:
    from nbconvert import HTMLExporter

    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cell.source = set_inline(cell.source)
    exporter = HTMLExporter(template_name="basic", exclude_input_prompt=True, exclude_output_prompt=True)
    body, _ = exporter.from_notebook_node(notebook)
    drawn = iter(_drawing_lines(notebook))
    body = _NO_ALT.sub(lambda match: f'alt="Figure: {escape(next(drawn))}"', body)
    for kind, name in (("input", "Code"), ("output", "Output")):  # may scroll, so it has a tab stop
        body = body.replace(
            f'<div class="{kind}">', f'<div class="{kind}" tabindex="0" role="group" aria-label="{name}">'
        )
    heading = re.match(r"# (.*)", notebook.cells[0].source)
    title, style = heading[1] if heading else "Tutorial", colours() + source("site.css") + source("notebook.css")
    page = environment().get_template("notebook.html.j2")
    return page.render(title=title, body=Markup(body), style=Markup(style))


def colours() -> str:
    """The palette of the report in two colour schemes, and what code takes of it."""
    return source("palette.css") + source("code.css")


def _drawing_lines(notebook: Any) -> Iterator[str]:
    """The line of code behind each figure, which is what can be said of it without looking."""
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            if "image/svg+xml" in output.get("data", {}):
                yield cell.source.splitlines()[-1]


def _sources(root: Path) -> dict[str, str]:
    """What a notebook may depend on: the lock, all Python files of package and papers, and what the papers print."""
    papers = read_settings(root).papers
    folders = (("replication", "*.py"), (papers, "*.py"), (papers, "*.toml"))
    files = [root / LOCK, *(path for name, kind in folders for path in sorted((root / name).rglob(kind)))]
    return {path.relative_to(root).as_posix(): sha256(path) for path in files}

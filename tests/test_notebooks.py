"""The tutorials run to their end (their cells hold assertions), and their pages load nothing."""

import re
from pathlib import Path

import html5lib
import nbformat
import pytest

from replication.audit.publish import notebooks
from replication.audit.publish.notebooks import CACHE, FOLDER, build_notebooks
from replication.errors import AuditError

ROOT = Path(__file__).parents[1]
NAMES = sorted(path.stem for path in (ROOT / FOLDER).glob("*.ipynb"))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_notebook_runs_and_its_page_stands_alone(name: str, tmp_path: Path) -> None:
    ((page, _),) = build_notebooks(ROOT, tmp_path, [name])
    text = page.read_text(encoding="utf-8")
    assert text.count("--paper:") == 2, "two colour schemes"
    tree = html5lib.parse(text, namespaceHTMLElements=False)
    assert tree.find(".//script") is None
    images = list(tree.iter("img"))
    assert images
    for image in images:
        assert (image.get("src") or "").startswith("data:image/svg+xml")
        assert re.match(r"Figure: .*plot\(\)", image.get("alt") or "")


def folder_with(root: Path, name: str, code: str) -> Path:
    """A project whose only notebook has this one cell."""
    (root / FOLDER).mkdir(parents=True)
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)])
    nbformat.write(notebook, root / FOLDER / f"{name}.ipynb")
    return root


@pytest.mark.slow
def test_a_notebook_is_executed_again_only_if_something_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder_with(tmp_path, "small", "print(3)")
    once = notebooks.execute(tmp_path / FOLDER / "small.ipynb", tmp_path)  # a kernel takes a second to start
    monkeypatch.setattr(notebooks, "execute", lambda path, root: once)

    def executed() -> bool:
        ((_, fresh),) = build_notebooks(tmp_path, tmp_path / "pages")
        return fresh

    assert executed()
    page = tmp_path / "pages" / "small.html"
    whole = page.read_bytes()
    page.write_bytes(whole.replace(b"3", b"4"))
    assert not executed() and page.read_bytes() == whole
    (tmp_path / CACHE / "small.json").write_text("{half", encoding="utf-8")
    assert executed() and not executed()
    (tmp_path / "papers" / "toy").mkdir(parents=True)
    (tmp_path / "papers" / "toy" / "printed.toml").write_text('level = "1.33"\n', encoding="utf-8")
    assert executed() and not executed()


@pytest.mark.parametrize("name", NAMES)
def test_stored_notebook_holds_no_output(name: str) -> None:
    notebook = nbformat.read(ROOT / FOLDER / f"{name}.ipynb", as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells)


@pytest.mark.slow
def test_a_failing_cell_and_an_unknown_notebook_are_named_and_leave_no_page(tmp_path: Path) -> None:
    root = folder_with(tmp_path, "wrong", "assert 1 == 2, 'so it is'")
    for names, said in (((), r"(?s)wrong\.ipynb.*so it is"), (("wring",), "wrong")):
        with pytest.raises(AuditError, match=said):
            list(build_notebooks(root, tmp_path / "pages", names))
    assert not list((tmp_path / "pages").glob("*"))

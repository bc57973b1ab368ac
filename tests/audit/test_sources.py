import functools
import sys
from pathlib import Path

import pytest

from replication.audit.store.sources import SourceTree
from replication.errors import AuditError


@pytest.fixture
def tree(tmp_path: Path) -> SourceTree:
    return SourceTree({"lab": tmp_path / "lab"})


def write(tmp_path: Path, **files: str) -> None:
    """Modules of the package `lab`, two underscores for a folder; each folder is a package, empty unless given."""
    for name, text in {"init": "", **files}.items():
        path = tmp_path / "lab" / (name.replace("__", "/") + ".py")
        path = path.with_name("__init__.py") if path.stem == "init" else path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def names(tree: SourceTree, module: str) -> list[str]:
    return [file.removeprefix("lab/") for file in tree.files_of(module)]


def test_closure_is_transitive_and_leaves_out_what_is_not_used(tmp_path: Path, tree: SourceTree) -> None:
    write(tmp_path, a="from lab.b import f\nimport numpy", b="from . import c", c="x = 1", unused="import lab.a")
    assert names(tree, "lab.a") == ["__init__.py", "a.py", "b.py", "c.py"]


@pytest.mark.parametrize(
    "text",
    [
        "import lab.b",
        "import lab.b as other",
        "from lab import b",
        "from . import b",
        "from .b import f",
        "from lab.b import *",
        "def f():\n    from lab import b",
        "if True:\n    import lab.b",
        "try:\n    from lab.b import f\nexcept ImportError:\n    raise",
    ],
)
def test_every_form_of_import_is_seen(tmp_path: Path, tree: SourceTree, text: str) -> None:
    write(tmp_path, a=text, b="f = 1")
    assert "b.py" in names(tree, "lab.a")


def test_relative_imports_from_deeper_packages(tmp_path: Path, tree: SourceTree) -> None:
    write(
        tmp_path,
        deep__init="",
        deep__deeper__init="",
        deep__deeper__a="from ... import top\nfrom ..side import x\nfrom . import near",
    )
    write(tmp_path, top="", deep__side="x = 1", deep__deeper__near="")
    found = names(tree, "lab.deep.deeper.a")
    assert {"top.py", "deep/side.py", "deep/deeper/near.py"} <= set(found)
    assert {"__init__.py", "deep/__init__.py", "deep/deeper/__init__.py"} <= set(found)


def test_enclosing_package_counts_but_its_imports_only_if_a_name_is_taken_from_it(
    tmp_path: Path, tree: SourceTree
) -> None:
    write(
        tmp_path,
        init="from lab.claims import CLAIMS",
        claims="CLAIMS = ()",
        a="from lab import b",
        b="",
        c="from lab import CLAIMS",
    )
    assert names(tree, "lab.a") == ["__init__.py", "a.py", "b.py"]
    assert "claims.py" in names(tree, "lab.c")


def test_a_package_that_binds_the_name_of_a_submodule_is_followed_and_a_circle_ends(
    tmp_path: Path, tree: SourceTree
) -> None:
    write(tmp_path, init="from lab.other import b", a="from lab import b", b="", other="import lab.a\nb = 1")
    assert names(tree, "lab.a") == ["__init__.py", "a.py", "b.py", "other.py"]


def test_checksums_follow_the_content(tmp_path: Path, tree: SourceTree) -> None:
    write(tmp_path, a="x = 1")
    before = tree.files_of("lab.a")
    assert tree.unchanged(before)
    write(tmp_path, a="x = 2")
    assert not tree.unchanged(before)
    after = SourceTree({"lab": tmp_path / "lab"}).files_of("lab.a")
    assert after["lab/a.py"] != before["lab/a.py"]
    (tmp_path / "lab" / "a.py").unlink()
    assert not tree.unchanged(after)


def test_unknown_module_and_broken_file_are_named(tmp_path: Path, tree: SourceTree) -> None:
    write(tmp_path, a="def f(:")
    with pytest.raises(AuditError, match="json is not a file of lab"):
        tree.files_of("json")
    with pytest.raises(AuditError, match=r"a\.py cannot be read as Python.*correct the file"):
        tree.files_of("lab.a")


def test_location_of_functions_partials_and_callable_objects(
    tmp_path: Path, tree: SourceTree, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "import functools\n\ndef f(x=0):\n    return x\n\nclass C:\n    def __call__(self):\n        return 1\n"
    text += "\n@functools.wraps(f)\ndef wrapped():\n    return f()\n"
    write(tmp_path, located=text)
    monkeypatch.syspath_prepend(str(tmp_path / "lab"))
    import located

    monkeypatch.delitem(sys.modules, "located")
    assert tree.location(located.f) == "lab/located.py:3"
    assert tree.location(functools.partial(functools.partial(located.f), x=1)) == "lab/located.py:3"
    assert tree.location(located.C()) == "lab/located.py:7"
    assert tree.location(located.wrapped) == "lab/located.py:3"
    assert tree.location(Path.cwd) == ""
    assert tree.location(len) == ""


def test_last_line_is_the_innermost_of_the_project(
    tmp_path: Path, tree: SourceTree, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, failing="import json\n\ndef outer():\n    inner()\n\ndef inner():\n    json.loads('')\n")
    monkeypatch.syspath_prepend(str(tmp_path / "lab"))
    import failing

    monkeypatch.delitem(sys.modules, "failing")
    with pytest.raises(ValueError, match="Expecting value") as caught:
        failing.outer()
    assert tree.last_line(caught.value.__traceback__) == "lab/failing.py:7"


def test_the_real_project_reaches_its_own_errors() -> None:
    root = Path(__file__).parents[2]
    files = SourceTree({"replication": root / "replication"}).files_of("replication.audit.store.cache")
    assert "replication/errors.py" in files
    assert "replication/cli.py" not in files

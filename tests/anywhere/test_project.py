"""Where a project is, and which mistakes of its configuration are told."""

import shutil
import sys
from pathlib import Path

import pytest

from replication.audit.project import CONFIGURATION, Settings, find_project, read_settings
from replication.errors import AuditError
from replication.scaffold import scaffold


def configured(root: Path, text: str) -> Path:
    (root / CONFIGURATION).write_text(text, encoding="utf-8")
    return root


def test_the_nearest_configuration_above_counts(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    (inner / "deep").mkdir(parents=True)
    configured(tmp_path, 'title = "Outer"\n')
    assert find_project(inner / "deep").root == tmp_path.resolve()
    configured(inner, 'title = "Inner"\n')
    assert find_project(inner / "deep").settings.title == "Inner"


def test_without_a_configuration_the_usual_settings_hold(tmp_path: Path) -> None:
    assert read_settings(tmp_path) == Settings()
    with pytest.raises(AuditError, match=r"there is no replication\.toml in .*`replication new KEY`"):
        find_project(tmp_path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("title = 3", r"Expected `str`, got `int` - at `\$.title`"),
        ('titel = "A"', "unknown field 'titel'; did you mean title"),
        ('title = " "', "the title is empty"),
        ('papers = "../other"', "cannot name a package"),
        ('papers = "json"', "cannot name a package"),
        ("title = ", "is not valid TOML"),
        ('repository = "git@host:a/b"', "no public address"),
        ('repository = "https://host/a b"', "no public address"),
        ("repository = 'https://host/\"><script>'", "no public address"),
    ],
)
def test_a_mistake_names_the_file(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(AuditError, match=rf"(?s){CONFIGURATION}.*{said}"):
        read_settings(configured(tmp_path, text))


def test_a_folder_of_another_name_holds_the_papers(tmp_path: Path) -> None:
    """And what begins with an underscore is none."""
    root = configured(tmp_path, 'papers = "texts_of_test_project"\n')
    scaffold("fresh2030", root)
    shutil.copytree(root / "texts_of_test_project" / "fresh2030", root / "texts_of_test_project" / "_shared")
    try:
        project = find_project(root)
        (paper,) = project.load()
    finally:
        sys.path.remove(str(root))
    assert paper.key == "fresh2030" and (root / "texts_of_test_project" / "fresh2030" / "paper.py").is_file()


def test_a_project_without_papers_says_how_to_begin_one(tmp_path: Path) -> None:
    with pytest.raises(AuditError, match=r"there is no paper in .*papers yet; begin one with `replication new KEY`"):
        find_project(configured(tmp_path, 'title = "Empty"\n')).load()


def test_a_name_that_is_taken_is_told(tmp_path: Path) -> None:
    import papers

    scaffold("fresh2030", tmp_path)
    try:
        with pytest.raises(AuditError, match=r"the name papers stands for .* already"):
            find_project(tmp_path).load()
    finally:
        sys.path.remove(str(tmp_path))
    assert papers.KEYS

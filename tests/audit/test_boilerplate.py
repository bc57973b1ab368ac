"""How much of a new paper's Python says nothing of the paper, and that this is counted as it is defined."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab import make_lab

from benchmarks.boilerplate import Count, measure
from replication.scaffold.make import scaffold

MOST = 0.25
"""Of the lines of a scaffolded paper."""


def written(tmp_path: Path, **modules: str) -> Count:
    package = tmp_path / "papers" / "toy"
    package.mkdir(parents=True)
    for name, text in modules.items():
        (package / f"{name}.py").write_text(text, encoding="utf-8")
    return measure(package)


def test_a_new_paper_is_mostly_about_the_paper(tmp_path: Path) -> None:
    scaffold("fresh2030", make_lab(tmp_path).root)
    count = measure(tmp_path / "papers" / "fresh2030")
    assert count.lines > 50 and count.imports and count.brackets and count.repeated
    assert count.share <= MOST, str(count)


def test_imports_and_brackets_are_counted_by_the_line_and_blank_lines_not_at_all(tmp_path: Path) -> None:
    text = '"""Doc."""\n\nfrom a import (\n    b,\n)\nimport c\nX = (\n    (\n        1,\n    ),\n)\n# said\n'
    assert written(tmp_path, a=text) == Count(lines=11, imports=4, brackets=3, repeated=0)


@pytest.mark.parametrize(
    ("text", "repeated"),
    [
        ('experiment("motor", f)\nresults["motor"]\n', 1),
        ('results["motor"]\nexperiment("motor", f)\n', 1),
        ('experiment("motor", f)\nresults["speed"]\n', 0),
        ('PART.value("speed", "1")(f)\nrows = ["claim:speed", "claim:speed"]\nuses = "toy.speed"\n', 2),
        ('Figure(name="toy-fig1")\nPart("p", figures="fig1")\n', 1),
        ('MOTOR = "motor"\nexperiment(MOTOR, f)\nresults[MOTOR]\n', 2),
        ('paper(key="toy")\nKEY = "toy"\n', 1),
        ('Erratum(id="sign")\n"""sign"""\nf(erratum="sign")\n', 2),
    ],
)
def test_an_id_is_new_once(tmp_path: Path, text: str, repeated: int) -> None:
    assert written(tmp_path, a=text).repeated == repeated


def test_modules_are_read_after_those_that_they_import(tmp_path: Path) -> None:
    first = 'from papers.toy.z import X\nresults["motor"]\n'
    assert written(tmp_path, a=first, z='experiment("motor", f)\n').repeated == 1
    assert measure(tmp_path / "papers" / "toy").share == 2 / 3

"""The documentation: the guide to a new paper does what it says, and the map shows what is there."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from lab import Lab, make_lab

from benchmarks.boilerplate import measure
from replication.audit.inspect.coverage import ASIDE, FACTS, ITEMS
from replication.audit.model import Kind
from replication.errors import InvalidInputError
from replication.scaffold.make import scaffold

ROOT = Path(__file__).parents[1]
GUIDE = (ROOT / "docs" / "adding-a-paper.md").read_text(encoding="utf-8")
SWEEPS = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
BLOCK = re.compile(r'```(?:(?:python|toml)\n# |json title=")(papers/[^\s"]+)"?\n(.*?)```', re.DOTALL)


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return make_lab(tmp_path)


@pytest.mark.slow
def test_a_new_paper_runs_as_it_is(lab: Lab) -> None:
    assert lab.cli("new", "fresh2030").returncode == 0
    done = lab.cli("run", "fresh2030", "--jobs", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 reproduced" in done.stdout
    assert lab.cli("coverage", "fresh2030").returncode == 0
    assert lab.python("-m", "pytest", "-q", "tests/papers/test_fresh2030.py").returncode == 0


@pytest.mark.slow
def test_the_guide_gives_a_paper_whose_claims_hold(lab: Lab) -> None:
    assert lab.cli("new", "randomwalk").returncode == 0
    blocks = BLOCK.findall(GUIDE)
    assert [name.rpartition("/")[2] for name, _ in blocks] == [
        "printed.toml", "claims.toml", "experiments.py", "claims.py", "text.py", "theorems.json", "statements.py",
        "certificates.py", "figures.py", "paper.toml", "paper.py", "coverage.toml",
    ]  # fmt: skip
    for name, text in blocks:
        (lab.root / name).write_text(text, encoding="utf-8")
    (certify,) = re.findall(r"^python -m replication (certify .+)$", GUIDE, re.MULTILINE)
    done = lab.cli(*certify.split())
    assert done.returncode == 0, done.stdout + done.stderr
    done = lab.cli("run", "randomwalk", "--jobs", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    assert (lab.root / "report" / "randomwalk" / "index.html").is_file()
    records = json.loads((lab.root / "report" / "randomwalk" / "results.json").read_bytes())["claims"]
    assert {record["claim"]["kind"] for record in records} == {kind.value for kind in Kind}
    assert [record["claim"]["id"] for record in records if record["judgement"]["proved"]] == ["randomwalk.variance.n1"]
    (show,) = re.findall(r"^python -m replication (show .+)$", GUIDE, re.MULTILINE)
    assert "closed:gain gives 0.618033989" in lab.cli(*show.split()).stdout
    assert measure(lab.path("randomwalk")).share <= 0.25
    covered = lab.cli("coverage", "randomwalk")
    assert covered.returncode == 0 and "0 open" in covered.stdout, covered.stdout
    assert lab.python("-m", "pytest", "-q", "tests/papers/test_randomwalk.py").returncode == 0


@pytest.mark.slow
def test_the_sweep_of_the_guide_takes_up_where_it_ended(lab: Lab) -> None:
    blocks = BLOCK.findall(SWEEPS)
    lab.path("timings").mkdir()
    for name, text in blocks:
        (lab.root / name).write_text(text, encoding="utf-8")
    first = lab.cli("run", "timings")
    assert first.returncode == 0, first.stdout + first.stderr
    (findings,) = (paper["findings"] for paper in results(lab)["papers"])
    assert len(findings) == len(re.findall(r"computed timings\.third-\d", first.stdout)) == 5
    (lab.root / ".cache" / "replication" / "timings.third-6.json").unlink()
    second = lab.cli("run", "timings")
    assert re.findall(r"computed (\S+)", second.stdout) == ["timings.third-6"]
    assert results(lab)["papers"][0]["findings"] == findings


def results(lab: Lab) -> Any:
    return json.loads((lab.root / "report" / "timings" / "results.json").read_bytes())


@pytest.mark.slow
def test_the_program_of_the_guide_runs(lab: Lab) -> None:
    (program,) = re.findall(r"```python\n(from concurrent.*?)```", SWEEPS, re.DOTALL)
    done = lab.python("-c", program + "    print(len(search.optima), best.value >= best.bracket.lower)")
    assert done.stdout == "2 True\n", done.stderr


@pytest.mark.parametrize("key", ["", "Upper", "1st", "a-b", "../up", "class", "a" * 41, "toy2020"])
def test_a_key_that_does_not_do_is_refused_and_nothing_is_written(lab: Lab, key: str) -> None:
    before = sorted(lab.root.rglob("*"))
    with pytest.raises(InvalidInputError, match=r"for example okajima2023|exists"):
        scaffold(key, lab.root)
    assert sorted(lab.root.rglob("*")) == before


@pytest.mark.parametrize("key", ["cli", "notebooks", "exports"])
def test_a_key_whose_test_or_report_would_lie_on_another_is_refused(lab: Lab, key: str) -> None:
    (lab.root / "tests" / "audit").mkdir(parents=True)
    (lab.root / "tests" / "audit" / "test_cli.py").touch()
    with pytest.raises(InvalidInputError, match=r"test_cli.py exists|report/(notebooks|exports)/ holds something else"):
        scaffold(key, lab.root)


@pytest.mark.slow
def test_the_blocks_of_the_guide_keep_to_style_and_types(lab: Lab) -> None:
    scaffold("randomwalk", lab.root)
    for name, text in BLOCK.findall(GUIDE):
        (lab.root / name).write_text(text if name.endswith("json") else f"# {name}\n{text}", encoding="utf-8")
    config = str(ROOT / "pyproject.toml")
    package = str(lab.root / "papers" / "randomwalk")
    for words in (("ruff", "check"), ("ruff", "format", "--check"), ("mypy",)):
        option = "--config-file" if words == ("mypy",) else "--config"
        done = lab.python("-m", *words, option, config, package)
        assert done.returncode == 0, done.stdout + done.stderr


def test_every_command_of_the_guide_exists() -> None:
    from replication import commands

    named = set(
        re.findall(r"python -m replication (\w+)", "\n".join(path.read_text() for path in ROOT.glob("docs/**/*.md")))
    )
    assert named <= set(commands.NAMES)


def test_the_map_shows_every_room_and_every_path_on_it_is_there() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rooms = {match[1] for match in re.finditer(r"^\| `([\w/]+)` \|", page, re.MULTILINE)}
    folders = {path.parent for path in (ROOT / "replication").glob("*/__init__.py")}
    folders |= {path.parent for path in (ROOT / "replication" / "audit").glob("*/__init__.py")}
    assert rooms == {path.relative_to(ROOT).as_posix() for path in folders} | {"papers/KEY"}
    named = re.findall(r"`((?:replication|papers)/[\w./]+\.(?:py|toml|json))`", page)
    assert len(named) > 15
    for name in named:
        place = name.replace("KEY", "okajima2023").replace("METHOD", "multirate")
        assert (ROOT / place).is_file(), name


def test_the_guide_lists_all_excuses_of_coverage_and_no_others() -> None:
    for heading, reasons in (("of numerals", {**FACTS, **ASIDE}), ("of numbered items", ITEMS)):
        table = GUIDE.partition(f"| `excused:` | {heading} |")[2].partition("\n\n")[0]
        assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == list(reasons)

"""The documentation: the guide to a new paper does what it says, and the map shows what is there."""

import inspect
import json
import re
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from lab import Inside, Lab, emptied, make_inside, make_lab

from benchmarks.boilerplate import measure
from replication.audit.data import PrintedTable
from replication.audit.declare import Evidence, Further, Part
from replication.audit.inspect.coverage import ASIDE, FACTS, ITEMS
from replication.audit.model import Claim, Kind
from replication.audit.numbers import Stated, numbers
from replication.audit.parts import Reply
from replication.cli import main
from replication.commands import all_commands
from replication.errors import InvalidInputError
from replication.scaffold import scaffold

ROOT = Path(__file__).parents[1]
GUIDE = (ROOT / "docs" / "adding-a-paper.md").read_text(encoding="utf-8")
SWEEPS = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
MOST = 0.25
"""Of the lines of a paper's Python: what says nothing of the paper."""
BLOCK = re.compile(r"```(?:(?:python|toml)\n# | \{ \.json title=\")(papers/[^\s\"]+)(?:\" \})?\n(.*?)```", re.DOTALL)


@pytest.fixture
def lab(tmp_path: Path) -> Inside:
    return make_inside(tmp_path)


def write(lab: Inside, blocks: Iterable[tuple[str, str]]) -> None:
    """Put blocks of a page where they say, in the package that holds the papers of this project."""
    for name, text in blocks:
        path = lab.root / name.replace("papers/", f"{lab.package}/", 1)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(re.sub(r"\bpapers(?=[./ ])", lab.package, text), encoding="utf-8")


def pytest_passes(lab: Lab, *keys: str) -> bool:
    """Whether the tests of these papers pass, without any plugin."""
    tests = (f"tests/papers/test_{key}.py" for key in keys)
    return lab.python("-m", "pytest", "-q", *tests, PYTEST_DISABLE_PLUGIN_AUTOLOAD="1").returncode == 0


@pytest.mark.slow
def test_new_papers_run_as_they_are_and_pass_their_own_tests(lab: Inside) -> None:
    keys = ("fresh2030", "tables2030")
    for key, form in zip(keys, ((), ("--tables",)), strict=True):
        assert lab.cli("new", key, *form).returncode == 0
    done = lab.cli("run", *keys)
    assert done.returncode == 0, done.stdout + done.stderr
    count = measure(lab.path(keys[0]))
    assert count.lines > 50 and count.imports and count.brackets and count.repeated
    assert count.share <= MOST, str(count)
    for key, verdicts in zip(keys, ("1 reproduced", "3 reproduced"), strict=True):
        assert re.search(rf"^{key}: .*\b{verdicts}", done.stdout, re.MULTILINE), done.stdout
        assert lab.cli("coverage", key).returncode == 0
    assert pytest_passes(lab, *keys)


@pytest.mark.slow
def test_the_guide_gives_a_paper_whose_claims_hold(tmp_path: Path) -> None:
    lab = make_lab(tmp_path)  # in processes of its own, as its reader does
    scaffold("randomwalk", lab.root)
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
    assert measure(lab.path("randomwalk")).share <= MOST
    covered = lab.cli("coverage", "randomwalk")
    assert covered.returncode == 0 and "0 open" in covered.stdout, covered.stdout
    assert pytest_passes(lab, "randomwalk")


@pytest.mark.slow
def test_the_sweep_of_the_guide_takes_up_where_it_ended(lab: Inside) -> None:
    blocks = BLOCK.findall(SWEEPS)
    lab.path("timings").mkdir()
    write(lab, blocks)
    first = lab.cli("run", "timings")
    assert first.returncode == 0, first.stdout + first.stderr
    (findings,) = (paper["findings"] for paper in results(lab)["papers"])
    assert len(findings) == len(re.findall(r"computed timings\.third-\d", first.stdout)) == 5
    (lab.root / ".cache" / "replication" / "timings.third-6.json").unlink()
    second = lab.cli("run", "timings")
    assert re.findall(r"computed (\S+)", second.stdout) == ["timings.third-6"]
    assert results(lab)["papers"][0]["findings"] == findings


def results(lab: Inside) -> Any:
    return json.loads((lab.root / "report" / "timings" / "results.json").read_bytes())


@pytest.mark.slow
def test_the_program_of_the_guide_runs(lab: Inside) -> None:
    (program,) = re.findall(r"```python\n(from concurrent.*?)```", SWEEPS, re.DOTALL)
    done = lab.python("-c", program + "    print(len(search.optima), best.value >= best.bracket.lower)")
    assert done.stdout == "2 True\n", done.stderr


OTHER = (ROOT / "docs" / "another-field.md").read_text(encoding="utf-8")
FILES = re.compile(r"``` \{ \.\w+ title=\"([^\"]+)\" \}\n(.*?)```", re.DOTALL)


@pytest.mark.slow
def test_the_audit_with_a_script_in_r_comes_out_as_its_page_says(tmp_path: Path) -> None:
    if shutil.which("Rscript") is None:
        pytest.skip("Rscript is missing; the page is tried where R is installed")
    lab = emptied(make_inside(tmp_path))
    assert lab.cli("new", "anscombe").returncode == 0
    lab.path("anscombe/figures.py").unlink()
    write(lab, FILES.findall(OTHER))
    done = lab.cli("run")
    assert done.returncode == 0, done.stdout + done.stderr
    (said,) = re.findall(r"```text\n(anscombe: .*)\n```", OTHER)
    assert said in done.stdout.splitlines()
    assert "We cut the digits off" in " ".join(lab.cli("show", "anscombe.correlation.4").stdout.split())
    for words in (["coverage"], ["check"]):
        assert lab.cli(*words).returncode == 0
    assert "0 computed, 2 reused" in lab.cli("run").stdout
    tried = lab.python("-m", "pytest", "-q", "tests")
    assert tried.returncode == 0, tried.stdout
    script = lab.root / "fit.R"
    script.write_text(script.read_text(encoding="utf-8").replace("lm(y ~ x)", "lm(y[-1] ~ x[-1])"), encoding="utf-8")
    done = lab.cli("run")
    assert done.returncode == 3 and "more than half a printed place apart" in done.stdout


CLAIMS = (ROOT / "docs" / "claims.md").read_text(encoding="utf-8")


FOUND = {"self", "kind", "further", "id", "expected", "answer", "repeats", "unit", "remark", "uses"}
"""What a claim has without being given it by these names."""


@pytest.mark.parametrize(
    ("heading", "fields"),
    [
        ("What is printed", PrintedTable.__struct_fields__),
        ("What is claimed: `claims.toml`", Stated.__struct_encode_fields__),
        (
            "What is claimed: in Python",
            {*inspect.signature(Part.claim).parameters, *Claim.__struct_fields__, *Further.__annotations__} - FOUND,
        ),
        ("What was computed", Evidence.__struct_fields__),
        ("Replies", Reply.__struct_fields__),
    ],
)
def test_the_page_on_claims_has_every_field(heading: str, fields: Iterable[str]) -> None:
    page = CLAIMS.partition(f"# {heading}")[2].partition("\n## ")[0]
    named = {name for line in re.findall(r"^(?:\| |(?=`)|The run )(.*)", page, re.MULTILINE) for name in _names(line)}
    assert set(fields) - named == set()


def _names(line: str) -> list[str]:
    return re.findall(r"`(\w+)`", line.partition(" | ")[0] if " | " in line else line)


def test_the_python_of_the_page_on_claims_runs() -> None:
    blocks = re.findall(r"```python\n(.*?)```", CLAIMS, re.DOTALL)
    assert len(blocks) == 4
    for block in blocks:
        exec(compile(block, "claims.md", "exec"), {"__name__": "claims"})


def test_the_tables_of_the_page_on_claims_are_read(tmp_path: Path) -> None:
    for name, text in FILES.findall(CLAIMS):
        (tmp_path / name).write_text(text, encoding="utf-8")
    parts = {part.title: part for part in numbers(tmp_path / "claims.py").parts}
    assert list(parts) == ["Kinetics", "Sec. 3", "Sec. 4"]
    found = {claim.id: str(claim.expected) for part in parts.values() for claim in part.claims}
    assert found == {
        "half-life.25": "reproduced", "half-life.35": "reproduced after erratum", "rate": "reproduced",
        "loss": "reproduced", "energy": "undetermined",
    }  # fmt: skip
    text = '[[claim]]\nid = "P"\nplace = "T"\nprinted = {One = "1"}\nstatement = "S"\nfrom = "a:b"\nmethod = "m"\n'
    (tmp_path / "claims.toml").write_text(text, encoding="utf-8")
    assert [claim.id for part in numbers(tmp_path / "claims.py").parts for claim in part.claims] == ["p.one"]


@pytest.mark.parametrize("page", sorted(path.stem for path in (ROOT / "replication" / "guide").glob("*.md")))
def test_a_page_of_the_guide_is_one_of_the_documentation(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    assert main(["guide", page]) == 0
    assert capsys.readouterr().out == text.rstrip("\n") + "\n"
    assert main(["guide"]) == 0
    assert re.search(
        rf"^{page} +{re.escape(text.splitlines()[0].lstrip('# '))}$", capsys.readouterr().out, re.MULTILINE
    )


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (("", "Upper", "1st", "a-b", "../up", "class", "a" * 41), "for example gosset1908"),
        (("toy2020",), "toy2020 exists"),
        (("cli",), "test_cli.py exists"),
        (("notebooks", "exports"), "report/(notebooks|exports)/ holds something else"),
    ],
)
def test_a_key_that_does_not_do_is_refused_and_nothing_is_written(
    lab: Inside, keys: tuple[str, ...], said: str
) -> None:
    """Nor one whose test or report would lie on another."""
    (lab.root / "tests" / "audit").mkdir(parents=True)
    (lab.root / "tests" / "audit" / "test_cli.py").touch()
    before = sorted(lab.root.rglob("*"))
    for key in keys:
        with pytest.raises(InvalidInputError, match=said):
            scaffold(key, lab.root)
    assert sorted(lab.root.rglob("*")) == before


@pytest.mark.slow
def test_the_blocks_of_the_guide_keep_to_style_and_types(tmp_path: Path) -> None:
    lab = make_lab(tmp_path)
    scaffold("randomwalk", lab.root)
    for name, text in BLOCK.findall(GUIDE):
        (lab.root / name).write_text(text if name.endswith("json") else f"# {name}\n{text}", encoding="utf-8")
    if (ROOT / ".mypy_cache").is_dir():  # what `make lint` knows of the library
        shutil.copytree(ROOT / ".mypy_cache", lab.root / ".mypy_cache")
    config = str(ROOT / "pyproject.toml")
    package = str(lab.path("randomwalk"))
    for words in (("ruff", "check"), ("ruff", "format", "--check"), ("mypy",)):
        option = "--config-file" if words == ("mypy",) else "--config"
        done = lab.python("-m", *words, option, config, package)
        assert done.returncode == 0, done.stdout + done.stderr


def test_every_command_of_the_guide_exists() -> None:
    pages = "\n".join(path.read_text(encoding="utf-8") for path in ROOT.glob("docs/**/*.md"))
    assert set(re.findall(r"(?:python -m |`)replication\s(\w+)", pages)) <= set(all_commands())


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

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from lab import Inside, Lab, hear_interruptions, make_inside

from replication.cli import main
from replication.commands import all_commands
from tests.patience import PATIENCE, wait_for

pytestmark = pytest.mark.slow

HEAVY = ("numpy", "scipy", "matplotlib", "cvxpy", "control", "joblib", "jinja2", "rich", "msgspec")


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return make_inside(tmp_path / "lab")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Inside, subprocess.CompletedProcess[str]]:
    """A project after its first run, to be left as it is, and what that printed."""
    lab = make_inside(tmp_path_factory.mktemp("finished"))
    done = lab.cli("run")
    assert done.returncode == 0
    return lab, done


@pytest.fixture
def ran(finished: tuple[Inside, object], tmp_path: Path) -> Lab:
    """A project after a run, to be changed at will: nothing in it depends on where it lies."""
    shutil.copytree(finished[0].root, tmp_path / "ran")
    return replace(finished[0], root=tmp_path / "ran")


def test_run_writes_everything_and_sums_it_up(finished: tuple[Lab, subprocess.CompletedProcess[str]]) -> None:
    lab, done = finished
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[-1] == f"report: {lab.root / 'report' / 'index.html'}"
    assert "toy2020: 3 claims: 1 reproduced, 1 consistent, 1 differs" in lines
    assert "experiments: 5 computed, 0 reused, 0 failed" in lines
    assert any(line.startswith("slowest: toy2020.") or line.startswith("slowest: other2021.") for line in lines)
    for name in ("report/results.json", "report/index.html", "figures/toy2020-fig1.svg", "figures/toy2020-fig1.csv"):
        assert (lab.root / name).stat().st_size > 0
    assert json.loads((lab.root / "report" / "results.json").read_bytes())["run"]["date"] == "1970-01-01T00:00:00Z"
    steps = [line for line in lines if line.startswith("[")]
    assert len(steps) == 5 and "\x1b" not in done.stdout
    for number, line in enumerate(steps, start=1):
        assert re.fullmatch(rf"\[{number}/5\] computed \S+ in \d+\.\d s \(never ran\)", line)


def test_results_that_come_out_again_give_the_same_bytes_and_keep_their_date(ran: Lab) -> None:
    report, page = (ran.root / "report" / name for name in ("results.json", "index.html"))
    before = report.read_bytes(), page.read_bytes()
    done = ran.cli("run", SOURCE_DATE_EPOCH="86400")
    assert done.returncode == 0 and "experiments: 0 computed, 5 reused, 0 failed" in done.stdout
    assert (report.read_bytes(), page.read_bytes()) == before
    report.write_bytes(before[0].replace(b'"threads":', b'"threads": ', 1) + b"x")
    assert ran.cli("run", SOURCE_DATE_EPOCH="86400").returncode == 0
    assert json.loads(report.read_bytes())["run"]["date"] == "1970-01-02T00:00:00Z"


def test_figures_are_drawn_again_only_if_they_must_be(ran: Lab) -> None:
    drawing = ran.root / "figures" / "toy2020-fig1.svg"
    before = drawing.stat().st_mtime_ns
    whole = drawing.read_bytes()
    ran.cli("run")
    assert drawing.stat().st_mtime_ns == before
    drawing.write_bytes(whole[:-10])
    ran.cli("run")
    assert drawing.read_bytes() == whole
    ran.edit("toy2020/claims.py", 'title="Squares"', 'title="Fair squares"')
    assert ran.cli("run").returncode == 0
    assert drawing.stat().st_mtime_ns > before
    assert "Fair squares" in (ran.root / "report" / "results.json").read_text(encoding="utf-8")
    ran.edit("toy2020/arithmetic.py", "left * right", "left * right + 0.01")
    assert ran.cli("run").returncode == 0
    assert drawing.read_bytes() != whole


def test_figures_are_drawn_while_other_experiments_still_run(lab: Lab) -> None:
    """Seen where a later experiment is interrupted; the next run leaves what is drawn."""
    stop = "import os\n    if os.environ.get('STOP'):\n        raise KeyboardInterrupt\n    "
    lab.edit("toy2020/lengthy.py", "time.sleep(", f"{stop}time.sleep(")
    drawing = lab.root / "figures" / "toy2020-fig1.svg"
    assert lab.cli("run", STOP="1").returncode == 130
    before = drawing.stat().st_mtime_ns
    assert not (lab.root / "report" / "results.json").exists()
    assert "experiments: 2 computed, 3 reused, 0 failed" in lab.cli("run").stdout
    assert drawing.stat().st_mtime_ns == before


@pytest.mark.parametrize("width", ["os.environ['WIDTH']", "subprocess.check_output(['printenv', 'WIDTH'])"])
def test_what_a_figure_reads_is_looked_at_by_the_next_run(ran: Lab, width: str) -> None:
    """What a program reads cannot be followed: then the figure is drawn by every run."""
    ran.edit("toy2020/claims.py", '["square"])\n    return', f'["square"], linewidth=float({width}))\n    return')
    ran.edit("toy2020/claims.py", "    drawing = Drawing()", "    import os, subprocess\n\n    drawing = Drawing()")
    drawing = ran.root / "figures" / "toy2020-fig1.svg"
    assert ran.cli("run", WIDTH="1").returncode == 0
    before = drawing.read_bytes()
    assert ran.cli("run", WIDTH="2").returncode == 0
    assert drawing.read_bytes() != before


@pytest.mark.parametrize(
    ("file", "old", "new", "code", "said"),
    [
        ("toy2020/claims.py", "Verdict.DIFFERS", "Verdict.REPRODUCED", 1,
         ["changed verdict: toy2020.square.wrong is differs, pinned is reproduced: Computed 4"]),
        # One line for all claims that the experiment takes down, and no word on what they would have read.
        ("toy2020/squares.py", "    solver = ", "    raise ValueError('planted')\n    solver = ", 3,
         ["error: experiment toy2020.square: ValueError: planted [papers/toy2020/squares.py:9]\n",
          "error: claims toy2020.square.two, toy2020.square.wrong: AuditError: experiment toy2020.square failed: "
          "ValueError: planted [papers/toy2020/squares.py:9]\n",
          "error: erratum toy2020.power: ", "error: figure toy2020-fig1: ", "error: findings of toy2020: "]),
    ],
)  # fmt: skip
def test_what_is_wrong_has_an_exit_code_and_the_report_is_written(
    lab: Lab, file: str, old: str, new: str, code: int, said: list[str]
) -> None:
    lab.edit(file, old, new)
    done = lab.cli("run")
    assert done.returncode == code
    assert [words for words in said if words not in done.stdout] == []
    assert ("squares" in file) is ("no claim, erratum, figure or finding uses" not in done.stdout)
    assert "Traceback" not in done.stdout + done.stderr and (lab.root / "report" / "index.html").is_file()


def test_a_run_says_which_tutorials_are_not_there(lab: Lab) -> None:
    lab.edit("other2021.py", 'key="other2021",', 'key="other2021", notebook="half",')
    told = "tutorials not built yet, to which it links: half;"
    assert told in lab.cli("run", "other2021").stdout
    (lab.root / "report" / "notebooks").mkdir()
    (lab.root / "report" / "notebooks" / "half.html").touch()
    assert told not in lab.cli("run", "other2021").stdout


def test_report_alone_computes_nothing_and_says_where_the_page_is_older(ran: Lab) -> None:
    page, drawing = ran.root / "report" / "index.html", ran.root / "figures" / "toy2020-fig1.svg"
    before, drawn = page.read_bytes(), drawing.read_bytes()
    ran.edit("toy2020/squares.py", "    solver = ", "    raise ValueError\n    solver = ")
    for there in (True, False):
        drawing.unlink()
        done = ran.cli("report")
        assert done.returncode == 2 and done.stderr.rstrip().endswith(f"{page} is of an earlier run") is there
        page.unlink(missing_ok=True)
        drawing.write_bytes(drawn)
    assert ran.cli("report").returncode == 0 and page.read_bytes() == before


def test_a_run_of_one_paper_leaves_the_report_on_all_alone_and_output_goes_where_asked(ran: Lab) -> None:
    whole = (ran.root / "report" / "results.json").read_bytes()
    done = ran.cli("run", "other2021")
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1] == f"report: {ran.root / 'report' / 'other2021' / 'index.html'}"
    part = json.loads((ran.root / "report" / "other2021" / "results.json").read_bytes())
    assert [paper["key"] for paper in part["papers"]] == ["other2021"]
    drawn = (ran.root / "figures" / "toy2020-fig1.svg").stat().st_mtime_ns
    done = ran.cli("run", "--output", "elsewhere", "--figures", "drawn", "--no-cache")
    assert done.returncode == 0 and "5 computed" in done.stdout
    assert (ran.root / "elsewhere" / "results.json").is_file() and (ran.root / "drawn" / "toy2020-fig1.svg").is_file()
    assert ran.cli("list", "--output", "elsewhere").stdout.count("reproduced") == 2
    assert (ran.root / "report" / "results.json").read_bytes() == whole
    assert (ran.root / "figures" / "toy2020-fig1.svg").stat().st_mtime_ns == drawn
    ran.edit("toy2020/claims.py", "Two squared, misprinted.", "Two squared, printed wrong.")
    for words, place in ((("--output", "elsewhere"), "elsewhere"), (("toy2020", "other2021"), "report")):
        assert ran.cli("run", *words).stdout.splitlines()[-1].endswith(f"{place}/index.html")
        assert "printed wrong" in (ran.root / place / "results.json").read_text(encoding="utf-8")


def test_list_knows_verdicts_only_after_a_run_and_show_gives_the_evidence(lab: Lab, ran: Lab) -> None:
    assert "toy2020.square.wrong  -" in lab.cli("list").stdout
    listed = ran.cli("list", "toy2020").stdout
    assert "toy2020.square.wrong  differs" in listed and "other2021" not in listed
    done = ran.cli("show", "toy2020.square.wrong")
    assert done.returncode == 0
    for line in ("statement: Two squared, misprinted.", "printed: '4.1'", "computed: 4.0", "verdict: differs"):
        assert line in done.stdout.splitlines()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run", "toy2002"), "unknown paper 'toy2002'; did you mean toy2020"),
        (("run", "zzz"), "unknown paper 'zzz'; there are: other2021, toy2020"),
        (("list", "ther2021"), "did you mean other2021"),
        (("show", "toy2020.square.to"), "unknown claim 'toy2020.square.to'; did you mean toy2020.square.two"),
        (("diff", "no.json", "report/results.json"), "no.json does not exist"),
        (("run", "--no-cache", "--output", "file"), "file is no directory that can be written"),
        (("run", "--no-cache", "--figures", "/proc/x"), "/proc/x is no directory that can be written"),
        (("check", "--output", "odd"), "odd/results.json: Is a directory"),
        (("diff", "odd", "report/results.json"), "odd: Is a directory"),
        (("show", "toy2020.square.two", "--output", "file"), "file/results.json: Not a directory"),
        *(((*words, "--output", "/no"), "/no/results.json does not exist; make it with `python -m replication run`")
          for words in (("list",), ("show", "toy2020.square.two"), ("check",), ("report",))),
        (("rum",), "invalid choice: 'rum'"),
        ((), "the following arguments are required: COMMAND"),
        *((("run", "--jobs", text), f"{text!r} is not a whole number of at least 1") for text in ("0", "two")),
        *((("run", f"--timeout={text}"), f"{text!r} is not a positive number")
          for text in ("0", "-1", "inf", "nan", "x")),
    ],
)  # fmt: skip
def test_bad_input_is_exit_code_2_told_in_one_line_and_at_once(
    ran: Lab, arguments: tuple[str, ...], message: str
) -> None:
    (ran.root / "file").write_text("", encoding="utf-8")
    (ran.root / "odd" / "results.json").mkdir(parents=True)
    done = ran.cli(*arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr.splitlines()[-1] and (len(done.stderr.splitlines()) == 1 or "usage:" in done.stderr)


def test_results_of_another_schema_are_refused(ran: Lab) -> None:
    path, page = ran.root / "report" / "results.json", ran.root / "report" / "index.html"
    before = page.read_bytes()
    path.write_text(json.dumps({**json.loads(path.read_bytes()), "schema_version": 99}), encoding="utf-8")
    diff = ("diff", "report/results.json", "report/results.json")
    for command in (("list",), ("show", "toy2020.square.two"), ("check",), ("report",), ("export",), diff):
        done = ran.cli(*command)
        assert (done.returncode, done.stdout) == (2, ""), command
        assert "report/results.json has schema version 99, and this program reads 3" in done.stderr
        assert len(done.stderr.splitlines()) == 1
    assert page.read_bytes() == before and not (ran.root / "report" / "exports").exists()


def test_check_and_coverage_find_a_binding_to_nothing(ran: Lab) -> None:
    listed = ran.path("toy2020/coverage.toml")
    ran.path("toy2020/printed.toml").write_text("", encoding="utf-8")
    listed.write_text(
        '[paper]\nruns = 1\nplaces = [{place = "Sec. I", numerals = [["2", "claim:square.lost"]]}]', encoding="utf-8"
    )
    for command in ("check", "coverage"):
        done = ran.cli(command)
        assert done.returncode == 1, done.stderr
        assert "toy2020: paper, Sec. I: '2': unknown claim 'square.lost'" in done.stdout
    assert "other2021" in done.stdout and "does not exist; list there what the text" in done.stdout


def test_diff_of_two_runs(ran: Lab) -> None:
    old = ran.root / "old.json"
    old.write_bytes((ran.root / "report" / "results.json").read_bytes())
    assert ran.cli("diff", "old.json", "report/results.json").returncode == 0
    ran.edit("toy2020/arithmetic.py", "left * right", "left * right + 0.06")
    assert ran.cli("run").returncode == 1
    done = ran.cli("diff", "old.json", "report/results.json")
    assert done.returncode == 1
    assert "toy2020.square.two" in done.stdout and "other2021.half" not in done.stdout
    listed = json.loads(ran.cli("diff", "--json", "old.json", "report/results.json").stdout)
    told = {"toy2020.square.two", "erratum toy2020.power", "figure toy2020-fig1"}
    assert told <= {change["record"] for change in listed}


def test_interruption_is_exit_code_130_with_one_line(lab: Lab) -> None:
    lab.edit("toy2020/experiments.py", '"seconds": 0.0, "label": "b"', '"seconds": 60.0, "label": "b"')
    process = subprocess.Popen(
        [sys.executable, "-m", "replication", "run"],
        cwd=lab.root,
        env=lab.environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=hear_interruptions,
    )
    cache = lab.root / ".cache" / "replication"
    wait_for(lambda: len(list(cache.glob("*.json"))) >= 4, lambda: process.poll() is None)
    os.killpg(process.pid, signal.SIGINT)
    _, complaint = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert (
        complaint
        == "replication: interrupted; files that are whole stay, and `run` goes on from what it had computed\n"
    )
    assert list((lab.root / "report").iterdir()) == []


@pytest.mark.parametrize("command", ["list", "run --no-cache --jobs 1"])
def test_a_reader_that_leaves_early_does_not_keep_the_report_from_being_made(ran: Lab, command: str) -> None:
    page = ran.root / "report" / "index.html"
    if command != "list":
        page.unlink()
    line = f"set -o pipefail; {sys.executable} -m replication {command} | true"
    done = subprocess.run(
        ["bash", "-c", line], cwd=ran.root, env=ran.environment(), capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert page.is_file()


def test_help_is_complete_and_light(lab: Lab) -> None:
    """Of all commands in one process, which may load nothing heavy for any of them."""
    program = (
        "import contextlib, io, json, sys, replication.cli\nfor name in json.loads(sys.argv[1]):\n"
        "    with contextlib.redirect_stdout(io.StringIO()) as told, contextlib.suppress(SystemExit):\n"
        "        replication.cli.main([*name, '--help'])\n    print(json.dumps(told.getvalue()))\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])\n"
    )
    names = [[], *([name] for name in all_commands())]
    *told, loaded = lab.python("-c", program, json.dumps(names)).stdout.splitlines()
    assert loaded == "[]" and len(told) == len(names)
    for text in map(json.loads, told):
        for code in ("0 ", "1 ", "2 ", "3 ", "130 "):
            assert re.search(rf"^  {code}", text, re.MULTILINE)
    assert "examples:" in json.loads(told[0])


def test_the_version_is_that_of_the_distribution(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    declared = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert capsys.readouterr().out == f"replication {declared['version']}\n"

"""Slips of whoever writes a paper: each is told with file, line and cure, and has its exit code."""

from __future__ import annotations

import re
from typing import Any

import pytest
from lab import Lab
from sample import claim

from replication.audit.inspect.headline import factor
from replication.audit.judge.verdict import plain
from replication.audit.model import Evidence, Kind, Verdict
from replication.errors import AuditError

pytestmark = pytest.mark.slow
"""Each runs the program in a process of its own."""

CLAIMS = "toy2020/claims.py"
AT = r" \[papers/toy2020/claims\.py:\d+\]"


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        (
            CLAIMS,
            'place="Table 1"',
            'palce="Table 1"',
            rf"TypeError: .*unexpected keyword argument 'palce'{AT}; correct",
        ),
        (CLAIMS, "def draw(", "def draw(:", r"SyntaxError: .*\[papers/toy2020/claims\.py:\d+\]; correct"),
        (CLAIMS, "from typing import Any", "import numpyy", rf"No module named 'numpyy'{AT}"),
        ("toy2020/__init__.py", 'key="toy2020"', 'key="toy2021"', "must define PAPER, a Paper whose key is 'toy2020'"),
    ],
)
def test_a_module_that_cannot_be_loaded(lab: Lab, file: str, old: str, new: str, words: str) -> None:
    lab.edit(file, old, new)
    done = lab.cli("list")
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1 and re.search(words, done.stderr), done.stderr


def test_fields_of_another_type_are_told_together_before_anything_is_computed(lab: Lab) -> None:
    lab.edit(CLAIMS, "kind=Kind.ORDER", 'kind="order"')
    lab.edit(CLAIMS, 'printed="4.0"', "printed=4.0")
    lab.edit(CLAIMS, 'uses=("toy2020.wait-a", "toy2020.wait-b")', 'uses=("toy2020.wait-a")')
    lab.edit(CLAIMS, "published=True", 'published="yes"')
    lab.edit("toy2020/__init__.py", 'authors=("A. Toy",)', 'authors="A. Toy"')
    done = lab.cli("run")
    assert (done.returncode, done.stdout) == (2, "")
    for words in (
        rf"claim 'toy2020.wait.patient': kind is 'order'; write one of Kind.VALUE, .*{AT}",
        rf"claim 'toy2020.square.two': printed is 4.0; .* is a string, whose digits are its tolerance: \"1.50\"{AT}",
        rf"claim 'toy2020.wait.patient': uses is 'toy2020.wait-a'; .*with a comma: \('name',\){AT}",
        rf"figure 'toy2020-fig1': published is 'yes'; .*{AT}",
        r"paper 'toy2020': authors is 'A. Toy'; expected `array`, got `str`",
    ):
        assert re.search(words, done.stderr), done.stderr
    assert "Traceback" not in done.stderr and not (lab.root / ".cache" / "replication" / "toy2020.square.json").exists()


def test_what_fails_while_a_run_goes_on_is_told_with_its_line(lab: Lab) -> None:
    lab.edit(CLAIMS, '.plot(data.columns["x"], data', '.plot(data.columns["X"], data')
    lab.edit(CLAIMS, 'Evidence(method="waiting", holds', 'Evidence(methd="waiting", holds')
    lab.edit(CLAIMS, 'printed="4.1"', 'printed="~4.1"')
    lab.edit("toy2020/arithmetic.py", "left * right", "left * rihgt")
    lab.edit("other2021.py", "value / 2", "'x' * 24_000_000")
    done = lab.cli("run")
    assert done.returncode == 3
    assert "toy2020.square: NameError: name 'rihgt' is not defined [papers/toy2020/arithmetic.py:5]" in done.stdout
    assert re.search(rf"error: claim toy2020.wait.patient: .*Unexpected keyword argument 'methd'.*{AT}", done.stdout)
    assert re.search(r"other2021.half has \d+ MB, at most 20 are kept; return what is shown or judged", done.stdout)
    lab.edit("toy2020/arithmetic.py", "rihgt", "right")
    done = lab.cli("run")
    told = rf"error: figure toy2020-fig1: AuditError: there is no column 'X'; the data has 'x', 'square'{AT}"
    assert re.search(told, done.stdout), done.stdout
    assert "error: claim toy2020.square.wrong: printed value '~4.1'" in done.stdout and "approximate" in done.stdout
    assert "Traceback" not in done.stdout + done.stderr


def test_what_nobody_would_see_is_told(lab: Lab) -> None:
    lab.edit(CLAIMS, 'place="Table 2"', 'place="Tabel 2"')
    lab.edit(CLAIMS, 'printed="4.1"', 'printed="0.0040"')
    text = lab.path(CLAIMS).read_text(encoding="utf-8").replace('place="Sec. 2"', 'place="Table 3"')
    lab.path(CLAIMS).write_text(text, encoding="utf-8")
    (lab.root / "figures").mkdir()
    (lab.root / "figures" / "toy2020-old.svg").touch()
    lab.edit(CLAIMS, 'method="multiplication", ', 'method="multiplication", cross_check="addition", ')
    done = lab.cli("run")
    assert done.returncode == 0
    notes = [line for line in done.stdout.splitlines() if line.startswith("note: ")]
    assert notes == [
        "note: no claim, erratum, figure or finding uses toy2020.spectrum, toy2020.wait-b",
        "note: neither a check by a second method nor a proof: other2021.half, toy2020.wait.patient",
        "note: toy2020.square.wrong: the computed number is 10^3 times the print; another unit, or a decimal comma?",
        "note: toy2020.square.wrong: the place 'Tabel 2' has 'Tabel'; is 'Table' meant?",
        f"note: no figure is called toy2020-old.svg; remove what is left in {lab.root / 'figures'}",
    ]


def test_a_name_with_a_slip_is_told_with_its_line_and_the_one_that_is_meant(lab: Lab) -> None:
    lab.edit(CLAIMS, 'uses=("toy2020.wait-a", "toy2020.wait-b")', 'uses=("toy2020.wait-a", "toy2020.wiat-b")')
    text = lab.path(CLAIMS).read_text(encoding="utf-8").splitlines()
    line = 1 + next(number for number, one in enumerate(text) if "wiat-b" in one)
    done = lab.cli("run")
    told = (
        "- claim 'toy2020.wait.patient' uses experiment 'toy2020.wiat-b', which does not exist; did you mean "
        f"toy2020.wait-b or toy2020.wait-a or toy2020.square? [papers/toy2020/claims.py:{line}]"
    )
    assert done.returncode == 2 and told in done.stderr.splitlines(), done.stderr


def test_a_list_of_another_text_is_told(lab: Lab) -> None:
    lab.path("other2021").mkdir()
    lab.path("other2021.py").rename(lab.path("other2021/__init__.py"))
    printed = '[half]\nplace = "Sec. 1"\nvalue = "0.5"\n'
    listed = '[paper]\nruns = 2\n[[paper.places]]\nplace = "Sec. 1"\nnumerals = [["0.5", "data:half"], ["3", "{}"]]\n'
    lab.path("other2021/printed.toml").write_text(printed, encoding="utf-8")
    for binding, said in (("claim:powers.last", True), ("excused:label", False)):
        lab.path("other2021/coverage.toml").write_text(listed.format(binding), encoding="utf-8")
        told = (
            "note: coverage.toml of other2021 has 1 fault, see `replication coverage other2021`; the first: other2021: "
        )
        assert (told in lab.cli("run", "other2021").stdout) is said


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (360.0, "60"),
        (0.1, "1/60"),
        (21600.0, "3600"),
        (6 / 3600, "1/3600"),
        (25.1, "4.184"),
        (1.434, "1/4.184"),
        (343.77, "180/π"),
        (0.10472, "π/180"),
        (7.0, ""),
    ],
)
def test_a_usual_unit_is_named_both_ways(value: float, words: str) -> None:
    record = claim("case", Kind.VALUE, Verdict.DIFFERS, "6.00", Evidence(method="Computed", value=value))
    assert factor(record) == words


def test_a_print_of_one_unit_tells_no_factor() -> None:
    assert factor(claim("case", Kind.VALUE, Verdict.DIFFERS, "1", Evidence(method="Computed", value=7.0))) == ""
    assert factor(claim("case", Kind.VALUE, Verdict.DIFFERS, "2", Evidence(method="Computed", value=20.0))) == "10^1"


@pytest.mark.parametrize("outcomes", [{"norm": 1.5}, [("norm", 1.5)], [1.5], 1.5])
def test_outcomes_of_another_form_are_told_with_an_example(outcomes: Any) -> None:
    with pytest.raises(AuditError, match=r"at `\$\.outcomes.*outcomes are a list .*\[\{\"reading\": \"logarithms\""):
        plain(Evidence(method="Computed", outcomes=outcomes))
    record = claim("case", Kind.VALUE, Verdict.ERROR, "6.00", Evidence(method="Computed", outcomes=outcomes))
    assert record.judgement.reason.endswith("where no number is printed [papers/doe1999/claims.py:42]")


@pytest.mark.slow
def test_what_does_not_come_out_again_is_told(lab: Lab) -> None:
    random = "    import os\n    values[1] += os.getpid() % 1000 + 1\n    solver = "
    lab.edit("toy2020/squares.py", "    solver = ", random)
    done = lab.cli("run", "--twice", "other2021", "toy2020")
    assert "twice: 1 of 5 results differ: toy2020.square" in done.stdout
    assert done.returncode == 1
    assert "not derived" not in lab.cli("check").stdout  # the cache keeps the run that was written


@pytest.mark.slow
def test_data_that_is_read_counts(lab: Lab) -> None:
    data = lab.path("toy2020/data")
    data.mkdir()
    (data / "n.csv").write_text("2\n", encoding="utf-8")
    (data / "early.csv").write_text("0\n", encoding="utf-8")
    (lab.root / "outside.txt").write_text("0\n", encoding="utf-8")
    reading = """    from pathlib import Path
    names = [Path(__file__).parent / "data" / ("n" + ".csv"), Path("outside.txt")]
    values = [*values[:1], sum(float(name.read_text()) for name in names), EARLY]
    solver = """
    lab.edit("toy2020/squares.py", "    solver = ", reading)
    lab.edit("toy2020/squares.py", "\n\ndef square", EARLY + "\n\ndef square")
    assert lab.cli("run").returncode == 0
    for file in (data / "n.csv", data / "early.csv", lab.root / "outside.txt"):
        file.write_text(f"{file.read_text(encoding='utf-8')} \n", encoding="utf-8")
    done = lab.cli("run")
    changed = "papers/toy2020/data/early.csv, ./outside.txt, papers/toy2020/data/n.csv"
    assert re.search(rf"computed toy2020.square in .* s \(changed: {re.escape(changed)}\)", done.stdout), done.stdout
    assert "1 computed, 4 reused" in done.stdout
    assert "0 computed, 5 reused" in lab.cli("run").stdout
    (data / "n.csv").write_text("2\n\n", encoding="utf-8")
    assert "toy2020.square: not derived: sources, inputs or data are others now" in lab.cli("check").stdout


EARLY = """
from pathlib import Path as _Path
EARLY = float((_Path(__file__).parent / "data/early.csv").read_text())
"""


@pytest.mark.parametrize("kind", ["file", "link"])
def test_a_cache_that_cannot_be_written_is_told_before_the_start_and_ends_nothing(lab: Lab, kind: str) -> None:
    cache = lab.root / ".cache"
    if kind == "file":
        cache.write_text("", encoding="utf-8")
    else:
        cache.symlink_to("/proc")
    done = lab.cli("run")
    assert done.returncode == 0
    (line,) = done.stderr.splitlines()
    assert line.startswith("replication: nothing will be kept for the next run: ") and ".cache/replication" in line
    assert "5 computed, 0 reused, 0 failed" in done.stdout and "(never ran)" in done.stdout
    assert (lab.root / "report" / "index.html").is_file()


def test_a_fault_of_the_program_has_a_code_of_its_own(lab: Lab) -> None:
    program = (
        "import sys, replication.errors as names\nfrom replication.cli import main\n"
        "def fault(*a):\n    raise {}\nnames.one_of = fault\nsys.exit(main(['list', 'toy2020']))\n"
    )
    done = lab.python("-c", program.format("KeyError('lost' * 1000)"))
    assert (done.returncode, done.stdout) == (70, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith("replication: a fault of this program, KeyError at replication/") and len(line) < 900
    assert "Please report it" in line
    shown = lab.python("-c", program.format("KeyError('lost')"), REPLICATION_TRACEBACK="1")
    assert shown.returncode == 70 and "Traceback" in shown.stderr
    done = lab.python("-c", program.format("MemoryError"))
    assert done.returncode == 70 and "too little memory" in done.stderr


def test_claims_of_a_part_that_no_paper_lists_are_told(lab: Lab) -> None:
    text = """
from replication.audit.declare import Part
LOST = Part("Table 8", reading="none")
@LOST.order("eight", place="Table 8")
def eight(results):
    "It is eight."
"""
    lab.path(CLAIMS).write_text(lab.path(CLAIMS).read_text(encoding="utf-8") + text, encoding="utf-8")
    done = lab.cli("run")
    told = "claims that nobody would see: eight of Part('Table 8') in papers.toy2020.claims; add them to parts"
    assert done.returncode == 2 and told in done.stderr, done.stderr
    lab.path(CLAIMS).write_text(lab.path(CLAIMS).read_text(encoding="utf-8").replace(text, ""), encoding="utf-8")
    lab.path("toy2020/claims.toml").write_text("", encoding="utf-8")
    assert re.search(r"those of .*toy2020/claims.toml, which `numbers\(__file__\)` reads", lab.cli("run").stderr)


def test_a_number_without_an_experiment_is_told(lab: Lab) -> None:
    text = lab.path(CLAIMS).read_text(encoding="utf-8")
    start = text.index("def two_squared")
    lab.path(CLAIMS).write_text(
        text[:start]
        + text[start:]
        .replace('value=results["toy2020.square"]["squares"][1]', "value=4.0", 1)
        .replace('uses=("toy2020.square",)', "uses=()", 1),
        encoding="utf-8",
    )
    assert "note: a number that rests on no experiment: toy2020.square.two\n" in lab.cli("run").stdout

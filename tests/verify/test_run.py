"""From files to outcomes: what a certificate is about is compared with the papers, and every failure is counted."""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from flint import fmpq, fmpq_mat

from replication import twice
from replication.audit.run.prove import prove
from replication.verify.algebra.linear import above, below, decimal, half_unit, printed_matrix, printed_poles
from replication.verify.run import STATEMENTS, check, committed, own_statement, printable, report, verify
from replication.verify.subjects import folder_of, papers, plant, printed, theorems
from replication.verify.theorem import Refused
from replication.verify.workers import in_order, jobs
from tests.patience import PATIENCE

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "certificates" / "okajima2023"


def copied(tmp_path: Path, name: str = "gains-33") -> Path:
    path = tmp_path / "okajima2023" / f"{name}.json"
    path.parent.mkdir()
    shutil.copy(FOLDER / f"{name}.json", path)
    return path


def test_a_file_is_proved_wherever_it_lies_under_its_name(tmp_path: Path) -> None:
    path = copied(tmp_path)
    assert verify(path).theorem is not None
    other = path.rename(path.with_name("gains-38.json"))
    assert verify(other).reason == "the file should be okajima2023/gains-33.json"


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"format": "replication-certificate/2"}, "the format is 'replication-certificate/2'"),
        ({"statement": "multirate.rows"}, "statement is not that of the wanted theorem gains-33"),
        ({"claims": []}, "claims is not that of the wanted theorem gains-33"),
        ({"plant": {"name": "stable"}}, "plant is not that of the wanted theorem gains-33"),
        ({"parameters": {}}, "parameters is not that of the wanted theorem gains-33"),
        ({"name": "gains-3"}, "wants no theorem named gains-3"),
        ({"name": "gains\nproved x"}, "name must have 1 to 80 letters, .* got 'gains.nproved x'"),
        ({"name": ""}, "name must have 1 to 80 letters"),
        ({"name": "x" * 81}, "name must have 1 to 80 letters"),
        ({"plant": {"name": "a\nproved b"}}, "plant.name must have 1 to 80 letters"),
        ({"plant": {"name": 0}}, "plant.name must be a string"),
        ({"bound": {"lower": [1]}}, "bound.lower must be a rational as a string"),
        ({"x\nproved y": 1}, r"certificate has the unknown field 'x.nproved y'"),
        ({"paper": "okajima"}, "there is no paper 'okajima' that lists theorems"),
        ({"paper": "../papers/okajima2023"}, "there is no paper '../papers/okajima2023' that lists theorems"),
        ({"paper": 3}, "paper must be a string"),
        ({"paper": None}, "belongs to no paper supports no claims"),
        ({"paper": None, "claims": [], "statement": "multirate.best"}, "there is no statement 'multirate.best'"),
        ({"extra": 1}, "certificate has the unknown field extra"),
        ({"bound": {"lower": "1"}}, "bound lacks the field upper"),
        ({"bound": {"lower": "1", "upper": "2", "middle": "1"}}, "bound must hold lower, upper, or nothing"),
    ],
)
def test_the_frame_of_a_certificate_is_checked(change: dict[str, Any], reason: str) -> None:
    certificate = json.loads((FOLDER / "gains-33.json").read_bytes())
    with pytest.raises(Refused, match=reason):
        check({**certificate, **change})


def test_a_stated_side_must_be_the_proved_one() -> None:
    certificate = json.loads((FOLDER / "rows.json").read_bytes())
    assert check(certificate).upper == 9
    with pytest.raises(Refused, match="the upper bound that is proved is 9, not 8"):
        check({**certificate, "bound": {"upper": "8"}})


def test_a_check_that_breaks_down_proves_nothing() -> None:
    def broken(certificate: object, stated: object) -> None:
        raise KeyError("A")

    with patch.dict(STATEMENTS, {"multirate.rows": broken}):
        assert verify(FOLDER / "rows.json").reason == "the check ended in KeyError: 'A'"


def test_all_that_is_wanted_must_be_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("printed.toml", "plants.py", "theorems.json"):
        (tmp_path / "papers" / "okajima2023").mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "papers" / "okajima2023" / name, tmp_path / "papers" / "okajima2023" / name)
    shutil.copytree(FOLDER, tmp_path / "certificates" / "okajima2023")
    (tmp_path / "certificates" / "okajima2023" / "rows.json").rename(tmp_path / "certificates" / "odd.json")
    assert papers(tmp_path) == ("okajima2023",)
    assert len(committed(tmp_path)) == len(theorems("okajima2023", tmp_path)[0]) + 1
    assert report([], tmp_path) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[1] for line in lines if line.startswith("NOT PROVED")] == [
        "the file cannot be read",
        "where it lies there must be the theorem 'odd' of the paper '.'",
    ]
    assert lines[-1] == f"{len(lines) - 3} of {len(lines) - 1} certificates proved"


OWN = {"paper": None, "claims": []}


def test_a_certificate_of_ones_own_never_stands_for_a_theorem_of_a_paper(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "papers" / "okajima2023", tmp_path / "papers" / "okajima2023")
    place = tmp_path / "certificates" / "okajima2023" / "common-period.json"
    place.parent.mkdir(parents=True)
    shutil.copy(FOLDER / "common-period.json", place)
    assert prove("certificates/okajima2023/common-period.json", str(tmp_path), {})["sentence"]
    foreign = json.dumps({**json.loads(place.read_bytes()), **OWN})
    outside = tmp_path / "common-period.json"
    outside.write_text(foreign, encoding="utf-8")
    assert verify(outside, tmp_path).theorem is not None
    place.write_text(foreign, encoding="utf-8")
    reason = "where it lies there must be the theorem 'common-period' of the paper 'okajima2023'"
    assert prove("certificates/okajima2023/common-period.json", str(tmp_path), {})["reason"] == reason
    place.unlink()
    place.symlink_to(outside)
    assert verify(place, tmp_path).reason == reason
    place.unlink()
    place.parent.rmdir()
    (tmp_path / "folder").mkdir()
    outside.rename(tmp_path / "folder" / "common-period.json")
    place.parent.symlink_to(tmp_path / "folder")
    assert verify(place, tmp_path).reason == reason
    place.parent.unlink()
    (tmp_path / "folder").rename(place.parent)
    alias = tmp_path / "alias"
    alias.symlink_to(tmp_path)
    assert verify(alias / "certificates" / "okajima2023" / "common-period.json", tmp_path).reason == reason
    with pytest.raises(Refused, match=reason):
        check(json.loads(foreign), tmp_path, ("okajima2023", "common-period"))


def test_each_line_says_whose_plant_it_is_about(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    schedule = {"statement": "multirate.dual-rate", "parameters": {"periods": [2, 3], "offsets": [0, 0]}}
    certificate = {**json.loads((FOLDER / "dual-rate.json").read_bytes()), **schedule, **OWN}
    (tmp_path / "dual-rate.json").write_text(json.dumps(certificate), encoding="utf-8")
    assert report([FOLDER / "dual-rate.json", tmp_path]) == 0
    paper, own, _ = capsys.readouterr().out.splitlines()
    assert ".json: okajima2023: All sensors" in paper
    assert ".json: own plant: the claim does not hold: It is not so that all sensors" in own


def test_no_character_of_a_certificate_forges_a_line_or_stops_the_report(tmp_path: Path) -> None:
    assert printable("a\nb\x1b\ud800\u2028é", "ascii") == r"a\nb\x1b\ud800\u2028\xe9"
    (tmp_path / "odd\nproved é.json").write_text('{"\\ud800": 1}', encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(ROOT / "verify.py"), str(tmp_path)],
        env={"PYTHONIOENCODING": "ascii", "LC_ALL": "C"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr, len(done.stdout.splitlines())) == (1, "", 2)
    assert "NOT PROVED" in done.stdout


def test_no_name_of_a_file_looks_like_a_theorem(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = {**json.loads((FOLDER / "common-period.json").read_bytes()), **OWN}
    (tmp_path / "a.json: okajima2023: All is well. .json").write_text(json.dumps(own), encoding="utf-8")
    assert report([tmp_path]) == 0
    assert capsys.readouterr().out.startswith(
        f"proved '{tmp_path}/a.json: okajima2023: All is well. .json': own plant:"
    )


def test_a_reader_that_leaves_is_no_error() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, str(ROOT / "verify.py"), str(FOLDER / "rows.json")]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")


def test_nothing_to_verify_is_no_success(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert report([tmp_path]) == 1
    assert capsys.readouterr().out == "0 of 0 certificates proved\n"
    assert report([FOLDER / "rows.json"]) == 0


def test_every_paper_with_theorems_is_read() -> None:
    assert set(papers()) == {path.parent.name for path in (ROOT / "papers").glob("*/theorems.json")}


def test_a_list_of_theorems_is_read_strictly(tmp_path: Path) -> None:
    entry = json.loads((ROOT / "papers" / "okajima2023" / "theorems.json").read_bytes())[0]
    path = tmp_path / "papers" / "own" / "theorems.json"
    path.parent.mkdir(parents=True)
    for listed, reason in (
        ([entry, entry], rf"theorems.json\[1\]: the name {entry['name']} stands twice"),
        ([{**entry, "parameters": []}], r"theorems.json\[0\].parameters must be an object"),
        ([{**entry, "claims": "all"}], r"theorems.json\[0\].claims must be a list"),
        ({"theorems": [entry]}, "theorems.json must be a list"),
    ):
        path.write_text(json.dumps(listed), encoding="utf-8")
        with pytest.raises(Refused, match=reason):
            theorems("own", tmp_path)


def test_a_broken_list_of_theorems_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "papers" / "own").mkdir(parents=True)
    (tmp_path / "papers" / "own" / "theorems.json").write_text('[{"name": "x"}]', encoding="utf-8")
    assert report([], tmp_path) == 1
    assert capsys.readouterr().out == (
        "NOT PROVED: papers/own/theorems.json[0] lacks the field claims, statement, plant, parameters\n"
    )


def test_printed_data_are_strings_and_integers(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="has no plant named 'other'; there are stable"):
        plant("okajima2023", "other")
    path = tmp_path / "printed.toml"
    path.write_text(
        '[A]\nplace = "p"\nvalue = "[1 2]"\n[N]\nplace = "q"\n[N.value]\na = ["0.1", 3]\n', encoding="utf-8"
    )
    assert printed(path) == {"A": "[1 2]", "N": {"a": ["0.1", 3]}}
    assert printed(tmp_path / "none.toml") == {}
    for content, reason in (
        ("[A]\nvalue = 0.1\n", "the number 0.1 is not exact"),
        ("[A]\nvalue = nan\n", "the number nan is not exact"),
        ('[A]\nplace = "p"\n', r"\[A\] has no value"),
        ("A = 1\n", r"\[A\] has no value"),
        ("[A\n", "is not valid TOML"),
    ):
        path.write_text(content, encoding="utf-8")
        with pytest.raises(Refused, match=reason):
            printed(path)


def test_printed_numbers_are_exact() -> None:
    assert [decimal(text) for text in ("0.10", "-.5", "3", "1e-2", "+2.5e1", "7.")] == [
        fmpq(1, 10), fmpq(-1, 2), fmpq(3), fmpq(1, 100), fmpq(25), fmpq(7)
    ]  # fmt: skip
    for text in ("", ".", "1,5", "nan", "1e", "e3", "0x1", "1/2", "--1"):
        with pytest.raises(Refused, match="is not a decimal number"):
            decimal(text)
    assert printed_matrix("[1 -0.5; .25 3]") == fmpq_mat([[1, fmpq(-1, 2)], [fmpq(1, 4), 3]])
    for text in ("1 2", "[1 2", "1 2]", "[1 2; 3]", "[1 x]"):
        with pytest.raises(Refused):
            printed_matrix(text)
    assert printed_poles("(1.5, -2±0.25i)") == [[fmpq(3, 2), 0], [fmpq(-2), fmpq(1, 4)]]
    assert printed_poles("(1.5±0.5i, 12)") == [[fmpq(3, 2), fmpq(1, 2)], [fmpq(12), 0]]
    assert half_unit("(1.0, 1.08±0.24i, 1.031)") == fmpq(1, 2000)
    for text in ("1.5", "(1.5", "1.5)"):
        with pytest.raises(Refused, match="not a printed list of poles"):
            printed_poles(text)


def test_numbers_in_sentences_are_rounded_to_their_side() -> None:
    assert (below(fmpq(2, 3), 3), above(fmpq(2, 3), 3)) == ("0.666", "0.667")
    assert (below(fmpq(-2, 3), 3), above(fmpq(-2, 3), 3)) == ("-0.667", "-0.666")
    assert (below(fmpq(1, 2)), above(fmpq(5))) == ("0.500000000", "5.000000000")


def test_the_folder_of_papers_is_a_name_of_python(tmp_path: Path) -> None:
    assert folder_of(tmp_path) == tmp_path / "papers"
    settings = tmp_path / "replication.toml"
    settings.write_text('papers = "studies"')
    assert folder_of(tmp_path) == tmp_path / "studies"
    for wrong, message in (
        ('papers = "my-papers"', "must be a name of Python, got my-papers"),
        ('papers = "é"', "got é"),
        ("papers", "TOML"),
    ):
        settings.write_text(wrong, encoding="utf-8")
        with pytest.raises(Refused, match=message):
            folder_of(tmp_path)


TWO = """
from replication.verify.statement import Statement
one, two = (Statement(name, "", "", {{}}, None, 53, (), print) for name in ("{key}.one", "toy.two"))
"""


def test_a_statement_of_a_paper_is_found_by_its_name(tmp_path: Path) -> None:
    folder = tmp_path / "papers" / "toy"
    folder.mkdir(parents=True)
    (folder / "statements.py").write_text(TWO.format(key="toy"), encoding="utf-8")
    assert [own_statement(name, "toy", tmp_path).name for name in ("toy.one", "toy.two")] == ["toy.one", "toy.two"]
    for name, paper in (("toy.three", "toy"), ("toy.one", None), ("toy.one", "other")):
        with pytest.raises(Refused, match=f"there is no statement '{name}'"):
            own_statement(name, paper, tmp_path)
    (folder / "statements.py").write_text(TWO.format(key="other"), encoding="utf-8")
    with pytest.raises(Refused, match=r"toy/statements.py declares other.one, which must begin with toy\."):
        own_statement("toy.two", "toy", tmp_path)


# Certificates checked in several processes: same lines in the same order, lost ones told, a clean end.


SOME = [FOLDER / f"{name}.json" for name in ("rows", "gains-38", "variables", "absent", "product")]


def doubled(number: int) -> int:
    if number < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    # The first ones have most to do, and are done last.
    sum(range(10**6 // (1 + number)))
    return 2 * number


@pytest.mark.parametrize("count", [1, 2, 3, 100])
def test_answers_come_in_the_order_of_the_list(count: int) -> None:
    assert list(in_order(doubled, range(7), count, lambda number: -1)) == [0, 2, 4, 6, 8, 10, 12]
    assert list(in_order(doubled, [], count, lambda number: -1)) == []


def test_a_process_that_is_killed_is_told_and_takes_no_other_with_it() -> None:
    items = [0, 1, -5, 2, -7, 3, -9]
    assert list(in_order(doubled, items, 2, lambda item: item)) == [0, 2, -5, 4, -7, 6, -9]


@pytest.mark.parametrize("both", [False, True])
def test_the_report_is_the_same_whatever_the_number(both: bool, capsys: pytest.CaptureFixture[str]) -> None:
    told = []
    for count in (1, 2):
        assert (twice.report if both else report)(SOME, ROOT, count) == 1
        told.append(capsys.readouterr().out)
    assert told[0] == told[1]
    assert [line.split(" ")[0] for line in told[0].splitlines()] == ["proved"] * 3 + ["NOT", "proved", "4"]


def test_a_check_that_is_killed_proves_nothing(tmp_path: Path) -> None:
    """One that takes long enough to be found; a killed one is tried once more, alone."""
    slow, quick = ROOT / "certificates" / "mustafa" / "duration-2-upper.json", SOME[0]
    code = (
        "import os, signal\nfrom replication.verify import run\n"
        "before = run.verify\n"
        "def verify(path, root):\n"
        "    return os.kill(os.getpid(), signal.SIGKILL) if path.stem == 'duration-2-upper' else before(path, root)\n"
        "run.verify = verify\n"
        "from replication.verify.run import report\nfrom pathlib import Path\n"
        f"raise SystemExit(report([Path({str(slow)!r}), Path({str(quick)!r})], jobs=2))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    first, second, last = done.stdout.splitlines()
    assert first == f"NOT PROVED {slow}: the process that checked it was killed, or crashed"
    assert second.startswith("proved") and last == "1 of 2 certificates proved"
    assert (done.returncode, done.stderr) == (1, "")


@pytest.mark.parametrize("count", ["1", "2"])
def test_an_interrupt_ends_all_processes_in_few_words(count: str) -> None:
    command = [sys.executable, str(ROOT / "verify.py"), "--jobs", count]
    # What is begun in the background of a shell ignores Ctrl-C, and so would its children.
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as running:
        assert running.stdout is not None
        running.stdout.readline()
        os.killpg(running.pid, signal.SIGINT)
        said = running.communicate(timeout=PATIENCE)[1]
    assert running.returncode == 130
    assert said == "interrupted: not all certificates were checked\n"
    with pytest.raises(ProcessLookupError):
        os.killpg(running.pid, 0)


def test_a_process_hears_an_interrupt_once_it_knows_how_to_leave() -> None:
    """Before, it would tell what it was doing; afterwards it ends at once."""
    program = (
        "import os, signal\nfrom replication.verify import workers\nready = workers._end_with_parent\n"
        "def deaf():\n    return str(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))\n"
        "def begin():\n    os.environ['FIRST'] = deaf()\n    ready()\n"
        "def check(item):\n    return os.environ['FIRST'], deaf()\n"
        "workers._end_with_parent = begin\n"
        "print(*workers.in_order(check, range(4), 2, str), deaf())\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE, check=True)
    assert done.stdout.replace("('True', 'False') ", "") == "False\n"


@pytest.mark.parametrize("text", ["0", "-1", "two", "1.5", "9" * 12])
def test_a_number_of_processes_is_a_number(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="whole number of at least 1"):
        jobs(text)
    assert jobs("3") == 3

"""Slips of whoever writes a paper: each is told with file, line and cure, and has its exit code."""

import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from lab import Lab, emptied, make_inside
from sample import claim
from tables import rows

from replication.audit.inspect.headline import factor
from replication.audit.judge.verdict import plain
from replication.audit.model import Evidence, Kind, Verdict
from replication.audit.run.chance import shared_state
from replication.errors import AuditError
from replication.scaffold import scaffold

CLAIMS = "toy2020/claims.py"
AT = r" \[papers/toy2020/claims\.py:\d+\]"


def test_fields_of_another_type_are_told_together_before_anything_is_computed(lab: Lab) -> None:
    lab.edit(CLAIMS, "kind=Kind.ORDER", 'kind="order"')
    lab.edit(CLAIMS, 'printed="4.0"', "printed=4.0")
    lab.edit(CLAIMS, 'uses=("toy2020.square",)', 'uses=("toy2020.square")')
    lab.edit(CLAIMS, "published=True", 'published="yes"')
    lab.edit("toy2020/__init__.py", 'authors=("A. Toy",)', 'authors="A. Toy"')
    lab.edit("toy2020/experiments.py", 'inputs={"size": 200, "seed": 1}', "inputs=[2]")
    done = lab.cli("run")
    assert (done.returncode, done.stdout) == (2, "")
    for words in (
        rf"claim 'toy2020.wait.patient': kind is 'order'; write one of Kind.VALUE, .*{AT}",
        rf"claim 'toy2020.square.two': printed is 4.0; .* is a string, whose digits are its tolerance: \"1.50\"{AT}",
        rf"figure 'toy2020-fig1': uses is 'toy2020.square'; .*with a comma: \('name',\){AT}",
        rf"figure 'toy2020-fig1': published is 'yes'; .*{AT}",
        r"paper 'toy2020': authors is 'A. Toy'; expected `array`, got `str`",
        r"experiment 'toy2020.spectrum': inputs is \[2\]; give a dictionary",
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
    lab.edit(CLAIMS, 'printed="4.1"', 'printed="0.0040"')
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
        f"note: no figure is called toy2020-old.svg; remove what is left in {lab.root / 'figures'}",
    ]


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


CSV = "name,mean\na,0.5\nb,nan\nc,75%\n"
FIT = "echo '{\"mean\": 0.751}'"
"""Files of a paper as it is begun, in which something is changed."""


@pytest.mark.parametrize(("file", "old", "new", "code", "words"), rows("begun"))
def test_what_is_wrong_in_a_paper_as_it_is_begun_is_told(
    tmp_path: Path, file: str, old: str, new: str, code: int, words: str
) -> None:
    inside = emptied(make_inside(tmp_path))
    scaffold("toy", inside.root)
    for name, text in {"out/t.csv": CSV, "fit.sh": FIT}.items():
        (inside.root / name).parent.mkdir(exist_ok=True)
        (inside.root / name).write_text(text, encoding="utf-8")
    if file == "claims.toml":
        inside.path("toy/claims.toml").write_text(new, encoding="utf-8")
        read = "\nfrom replication.audit.numbers import numbers\nN = numbers(__file__)\nPOWERS ="
        more = (
            ("\nPOWERS =", read),
            ("parts=(", "parts=(*N.parts, "),
            ("experiments=(", "experiments=(*N.experiments, "),
        )
        for pair in more if old != "unread" else ():
            inside.edit("toy/paper.py", *pair)
    else:
        inside.edit(f"toy/{file}", old, new)
    done = inside.cli("run")
    assert done.returncode == code and re.search(words, done.stdout + done.stderr), done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr


@pytest.mark.parametrize(("value", "words"), rows("units"))
def test_a_usual_unit_is_named_both_ways(value: float, words: str) -> None:
    record = claim("case", Kind.VALUE, Verdict.DIFFERS, "6.00", Evidence(method="Computed", value=value))
    assert factor(record) == words


def test_a_print_of_one_unit_tells_no_factor_and_one_of_several_numbers_one_of_all() -> None:
    assert factor(claim("case", Kind.VALUE, Verdict.DIFFERS, "1", Evidence(method="Computed", value=7.0))) == ""
    assert factor(claim("case", Kind.VALUE, Verdict.DIFFERS, "2", Evidence(method="Computed", value=20.0))) == "10^1"
    for values, words in (((360.0, 420.0), "60"), ((360.0, 7.5), "")):
        evidence = Evidence(method="Computed", value=(values,))
        assert factor(claim("case", Kind.MATRIX, Verdict.DIFFERS, "[6.00 7.00]", evidence)) == words


@pytest.mark.parametrize("outcomes", [{"norm": 1.5}, [("norm", 1.5)], [1.5], 1.5])
def test_outcomes_of_another_form_are_told_with_an_example(outcomes: Any) -> None:
    with pytest.raises(AuditError, match=r"at `\$\.outcomes.*outcomes are a list .*\[\{\"reading\": \"logarithms\""):
        plain(Evidence(method="Computed", outcomes=outcomes))
    record = claim("case", Kind.VALUE, Verdict.ERROR, "6.00", Evidence(method="Computed", outcomes=outcomes))
    assert record.judgement.reason.endswith("where no number is printed [papers/doe1999/claims.py:42]")


def test_what_an_experiment_leaves_behind_is_told_and_reaches_no_other(lab: Lab) -> None:
    made = "import decimal, numpy, os\nLEFT, SEEN, COUNT = [], numpy.zeros(1), 0\n"
    leaves = """    global COUNT
    COUNT, SEEN[0], decimal.getcontext().prec, os.environ["LEFT"] = 1, 1, 3, "1"
    LEFT.append(1)
    os.chdir("/")
    numpy.seterr(all="raise")
    numpy.set_printoptions(precision=3)
    solver = """
    finds = (
        "len(squares.LEFT) + squares.SEEN[0] + squares.COUNT + float(1 / decimal.Decimal(3)) + ('LEFT' in os.environ) "
        "+ (numpy.geterr()['over'] == 'raise') + (numpy.get_printoptions()['precision'] == 3)"
    )
    lab.edit("toy2020/squares.py", "\n\ndef square", f"\n{made}\n\ndef square")
    lab.edit("toy2020/squares.py", "    solver = ", leaves)
    lab.edit("other2021.py", "\n\ndef half", "\nimport decimal, numpy, os\nfrom .toy2020 import squares\n\ndef half")
    lab.edit("other2021.py", "value / 2", f"value / 2 + {finds} + (os.getcwd() == '/')")
    lab.edit("other2021.py", "other2021", "z2021")
    lab.path("other2021.py").rename(lab.path("z2021.py"))
    told = lab.audit("toy2020", "z2021")
    assert told["values"]["z2021.half"] == 1.5 + 1 / 3
    untraced = {one["name"]: one["untraced"] for one in told["file"]["experiments"] if one["untraced"]}
    assert untraced == {
        "toy2020.square": [f"changes {name} of papers.toy2020.squares" for name in ("COUNT", "LEFT", "SEEN")]
    }


def test_what_is_left_behind_again_is_told_again(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("left_behind")
    module.__file__, deep = "left_behind.py", {"a": [[1]]}
    monkeypatch.setattr(module, "DEEP", deep, raising=False)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    for _ in range(3):
        told: list[str] = []
        with shared_state(told.append, lambda file: file == module.__file__):
            deep["a"][0].append(2)
        assert told == ["changes DEEP of left_behind"]
        assert deep == {"a": [[1]]}


def test_what_a_claim_does_to_a_result_reaches_no_other(lab: Lab) -> None:
    lab.edit(CLAIMS, 'value=results["square"]["squares"][1]', 'value=results["square"]["squares"].pop(1)')
    assert lab.cli("run").returncode == 0


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


@pytest.mark.slow
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

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from lab import AUDIT, Lab, hear_interruptions, make_lab

from tests.patience import PATIENCE, wait_for

pytestmark = pytest.mark.slow
"""Each runs the program in a process of its own."""

ALL = {"other2021.half", "toy2020.square", "toy2020.spectrum", "toy2020.wait-a", "toy2020.wait-b"}


@pytest.fixture
def apart(tmp_path: Path) -> Lab:
    """For what is on processes."""
    return make_lab(tmp_path)


def done(answer: dict[str, Any], action: str) -> set[str]:
    return {name for name, (what, _, _) in answer["log"].items() if what == action}


def reason(answer: dict[str, Any], name: str) -> str:
    return str(answer["log"][name][1])


def verdicts(answer: dict[str, Any]) -> dict[str, str]:
    return {claim["claim"]["id"]: claim["judgement"]["verdict"] for claim in answer["file"]["claims"]}


def without_seconds(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: without_seconds(entry) for key, entry in value.items() if key != "seconds"}
    return [without_seconds(entry) for entry in value] if isinstance(value, list) else value


def test_second_run_computes_nothing_and_says_the_same(lab: Lab) -> None:
    assert done(lab.audit("other2021"), "computed") == {"other2021.half"}
    first, second = lab.audit(), lab.audit()
    assert done(first, "computed") == ALL - {"other2021.half"} and done(second, "reused") == ALL
    assert {reason(first, name) for name in done(first, "computed")} == {"never ran"}
    for part in ("file", "values"):
        assert json.dumps(second[part]) == json.dumps(first[part])
    tiny = second["values"]["toy2020.spectrum"]["tiny"]
    assert tiny == [5e-324, -0.0, 0.1 + 0.2] and str(tiny[1]) == "-0.0"


def test_number_of_jobs_does_not_change_a_byte(apart: Lab) -> None:
    one = apart.audit(jobs=1, read=False, OMP_NUM_THREADS="2")
    three = apart.audit(jobs=3, read=False)
    assert done(one, "computed") == done(three, "computed") == ALL
    assert json.dumps(three["values"]) == json.dumps(one["values"])
    assert json.dumps(without_seconds(three["file"])) == json.dumps(without_seconds(one["file"]))


def test_records_say_what_ran_and_what_solved(lab: Lab) -> None:
    lab.edit("toy2020/claims.py", '["waited"] == "a"', '["waited"] == "a" and "waited" in results["wait-b"]')
    answer = lab.audit()
    (square,) = (record for record in answer["file"]["experiments"] if record["name"] == "toy2020.square")
    assert square["function"] == "papers.toy2020.squares:square"
    assert square["code"].startswith("papers/toy2020/squares.py:")
    assert square["inputs"] == {"values": [1.0, 2.0, 0.1]}
    assert [solver["name"] for solver in square["solvers"]] == ["abacus"]
    assert answer["file"]["papers"][1]["findings"] == ["Two squared is 4.0."]
    assert answer["file"]["errata"][0]["holds"] is True
    (patient,) = (claim for claim in answer["file"]["claims"] if claim["claim"]["id"] == "toy2020.wait.patient")
    read = {record["name"]: record["seconds"] for record in answer["file"]["experiments"]}
    assert patient["claim"]["uses"] == ["toy2020.wait-a", "toy2020.wait-b"]
    assert patient["evidence"]["seconds"] == read["toy2020.wait-a"] + read["toy2020.wait-b"]
    assert patient["evidence"]["code"].startswith("papers/toy2020/claims.py:")


def test_inputs_lock_and_damage_are_reasons(lab: Lab) -> None:
    lab.audit()
    lab.edit("toy2020/experiments.py", '"seed": 1', '"seed": 2')
    entry = lab.root / ".cache" / "toy2020.wait-a.json"
    entry.write_bytes(entry.read_bytes()[:-20])
    answer = lab.audit()
    assert done(answer, "computed") == {"toy2020.spectrum", "toy2020.wait-a"}
    assert reason(answer, "toy2020.spectrum") == "changed: inputs"
    assert reason(answer, "toy2020.wait-a") == "entry unreadable"
    (lab.root / "requirements.lock").write_text("numpy==2\n", encoding="utf-8")
    answer = lab.audit()
    assert {reason(answer, name) for name in ALL} == {"changed: lock"}
    answer = lab.audit(read=False)
    assert {reason(answer, name) for name in ALL} == {"the cache was not asked"}


@pytest.mark.parametrize(
    ("planted", "message"),
    [
        ("raise ValueError('planted\\nfault')", "ValueError: planted fault [papers/toy2020/squares.py:9]"),
        ("return {'x': float('nan')}", "AuditError: the result of toy2020.square.x is nan"),
        ("return {'solvers': [1]}", "AuditError: the result of toy2020.square: an entry of `solvers`"),
    ],
)
def test_a_failing_experiment_is_an_error_of_what_uses_it_alone(lab: Lab, planted: str, message: str) -> None:
    lab.edit("toy2020/squares.py", "    solver = ", f"    {planted}\n    solver = ")
    answer = lab.audit()
    assert done(answer, "failed") == {"toy2020.square"}
    assert answer["log"]["toy2020.square"][2].startswith(message)
    assert verdicts(answer) == {
        "other2021.half": "reproduced",
        "toy2020.square.two": "error",
        "toy2020.square.wrong": "error",
        "toy2020.wait.patient": "consistent",
    }
    claim = answer["file"]["claims"][1]
    assert message in claim["judgement"]["reason"] and "toy2020.square failed" in claim["judgement"]["reason"]
    assert "toy2020.square failed" in answer["file"]["errata"][0]["error"]
    assert answer["file"]["errata"][0]["holds"] is False
    assert answer["failures"][0].startswith("findings of toy2020:")
    assert "toy2020.square" not in answer["values"]
    assert done(lab.audit(), "failed") == {"toy2020.square"}


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_ends_its_process_is_an_error_of_its_experiment_alone(apart: Lab, jobs: int) -> None:
    apart.edit("toy2020/squares.py", "    solver = ", "    raise SystemExit(3)\n    solver = ")
    apart.edit("toy2020/spectra.py", "    matrix = ", "    import os\n    os._exit(0)\n    matrix = ")
    apart.edit("other2021.py", "return value / 2", "__import__('os').kill(__import__('os').getpid(), 9)")
    answer = apart.audit(jobs=jobs)
    assert done(answer, "failed") == {"toy2020.square", "toy2020.spectrum", "other2021.half"}
    assert answer["log"]["toy2020.square"][2] == "SystemExit: 3 [papers/toy2020/squares.py:9]"
    for name in ("toy2020.spectrum", "other2021.half"):
        assert "the process was killed" in answer["log"][name][2]
    assert done(answer, "computed") == {"toy2020.wait-a", "toy2020.wait-b"}


BOTH = 'results["wait-a"] and results["wait-b"]'


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('return Evidence(method="waiting"', 'raise KeyError("lost")\n    return Evidence(method="x"', "lost"),
        (
            'results["wait-a"]["waited"]',
            'results["wait-c"]["waited"]',
            "there is no experiment wait-c",
        ),
        ('return Evidence(method="waiting"', f'return {BOTH} and 3\n    return Evidence(method="x"', "answered 3"),
    ],
)
def test_a_failing_answer_is_an_error_of_its_claim_alone(lab: Lab, old: str, new: str, words: str) -> None:
    lab.edit("toy2020/claims.py", old, new)
    answer = lab.audit()
    assert verdicts(answer)["toy2020.wait.patient"] == "error"
    assert words in answer["file"]["claims"][3]["judgement"]["reason"]
    assert verdicts(answer)["toy2020.square.two"] == "reproduced"


def test_wrong_arguments_are_told_without_a_line_of_the_machinery(lab: Lab) -> None:
    lab.edit("toy2020/experiments.py", '"label": "a"', '"lable": "a"')
    answer = lab.audit()
    assert "unexpected keyword argument 'lable'" in answer["log"]["toy2020.wait-a"][2]
    assert "worker.py" not in answer["log"]["toy2020.wait-a"][2]
    assert "[papers/toy2020/claims.py:" in answer["file"]["claims"][3]["judgement"]["reason"]
    assert "assemble.py" not in answer["file"]["claims"][3]["judgement"]["reason"]


def test_malformed_proofs_and_findings_are_errors(lab: Lab) -> None:
    lab.edit("toy2020/claims.py", 'quantities={"four": ', 'quantities={"four": float("inf") * ')
    lab.edit("toy2020/__init__.py", "findings=lambda results: (", "findings=lambda results: 7 or (")
    wrong = "sensitivity=lambda results: 1 // 0, common=lambda results: results['lost'],"
    lab.edit("other2021.py", 'key="other2021",', f'key="other2021", {wrong}')
    answer = lab.audit()
    *others, findings = answer["failures"]
    assert [told.partition(": ")[0] for told in others] == ["sensitivity of other2021", "common levels of other2021"]
    assert "four is inf" in answer["file"]["errata"][0]["error"]
    assert "tuple of sentences, got 7" in findings
    assert findings.removeprefix("findings of toy2020: ") in answer["file"]["papers"][1]["findings"][0]


def test_a_function_without_a_name_is_refused_before_anything_runs(apart: Lab) -> None:
    apart.edit("other2021.py", "function=half", "function=lambda value: value")
    answer = apart.python("-c", AUDIT, json.dumps({"papers": [], "jobs": 1, "read": True}))
    assert answer.returncode == 1
    assert "experiment other2021.half" in answer.stderr and "define it with def at module level" in answer.stderr
    assert not (apart.root / ".cache").exists()


def test_sources_edited_during_the_run_are_not_taken_for_what_ran(lab: Lab) -> None:
    edit = "Path(__file__).with_name('arithmetic.py').open('a').write('# edited')"
    lab.edit("toy2020/squares.py", "    solver = ", f"    from pathlib import Path\n    {edit}\n    solver = ")
    answer = lab.audit()
    assert reason(answer, "toy2020.square") == "not kept: its sources or data were edited while it ran"
    assert not (lab.root / ".cache" / "toy2020.square.json").exists()


def start(lab: Lab, jobs: int) -> subprocess.Popen[str]:
    """A run in which the second of the two waiting experiments takes a minute, once the others are stored."""
    lab.edit("toy2020/experiments.py", '"seconds": 0.0, "label": "b"', '"seconds": 60.0, "label": "b"')
    options = json.dumps({"papers": [], "jobs": jobs, "read": True})
    process = subprocess.Popen(
        [sys.executable, "-c", AUDIT, options],
        cwd=lab.root,
        env=lab.environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=hear_interruptions,
    )
    wanted = ALL - {"toy2020.wait-b"}
    wait_for(
        lambda: all((lab.root / ".cache" / f"{name}.json").exists() for name in wanted), lambda: process.poll() is None
    )
    return process


def alive(group: int) -> list[str]:
    """The processes of a group; one that has ended and that nobody has waited for yet is listed as Z."""
    listed = subprocess.run(["ps", "-A", "-o", "pgid=,stat=,args="], capture_output=True, text=True, check=True).stdout
    lines = [line.split(maxsplit=2) for line in listed.splitlines()]
    return [arguments for found, state, arguments in lines if int(found) == group and not state.startswith("Z")]


@pytest.mark.parametrize(
    ("jobs", "blow", "strike"),
    [
        (1, signal.SIGKILL, os.kill),
        (2, signal.SIGKILL, os.kill),
        (2, signal.SIGTERM, os.kill),
        (1, signal.SIGINT, os.killpg),
        (2, signal.SIGINT, os.killpg),
        (2, signal.SIGINT, os.kill),
    ],
)
def test_an_interrupted_run_leaves_no_process_and_resumes(
    lab: Lab, jobs: int, blow: signal.Signals, strike: Callable[[int, int], None]
) -> None:
    process = start(lab, jobs)
    strike(process.pid, blow)
    assert process.wait(timeout=PATIENCE) != 0
    wait_for(lambda: alive(process.pid) == [])
    lab.edit("toy2020/experiments.py", '"seconds": 60.0', '"seconds": 0.0')
    answer = lab.audit()
    assert done(answer, "reused") == ALL - {"toy2020.wait-b"}
    assert done(answer, "computed") == {"toy2020.wait-b"}
    assert sorted(path.name for path in (lab.root / ".cache").iterdir()) == sorted(f"{name}.json" for name in ALL)


def test_ctrl_c_while_processes_begin_is_not_lost() -> None:
    """It comes as soon as a result is stored, when the next task is handed out; the processes do not hear it."""
    from replication.audit.run import worker

    ask = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))"
    before, lost = signal.signal(signal.SIGINT, signal.default_int_handler), []
    try:
        with worker._deaf_children():
            child = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, timeout=PATIENCE)
        with pytest.raises(KeyboardInterrupt):
            with worker._deaf_children():
                os.kill(os.getpid(), signal.SIGINT)
            lost.append("not heard")
    finally:
        signal.signal(signal.SIGINT, before)
    assert (child.stdout, lost) == ("True\n", [])
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_the_precision_of_mpmath_is_put_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """The package is none of this project's, so a stand-in has what is used of it."""
    from replication.audit.run import chance

    @contextlib.contextmanager
    def workprec(bits: int) -> Iterator[None]:
        yield
        package.mp.prec = bits

    package = SimpleNamespace(mp=SimpleNamespace(prec=53), workprec=workprec)
    monkeypatch.setitem(sys.modules, "mpmath", package)
    with chance._settings():
        package.mp.prec = 200
    assert package.mp.prec == 53


def test_no_process_of_a_run_hears_ctrl_c() -> None:
    """Also the first ones, with which a process of another kind begins; the one that runs them hears it again."""
    program = (
        "import os, signal\nfrom replication.audit.run import worker\nasked = signal.SIG_BLOCK, ()\n"
        "executor, answers = worker._executor(2), []\nfor _ in range(4):\n    with worker._deaf_children():\n"
        "        answers.append(executor.submit(signal.pthread_sigmask, *asked))\n"
        "blocked = [*(answer.result() for answer in answers), signal.pthread_sigmask(*asked)]\n"
        "print([signal.SIGINT in signals for signals in blocked])\n"
        "worker._end(executor)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE)
    assert (done.stdout, done.stderr) == ("[True, True, True, True, False]\n", "")


def test_processes_end_where_nothing_lists_their_children(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small containers have no `pgrep`; joblib would then wait for minutes."""
    from replication.audit.run import worker

    monkeypatch.setattr(worker.shutil, "which", lambda name: None)
    monkeypatch.setattr(worker.importlib.util, "find_spec", lambda name: None)
    executor = worker._executor(1)
    executor.submit(time.sleep, 2 * PATIENCE)
    (process,) = executor._processes.values()
    worker._end(executor)
    assert process.exitcode == -signal.SIGKILL

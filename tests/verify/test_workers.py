"""Certificates checked in several processes: same lines in the same order, lost ones told, a clean end."""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from replication import twice
from replication.verify.run import report
from replication.verify.workers import in_order, jobs
from tests.patience import PATIENCE

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "certificates" / "okajima2023"
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


@pytest.mark.parametrize("text", ["0", "-1", "two", "1.5", "9" * 12])
def test_a_number_of_processes_is_a_number(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="whole number of at least 1"):
        jobs(text)
    assert jobs("3") == 3

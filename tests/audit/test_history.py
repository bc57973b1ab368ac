"""The history of verdicts: what git keeps of the table is told claim by claim, and nothing else is."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from cases import recorded, results_file

from replication.audit.model import Evidence
from replication.audit.publish.history import ABSENT, HEAD, TABLE, read_table, steps, table
from replication.errors import AuditError


def git(root: Path, *arguments: str) -> None:
    identity = ["-c", "user.name=A", "-c", "user.email=a@example.org"]
    subprocess.run(["git", "-C", str(root), *identity, *arguments], capture_output=True, check=True)


def commit(root: Path, *rows: str) -> None:
    path = root / TABLE
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join([",".join(HEAD), *rows, ""]), encoding="utf-8")
    git(root, "add", ".")
    git(root, "commit", "--quiet", "--allow-empty", "-m", "run")


def test_each_change_is_told_once_with_its_commit(tmp_path: Path) -> None:
    git(tmp_path, "init", "--quiet")
    commit(tmp_path, "roe.a,differs,no", "roe.b,reproduced,no", "roe.old,refuted,no")
    commit(tmp_path, "roe.a,differs,no", "roe.b,reproduced,no", "roe.old,refuted,no")
    commit(tmp_path, "roe.a,compatible,no", "roe.b,reproduced,yes", "roe.new,consistent,no")
    found = [(step.claim, step.old, step.new) for step in steps(tmp_path)]
    assert found == [
        ("roe.a", "differs", "compatible"),
        ("roe.b", "reproduced", "reproduced, proved"),
        ("roe.new", ABSENT, "consistent"),
        ("roe.old", "refuted", ABSENT),
    ]
    commit(tmp_path, "roe.a,differs,no", "roe.b,reproduced,yes", "roe.new,consistent,no")
    last = steps(tmp_path)[-1]
    head = subprocess.run(["git", "-C", str(tmp_path), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    assert head.stdout.startswith(last.commit) and str(last).endswith("roe.a: compatible -> differs")


def test_the_table_of_a_run_is_read_as_it_was_written() -> None:
    record = recorded(Evidence(method="m", value=1.33))
    assert read_table(table(results_file(record))) == {record.id: str(record.verdict)}


def test_where_there_is_no_table_the_cure_is_named(tmp_path: Path) -> None:
    with pytest.raises(AuditError, match="make readme"):
        steps(tmp_path)
    with pytest.raises(AuditError, match="must have the columns"):
        read_table("claim,verdict\nroe.a,differs\n")
    with pytest.raises(AuditError, match="must have the columns"):
        read_table(f"{','.join(HEAD)}\nroe.a,differs\n")

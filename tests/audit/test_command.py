"""Experiments by command: any language, hashed and recorded, and each bad input has an error of its own."""
# ruff: noqa: E501 - a case on a line

import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
from lab import Lab, emptied, make_inside
from tables import rows

from replication.audit.declare import command
from replication.audit.publish.linked_data import Software, filled
from replication.audit.run.command import execute, held
from replication.audit.run.tracing import noted, traced
from replication.audit.store.records import read_results
from replication.audit.store.sources import SourceTree
from replication.errors import AuditError


def answer(root: Path, line: list[str], needed: dict[str, str] | None = None, **more: Any) -> Any:
    made = command("toy", line, **more)
    return execute(**made.inputs, root=str(root), store=str(root / "store"), needed=needed or {})


def sh(text: str) -> list[str]:
    return ["sh", "-c", text]


def test_it_sees_what_it_declares_and_answers_in_json_or_csv(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").mkdir()
    for name, text in {"data/a.csv": "x,name\n1.5,u\n2,v\n", "data/.hidden": "3", "other": "4"}.items():
        (tmp_path / name).write_text(text)
    monkeypatch.setenv("GIVEN", "5")
    monkeypatch.setenv("SECRET", "6")
    seen = 'printf \'["%s", "%s", "%s", "%s"]\' "$(find . -type f)" "$GIVEN" "$SECRET" "$LC_ALL"'
    assert answer(tmp_path, sh(seen), reads=["data/"], variables=["GIVEN"]) == ["./data/a.csv", "5", "", "C.UTF-8"]
    copied = answer(tmp_path, sh("cp data/a.csv out.csv"), reads=["data"], writes=["out.csv"], answer="out.csv")
    assert copied == {"x": [1.5, 2.0], "name": ["u", "v"]}
    assert answer(
        tmp_path, sh("mkdir -p o; echo '{\"a\": [1]}' > o/r.json"), writes=["o/r.json"], answer="o/r.json"
    ) == {"a": [1]}
    assert answer(tmp_path, sh("echo 1 > o.bin"), writes=["o.bin"]) == {"files": ["o.bin"]}
    assert {path.name for path in (tmp_path / "store").iterdir()} and not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(("text", "read", "named"), rows("outside"))
def test_what_a_script_names_outside_counts_or_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, read: bool, named: str
) -> None:
    root, out = tmp_path / "in", tmp_path / "out"
    root.mkdir()
    out.mkdir()
    (out / "k.txt").write_text("1")
    monkeypatch.setenv("GIVEN", str(out))
    (out / "more.sh").write_text(f". {out}/k.txt")
    (root / "fit.sh").write_text(text.replace("OUT", str(out)).replace("UP", f"{'../' * 9}{str(out)[1:]}"))
    variables = ["GIVEN"] * ("$GIVEN" in text)
    with traced(root) as trace:
        assert answer(root, ["sh", "fit.sh"], reads=["fit.sh"], variables=variables) == 1
    assert (str(out / "k.txt") in noted(trace, SourceTree({}), ())[0]) == read
    assert list(trace.untraced) == [f"files in {named.replace('OUT', str(out))}"] * bool(named)
    assert not {"./work", "./tmp"} & noted(trace, SourceTree({}), ())[0].keys()


def test_its_home_is_empty_and_may_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "k").write_text("2")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "in").mkdir()
    line = sh("cat ~/k 2> /dev/null || { echo 1 > ~/k; cat ~/k; }")
    assert answer(tmp_path / "in", line) == 1
    with traced(tmp_path / "in") as trace:
        assert answer(tmp_path / "in", line, variables=["HOME"]) == 2
    assert f"files in {tmp_path / 'home'}" in trace.untraced


@pytest.mark.parametrize(("line", "more", "words"), rows("bad commands"))
def test_bad_commands_are_told_apart(tmp_path: Path, line: list[str], more: dict[str, Any] | None, words: str) -> None:
    (tmp_path / "in.txt").write_text("1")
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / ".k.txt").write_text("1")
    with pytest.raises(AuditError, match=words):
        answer(tmp_path, [word.replace("ROOT", str(tmp_path)) for word in line], **(more or {}))
    assert (tmp_path / "in.txt").read_text() == ("2\n" if "ROOT/in.txt" in line[-1] else "1")


@pytest.mark.parametrize(
    ("file", "content", "words"),
    [
        ("d.csv", None, "'d.csv' is not in .*, and no .*command.* of claims.toml writes it"),
        ("../d.csv", b"a\n1\n", r"'../d.csv' is not in"),
        ("d.csv", b"a;b\n1;2\n", "d.csv is parted by ';'; write a table with commas"),
        ("d.csv", b"a\tb\n1\t2\n", "d.csv is parted by"),
        ("d.csv", b"a,b\n1,2\n\n3,4,5\n", "d.csv is no table: line 4 has 3 of 2 cells"),
        ("d.csv", b"# by hand\na,b\n1,2\n", "d.csv is no table: line 2 has 2 of 1 cells; .* in every line"),
        ("d.csv", b"", "d.csv is no table: no line is below its names"),
        ("d.csv", b"caf\xe9,b\n1,2\n", "d.csv is no text in UTF-8"),
        ("d.json", b'{"a": 1', "d.json is no JSON"),
    ],
)
def test_a_file_that_cannot_be_read_is_told(tmp_path: Path, file: str, content: bytes | None, words: str) -> None:
    (tmp_path / "in").mkdir()
    if content is not None:
        (tmp_path / "in" / file).write_bytes(content)
    with pytest.raises(AuditError, match=words):
        held(file, "", root=str(tmp_path / "in"), store="", needed={})


def test_a_file_is_held_to_its_checksum(tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_bytes(b"\xef\xbb\xbfa,b\n1,x\n")
    assert held("d.csv", "", root=str(tmp_path), store="", needed={}) == {"a": [1.0], "b": ["x"]}
    with pytest.raises(AuditError, match="not 0123; it is another file than was declared"):
        held("d.csv", "0123", root=str(tmp_path), store="", needed={})


def test_a_file_of_the_project_that_changes_meanwhile_is_named(tmp_path: Path) -> None:
    """As what is left of a first time, when a command writes it again."""
    (tmp_path / "out.csv").write_text("1")
    with traced(tmp_path) as trace:
        assert answer(tmp_path, sh(f"d={tmp_path}; echo 2 > $d/out.csv; echo 1")) == 1
    assert "out.csv changed while it ran" in trace.untraced


@pytest.mark.parametrize(("line", "more", "words"), rows("no commands"))
def test_a_command_that_cannot_be_meant_is_refused(line: Any, more: dict[str, Any] | None, words: str) -> None:
    with pytest.raises(AuditError, match=words):
        command("toy", line, **(more or {}))


NO_LOCK = "packages, clock, draws, child programs and computed paths"
PAPER = """
from replication.audit.declare import Evidence, Part, command, paper
PART = Part("All", reading="none")
@PART.order("value", place="Sec. 1")
def value(results):
    "It is computed."
    return Evidence(method="by its command", cross_check="none", holds=bool(list(map(results.get, {uses!r}))), margin=1.0)
PAPER = paper(key="roe", title="T", authors=("A. Roe",), year=2020, venue="", doi="", summary="", bibtex="",
              parts=(PART,), experiments=({commands}))
"""


def project(root: Path, commands: str, *uses: str, **files: str) -> Lab:
    lab = emptied(make_inside(root / "lab"))
    lab.path("roe").mkdir()
    lab.path("roe/__init__.py").write_text(PAPER.format(uses=uses, commands=commands))
    for name, text in files.items():
        (lab.root / name.replace("_", ".")).write_text(text)
    return lab


NODE = "const fs = require('fs'); console.log(JSON.stringify({mean: fs.readFileSync('d.csv', 'utf8').split('\\n').length}))"
C = '#include <stdio.h>\nint main(void) { printf("{\\"root\\": %.3f}\\n", 1.5 * 1.5); return 0; }\n'
NOTEBOOK = json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": [
    {"cell_type": "code", "id": "a", "metadata": {}, "outputs": [], "execution_count": None,
     "source": "import json; open('n.json', 'w').write(json.dumps({'n': 6 * 7}))"}]})  # fmt: skip
LANGUAGES = {
    "node": ("node", 'command("a", ["node", "fit.js"], reads=["fit.js", "d.csv"], version=["node", "--version"]),', {"fit_js": NODE, "d_csv": "1\n2\n"}, ("fit.js", "length", "length + 1")),
    "c": ("gcc", 'command("b", ["gcc", "-o", "fit", "fit.c"], reads=["fit.c"], writes=["fit"], version=["gcc", "--version"]),'
          'command("a", ["./fit"], needs="b"),', {"fit_c": C}, ("fit.c", "1.5 * 1.5", "1.5 * 1.6")),
    "r": ("Rscript", 'command("a", ["Rscript", "fit.R"], reads=["fit.R"], version=["Rscript", "--version"]),',
          {"fit_R": "cat('{\"m\":', mean(c(1, 2)), '}')"}, ("fit.R", "c(1, 2)", "c(1, 3)")),
    "notebook": (sys.executable, f'command("a", ["{sys.executable}", "-c", "import nbclient.cli; nbclient.cli.main()", "n.ipynb"], reads=["n.ipynb"], writes=["n.json"], answer="n.json"),',
                 {"n_ipynb": NOTEBOOK}, ("n.ipynb", "6 * 7", "6 * 8")),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("language", LANGUAGES)
def test_a_program_in_another_language_is_computed_again_when_its_files_change(tmp_path: Path, language: str) -> None:
    program, commands, files, (name, old, new) = LANGUAGES[language]
    if shutil.which(program) is None:
        pytest.skip(f"{program} is missing; this language is tried where it is installed")
    lab = project(tmp_path, commands, *("ab" if '"b"' in commands else "a"), **files)
    first = lab.cli("run")
    assert first.returncode == 0, first.stdout + first.stderr
    before = json.loads((lab.root / "report" / "results.json").read_text())["experiments"]
    assert f"./{name}" in {label for experiment in before for label in experiment["read"]}
    assert {words.partition(" of ")[0] for one in before for words in one["untraced"]} <= {
        NO_LOCK,
        f"version, {NO_LOCK}",
    }
    assert "0 computed" in lab.cli("run").stdout
    path = lab.root / name
    path.write_text(path.read_text().replace(old, new))
    assert f"{len(before)} computed, 0 reused" in lab.cli("run").stdout
    after = json.loads((lab.root / "report" / "results.json").read_text())["experiments"]
    assert all(one["key"] != other["key"] for one, other in zip(before, after, strict=True))


def test_its_program_and_what_it_names_outside_are_part_of_its_key_and_its_version_is_told(tmp_path: Path) -> None:
    (tmp_path / "bin").mkdir()
    program, other = tmp_path / "bin" / "tool", tmp_path / "k.txt"
    program.write_text('#!/bin/sh\n[ "$1" = --version ] && echo tool 1.2.3 && exit\nsh "$@"\n')
    program.chmod(0o755)
    other.write_text("1")
    made = 'command("a", ["tool", "fit.sh"], reads=["fit.sh", "d.csv"], version=["tool", "--version"]{}),'
    lab = project(tmp_path, made.format(""), "a", fit_sh=f"cat {other}", d_csv="1")
    path = f"{program.parent}{os.pathsep}{os.environ['PATH']}"

    def ran(*words: str) -> str:
        done = lab.cli(*words, PATH=path)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    told = ran("run")
    assert f"not traced: {NO_LOCK} of tool (roe.a)" in told and "0 computed, 1 reused" in ran("run", "--jobs", "1")
    record = json.loads((lab.root / "report" / "results.json").read_text())
    assert record["experiments"][0]["version"] == "tool 1.2.3"
    assert record["claims"][0]["judgement"]["reason"].endswith(f"Not traced: {NO_LOCK} of tool.")
    page = (lab.root / "report" / "index.html").read_text()
    assert page.count("<bdi>tool 1.2.3</bdi>") == 2 and "<bdi>tool fit.sh</bdi>" in page
    results = read_results(lab.root / "report" / "results.json")
    software = Software(title="T", abstract="A", version="1", license="MIT", authors=())
    crate = filled("crate", results=results, software=software, files={})
    assert {"@id": "#program-1", "@type": "SoftwareApplication", "name": "tool 1.2.3"} in crate["@graph"]
    (lab.root / "d.csv").write_text("2")
    for words in (("list",), ("show", "roe.value"), ("report",), ("export",)):
        assert "changed since the run: d.csv" in lab.cli(*words, PATH=path).stderr
    (lab.root / "d.csv").write_text("1")
    assert "changed since the run" not in ran("list")
    other.write_text("2")
    assert f"(changed: {other})" in ran("run")
    program.write_text(program.read_text() + "# another one\n")
    assert "(changed: program:tool)" in ran("run")
    (lab.root / "lock").write_text("tool-lib 1")
    lab.path("roe/__init__.py").write_text(PAPER.format(uses=("a",), commands=made.format(', environment="lock"')))
    assert "not traced: clock, draws, child programs and computed paths of tool (roe.a)" in ran("run")


@pytest.mark.slow
def test_chains_stop_where_one_fails_and_earlier_results_stay(tmp_path: Path) -> None:
    made = 'command("a", ["sh", "-c", "echo 1 > a.txt"], writes=["a.txt"]),'
    used = 'command("b", ["sh", "-c", "{}"], needs="a"), command("c", ["sh", "-c", "echo 3"], needs="b"),'
    lab = project(tmp_path, made + used.format("cat a.txt"), "a", "b", "c")
    assert "3 computed" in lab.cli("run").stdout
    source = lab.path("roe/__init__.py")
    source.write_text(
        source.read_text().replace("cat a.txt", "sleep 60 & sleep 60").replace('needs="a"', 'needs="a", timeout=0.5')
    )
    done = lab.cli("run")
    assert done.returncode == 3 and "0 computed, 1 reused" in done.stdout
    assert "experiment roe.b: it took longer than 0.5 s" in done.stdout
    assert "experiment roe.c: it needs roe.b, which failed" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("needs", "words"), [(("b", "a"), "in a circle: roe.a, roe.b"), (("x", "a"), "'roe.a' needs experiment 'roe.x'")]
)
def test_a_circle_and_an_unknown_name_are_told_before_anything_runs(
    tmp_path: Path, needs: tuple[str, str], words: str
) -> None:
    both = "".join(
        f'command("{name}", ["sh", "-c", "echo 1"], needs="{other}"),' for name, other in zip("ab", needs, strict=True)
    )
    done = project(tmp_path, both, "a", "b").cli("run")
    assert done.returncode == 2 and words in done.stderr and "Traceback" not in done.stderr

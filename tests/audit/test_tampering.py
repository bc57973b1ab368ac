"""Every field of a results file, changed by hand: refused, found by `check`, or listed as what nobody can derive."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from lab import Lab, make_lab

from replication.audit.inspect.check import TAKEN
from replication.audit.publish.readme import BEGIN, END

TAMPER = """
import copy, itertools, json, sys
from pathlib import Path
import papers
from replication.audit.inspect.check import check
from replication.audit.inspect.check import differences, kept
from replication.audit.model import Kind, Verdict
from replication.audit.store.cache import Cache
from replication.audit.store.records import read_results
from replication.errors import AuditError

root = Path.cwd()
content = json.loads((root / "report/results.json").read_bytes())
again = kept(papers.load(), root, Cache(root / ".cache/replication"))

def found(content):
    Path("tampered.json").write_text(json.dumps(content))
    try:
        results = read_results(Path("tampered.json"))
    except AuditError:
        return "refused"
    problems = map(str, check(results, papers.load(), root))
    return [*problems, *map(str, differences(results, again, root / "figures"))]

def others(value):
    if isinstance(value, bool):
        return [not value, None]
    if isinstance(value, (int, float)):
        return [value * 1.0000001 + 1e-9, -value - 1, None]
    if isinstance(value, str):
        words = [list(words) for words in (Verdict, Kind) if value in list(words)]
        return [*words[0]] if words else [value + "x", "", "9/7"]
    if value is None:
        return [1.5, 3, True, "x", "9/7", {}, {"lower": 0.0, "upper": 1.0, "how": "search"}]
    if isinstance(value, list):
        return [value[:-1], value + value[-1:]] if value else [[1.5], ["x"], [["1", "2"]]]
    fewer = [{key: entry for key, entry in value.items() if key != name} for name in value]
    return [{**value, "x": 1.5}, {**value, "x": "x"}, *fewer]

def places(value, path=()):
    yield path, value
    if isinstance(value, (dict, list)):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from places(value[key], (*path, key))

base, missed, tried = found(content), [], 0
for path, value in places(content):
    for other in others(value) if path else ():
        if json.dumps(other) == json.dumps(value):
            continue
        tampered = copy.deepcopy(content)
        inner = tampered
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = other
        tried += 1
        if found(tampered) == base:
            missed.append((".".join(str(key) for key in path if isinstance(key, str)), repr(value), repr(other)))
print(json.dumps({"base": base, "missed": missed, "tried": tried}))
"""


PLANTS = """
from flint import fmpq, fmpq_mat

def plants(data):
    one = fmpq_mat([[1]])
    return {"scalar": {"A": one, "B": one, "C": one, "K": -2 * one, "L": 2 * one, "T": fmpq(1, 1000), "M": fmpq(5)}}
"""


def theorem(lab: Lab, name: str, claims: list[str], bound: dict[str, str], witness: dict[str, Any]) -> dict[str, Any]:
    """Write a certificate about the scalar loop; the entry that wants it."""
    entry = {
        "name": name,
        "claims": claims,
        "statement": f"dualrate.{name}",
        "plant": "scalar",
        "parameters": {"observer": "fast_sensor"},
    }
    one = [["1"]]
    plant = {"name": "scalar", "A": one, "B": one, "C": one, "K": [["-2"]], "L": [["2"]], "T": "1/1000", "M": "5"}
    certificate = {"format": "replication-certificate/1", "paper": "toy2020", **entry, "plant": plant}
    file = lab.root / "certificates" / "toy2020" / f"{name}.json"
    file.write_text(json.dumps({**certificate, "bound": bound, "witness": witness}), encoding="utf-8")
    return entry


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    """A run with a theorem that is proved, and with something in the parts that are empty otherwise."""
    lab = make_lab(tmp_path_factory.mktemp("tampered"))
    lab.path("toy2020/plants.py").write_text(PLANTS, encoding="utf-8")
    (lab.root / "certificates" / "toy2020").mkdir(parents=True)
    radius = {"lower": "1094030315135/1099511627776", "upper": "273507688187/274877906944"}
    root = ["4481148954840129/4503599627370496", "128346116101713/576460752303423488"]
    wanted = [
        theorem(lab, "radius", [], radius, {"root": root}),
        theorem(lab, "stable", [], {}, {"radius": "1023/1024"}),
    ]
    lab.path("toy2020/theorems.json").write_text(json.dumps(wanted), encoding="utf-8")
    more = """sensitivity=lambda results: (Sensitivity(
        claim="toy2020.square.two", parameter="x", printed="2", base=4.0, low=results["toy2020.square"]["squares"][0],
        high=None),),
    common=lambda results: (CommonLevel(sensor="s", multiple=1, lower=1.0, upper=2.0, measure="m"),),
    findings="""
    lab.edit("toy2020/__init__.py", "findings=", more)
    lab.edit("toy2020/__init__.py", "import Formula", "import CommonLevel, Sensitivity, Formula")
    done = lab.cli("run")
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert "certificates: 2 of 2 proved" in done.stdout
    return lab


@pytest.mark.slow
def test_every_field_is_derived_or_on_the_list(ran: Lab) -> None:
    done = ran.python("-c", TAMPER)
    assert done.returncode == 0, done.stderr[-2000:]
    answer = json.loads(done.stdout)
    assert answer["base"] == [] and answer["tried"] > 1000
    missed = {re.sub(r"^run\.packages\..*", "run.packages", path) for path, _, _ in answer["missed"]}
    assert missed == TAKEN.keys(), [entry for entry in answer["missed"] if entry[0] not in TAKEN]


@pytest.mark.parametrize(
    "words",
    [
        {
            "figures/toy2020-fig1.svg": "toy2020-fig1: not derived: .*fig1.csv and .svg are not as the run left them",
            "certificates/toy2020/stable.json": "stable.json: certificate: the file is not the one",
            "README.md": "README.md: stale",
        },
        {"papers/toy2020/squares.py": "toy2020.square: not derived: sources, inputs or data are others now"},
    ],
)
def test_what_lies_beside_the_file_must_be_of_its_run(ran: Lab, words: dict[str, str]) -> None:
    (ran.root / "README.md").write_text("\n", encoding="utf-8")
    before = {ran.root / file: (ran.root / file).read_bytes() for file in words}
    try:
        for path, content in before.items():
            path.write_bytes(
                content + f"{BEGIN}\nold\n{END}\n".encode() if path.name == "README.md" else content + b"\n"
            )
        done = ran.cli("check")
    finally:
        for path, content in before.items():
            path.write_bytes(content)
    assert done.returncode == 1
    assert all(re.search(text, done.stdout) for text in words.values()), done.stdout


def test_without_the_results_that_it_was_made_of_this_is_said(ran: Lab, tmp_path: Path) -> None:
    entry = ran.root / ".cache" / "replication" / "toy2020.square.json"
    content = entry.read_bytes()
    try:
        entry.unlink()
        done = ran.cli("check")
    finally:
        entry.write_bytes(content)
    assert done.returncode == 0
    assert "note: toy2020: the cache does not hold the results of this run" in done.stdout

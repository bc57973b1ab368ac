"""The wheel alone, with what it needs and nothing more, audits a paper of another field in an empty folder."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from replication.extras import EXTRAS
from tests.anywhere.conftest import Stranger

EPIDEMIC = Path(__file__).parent / "epidemic"
STABLE = {
    "format": "replication-certificate/1",
    "paper": None,
    "name": "stable",
    "claims": [],
    "statement": "dualrate.stable",
    "plant": {
        "name": "scalar",
        "A": [["1"]],
        "B": [["1"]],
        "C": [["1"]],
        "K": [["-2"]],
        "L": [["2"]],
        "T": "1/1000",
        "M": "5",
    },
    "parameters": {"observer": "fast_sensor"},
    "bound": {},
    "witness": {"radius": "1023/1024"},
}
"""A certificate of a plant of one's own."""

pytestmark = pytest.mark.slow


def test_what_an_extra_installs_is_not_there(stranger: Stranger) -> None:
    code = f"import importlib.util as u; print([name for name in {list(EXTRAS)} if u.find_spec(name)])"
    assert stranger.run("python", "-c", code).stdout.strip() == "[]"
    assert "No module named 'papers'" in stranger.run("python", "-c", "import papers").stderr


def test_outside_of_a_project_it_says_how_to_begin_one(stranger: Stranger) -> None:
    done = stranger.run("replication", "run")
    assert done.returncode == 2
    assert "there is no replication.toml" in done.stderr and "`replication new KEY`" in done.stderr


def test_a_paper_of_another_field(stranger: Stranger) -> None:
    begun = stranger.run("replication", "new", "epidemic")
    assert begun.returncode == 0, begun.stderr
    as_it_is = stranger.run("replication", "run")
    assert as_it_is.returncode == 0, as_it_is.stdout + as_it_is.stderr
    for path in EPIDEMIC.iterdir():
        shutil.copy(path, stranger.home / "papers" / "epidemic" / path.name)
    settings = 'title = "Epidemics, replicated"\nsubject = "the growth of epidemics"\nauthors = ["B. Reader"]\n'
    (stranger.home / "replication.toml").write_text(settings, encoding="utf-8")
    done = stranger.run("replication", "run")
    assert done.returncode == 0, done.stdout + done.stderr
    results = json.loads((stranger.home / "report" / "results.json").read_bytes())
    verdicts = {record["claim"]["id"]: record["judgement"]["verdict"] for record in results["claims"]}
    assert verdicts == {
        "epidemic.growth": "reproduced",
        "epidemic.doubling": "reproduced",
        "epidemic.final": "reproduced after erratum",
    }
    assert not set(EXTRAS) & set(results["run"]["packages"]) and "numpy" in results["run"]["packages"]
    page = (stranger.home / "report" / "index.html").read_text(encoding="utf-8")
    for words in ("the growth of epidemics", "Epidemics, replicated", "B. Reader"):
        assert words in page
    for words in ("state estimation", "slow-sensor-replication developers", "irregular"):
        assert words not in page
    assert (stranger.home / "figures" / "epidemic-course.svg").is_file()
    for command in ("check", "coverage", "list"):
        done = stranger.run("replication", command)
        assert done.returncode == 0, done.stdout + done.stderr


def test_a_wrong_number_changes_verdict_and_exit_code(stranger: Stranger) -> None:
    printed = stranger.home / "papers" / "epidemic" / "printed.toml"
    text = printed.read_text(encoding="utf-8")
    printed.write_text(text.replace('"1.85"', '"1.58"'), encoding="utf-8")
    assert stranger.run("replication", "run").returncode == 1
    printed.write_text(text, encoding="utf-8")
    assert stranger.run("replication", "run").returncode == 0


@pytest.mark.parametrize("print_", ["1,85", "1.85(2)", "1.85 ± 0.02", "185 %"])
def test_a_print_as_other_fields_write_it(stranger: Stranger, print_: str) -> None:
    printed = stranger.home / "papers" / "epidemic" / "printed.toml"
    text = printed.read_text(encoding="utf-8")
    printed.write_text(text.replace('"1.85"', f'"{print_}"'), encoding="utf-8")
    done = stranger.run("replication", "run")
    printed.write_text(text, encoding="utf-8")
    if print_ == "185 %":  # which is computed in per cent, and here it is not
        assert done.returncode == 1
        assert "epidemic.doubling: the computed number is 10^-2 times the print; another unit" in done.stdout
    else:
        assert done.returncode == 0, done.stdout + done.stderr


def test_reasons_ask_for_no_certificate_and_a_theorem_is_verified_without_its_extra(stranger: Stranger) -> None:
    names = ["growth", "doubling", "final"]
    entry = {"claims": [f"epidemic.{name}" for name in names], "reason": "Computed in floating point."}
    listed = stranger.home / "papers" / "epidemic" / "theorems.json"
    listed.write_text(json.dumps([entry]), encoding="utf-8")
    assert stranger.run("replication", "run").returncode == 0
    done = stranger.run("replication", "verify")
    listed.unlink()
    assert (done.returncode, done.stdout, done.stderr) == (1, "0 of 0 certificates proved\n", "")
    certificate = stranger.home / "stable.json"
    certificate.write_text(json.dumps(STABLE), encoding="utf-8")
    proved = stranger.run("replication", "verify", "stable.json")
    assert proved.returncode == 0 and proved.stdout.startswith("proved stable.json: own plant: ")
    radius = {"radius": "511/1024"}  # below what it is
    certificate.write_text(json.dumps({**STABLE, "witness": radius}), encoding="utf-8")
    refused = stranger.run("replication", "verify", "stable.json")
    certificate.unlink()
    assert refused.returncode == 1 and refused.stdout.startswith("NOT PROVED stable.json: ")

"""No altered certificate, list of theorems, plant or path makes the verifier accept what is false."""

import copy
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from attacks import (
    ATTACKS,
    Attack,
    Certificate,
    borrowed_words,
    certificates,
    encoded,
    other_reading,
    own,
)
from bombs import BOMBS
from tampered import Altered
from tampered import refused as listed

from replication.verify.run import verify
from replication.verify.subjects import papers

ROOT = Path(__file__).parents[2]
WHOLE = os.environ.get("MUTANTS") == "all"
CASES = 240 if WHOLE else 60
"""Attacks of each kind: a sample, or all with MUTANTS=all (`make mutants`)."""
MOST_CALLS = 3_000_000
"""Of functions, before what asks for much work is refused: what is called is the same on every machine."""
BORROWED = "names places of the paper"
SLOW = {
    "peet2019/theorem-3-identity",
    "mustafa/range-2-upper",
    "mustafa/robust-design-1",
    "peet2019/own-3-near-optimal",
}


@cache
def true() -> dict[str, Certificate]:
    return {name: certificate for name, certificate in certificates(ROOT).items() if name not in SLOW}


def project(tmp_path: Path) -> Path:
    """A root with what the verifier reads of the papers, and no certificate."""
    for paper in papers(ROOT):
        (tmp_path / "papers" / paper).mkdir(parents=True)
        for name in ("printed.toml", "plants.py", "theorems.json"):
            if (ROOT / "papers" / paper / name).is_file():
                shutil.copy(ROOT / "papers" / paper / name, tmp_path / "papers" / paper / name)
        (tmp_path / "certificates" / paper).mkdir(parents=True)
    return tmp_path


def refused(path: Path, root: Path, attack: Attack | None = None) -> str:
    """The reason why a file proves nothing; fails if it proves something, or if that is not told clearly."""
    outcome = verify(path, root)
    assert outcome.theorem is None, outcome.line()
    assert outcome.reason and not outcome.reason.startswith("the check ended in"), outcome.line()
    # The mathematics comes before the words, and must have refused what is false.
    assert (BORROWED in outcome.reason) is (attack is borrowed_words), outcome.line()
    return outcome.reason


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_no_altered_certificate_is_accepted(attack: Attack, tmp_path: Path) -> None:
    root, rng, names = project(tmp_path), np.random.default_rng(20), sorted(true())
    for _ in range(CASES):
        name = names[rng.integers(len(names))]
        content = attack(rng, true()[name], true())
        # A certificate of one's own can be anywhere else; that of a paper lies where the theorem is wanted.
        place = json.loads(content) if attack is other_reading else {"paper": name.partition("/")[0]}
        where = f"{place['paper']}/{place.get('name', name.partition('/')[2])}.json"
        path = root / ("own.json" if b'"paper": null' in content else f"certificates/{where}")
        path.write_bytes(content)
        refused(path, root, attack)


IN_A_GIGABYTE = """
import cProfile, resource, sys
from pathlib import Path
resource.setrlimit(resource.RLIMIT_AS, (10**9, 10**9))
from replication.verify.run import verify
*bombs, largest = sys.argv[1:]
for path in bombs:
    calls = cProfile.Profile()
    reason = calls.runcall(verify, Path(path)).reason
    print(sum(entry.callcount for entry in calls.getstats()), reason or "proved")
print(verify(Path(largest)).reason or "proved")
"""


@pytest.mark.slow
def test_what_asks_for_much_work_is_refused_within_a_gigabyte(tmp_path: Path) -> None:
    paths = [tmp_path / f"{bomb.__name__}.json" for bomb in BOMBS]
    for bomb, path in zip(BOMBS, paths, strict=True):
        path.write_bytes(encoded(own(bomb(true()))))
    largest = own(true()["okajima2023/dissipation"])
    largest["parameters"] = dict.fromkeys(largest["parameters"], 6)
    paths.append(tmp_path / "largest.json")
    paths[-1].write_bytes(encoded(largest))
    child = subprocess.run(
        [sys.executable, "-c", IN_A_GIGABYTE, *map(str, paths)], cwd=ROOT, capture_output=True, text=True, check=True
    )
    *refusals, whole = child.stdout.splitlines()
    for line in refusals:
        calls, reason = line.split(" ", 1)
        assert int(calls) < MOST_CALLS, line
        assert "takes the check beyond" in reason and reason.endswith("give fewer or shorter numbers"), line
    # The mathematics comes before the words, and was done whole.
    assert BORROWED in whole


@contextmanager
def wanted_as(root: Path, certificate: Certificate) -> Iterator[None]:
    """Within it the list of the paper wants the theorem with the parameters of this certificate."""
    listed = root / "papers" / certificate["paper"] / "theorems.json"
    kept, wanted = listed.read_bytes(), json.loads(listed.read_bytes())
    (entry,) = (entry for entry in wanted if entry.get("name") == certificate["name"])
    entry["parameters"] = certificate["parameters"]
    listed.write_text(json.dumps(wanted), encoding="utf-8")
    yield
    listed.write_bytes(kept)


@pytest.mark.parametrize("row", listed("false"), ids=str)
def test_a_false_theorem_is_refused_even_if_it_is_listed(row: Altered, tmp_path: Path) -> None:
    root, name = project(tmp_path), row.name.partition("/")[2]
    path, false = root / "certificates" / f"{row.name}.json", row.applied(copy.deepcopy(true()[row.name]))
    with wanted_as(root, false):
        path.write_text(json.dumps(true()[row.name]), encoding="utf-8")
        assert refused(path, root) == f"parameters is not that of the wanted theorem {name}"
        path.write_text(json.dumps(false), encoding="utf-8")
        assert row.reason in refused(path, root)


@pytest.mark.parametrize("paper", ["mustafa", "okajima2023", "peet2019", "shao"])
def test_a_certificate_is_for_the_printed_plant(paper: str, tmp_path: Path) -> None:
    root = project(tmp_path)
    data = root / "papers" / paper / "printed.toml"
    # In each string that is no key, each decimal has another first digit, each whole number one more.
    numeral = re.compile(r"(?<![\w.])[0-9](?=[0-9]*(\.[0-9]|\b))")
    printed = re.compile(r'"[^"\n]*"(?! *=)')
    other = printed.sub(
        lambda text: numeral.sub(lambda digit: str((int(digit[0]) + 1) % 10), text[0]), data.read_text(encoding="utf-8")
    )
    data.write_text(other, encoding="utf-8")
    (name, certificate) = next(
        item
        for item in true().items()
        # Those of a scalar plant are of numbers that no paper prints.
        if item[0].startswith(paper) and item[1]["plant"]["name"].partition("-")[0] not in ("", "scalar")
    )
    path = root / "certificates" / f"{name}.json"
    path.write_text(json.dumps(certificate), encoding="utf-8")
    assert re.search("^plant is not that of the wanted theorem|has no plant named", refused(path, root))


def test_no_path_makes_a_certificate_that_of_another_theorem(tmp_path: Path) -> None:
    root = project(tmp_path)
    rows = json.dumps(true()["okajima2023/rows"])
    own = json.dumps({**true()["okajima2023/rows"], "paper": None, "claims": []})
    folder = root / "certificates" / "okajima2023"
    (folder / "deeper").mkdir()
    for content, place in (
        (rows, "okajima2023/variables.json"),
        (rows, "shao/rows.json"),
        (rows, "rows.json"),
        (rows, "okajima2023/deeper/rows.json"),
        (own, "okajima2023/rows.json"),
        (own, "okajima2023/../okajima2023/rows.json"),
        (own, "okajima2023/deeper/../rows.json"),
        (own, "shao/../okajima2023/own.json"),
        (own, "own.json"),
    ):
        path = root / "certificates" / place
        path.write_text(content, encoding="utf-8")
        assert refused(path, root).startswith("where it lies there must be the theorem")
        path.unlink()
    for field, value in (
        ("paper", "../okajima2023"),
        ("paper", "okajima2023/"),
        ("name", "../rows"),
        ("name", "rows/"),
    ):
        path = tmp_path / "rows.json"
        path.write_text(json.dumps({**true()["okajima2023/rows"], field: value}), encoding="utf-8")
        assert re.search("there is no paper|name must have", refused(path, root))

"""No altered certificate, list of theorems, plant or path makes the verifier accept what is false."""

import copy
import json
import re
import shutil
import time
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attacks import ATTACKS, Attack, Certificate, certificates

from replication.verify.run import verify
from replication.verify.subjects import papers

ROOT = Path(__file__).parents[2]
CASES = 40
SECONDS = 5
"""Of the processor, in which every attack must be refused."""
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


def refused(path: Path, root: Path) -> str:
    """The reason why a file proves nothing; fails if it proves something, or if that is not told clearly and soon."""
    begin = time.process_time()
    outcome = verify(path, root)
    assert outcome.theorem is None, outcome.line()
    assert outcome.reason and not outcome.reason.startswith("the check ended in"), outcome.line()
    assert time.process_time() - begin < SECONDS, outcome.line()
    return outcome.reason


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_no_altered_certificate_is_accepted(attack: Attack, tmp_path: Path) -> None:
    root, rng, names = project(tmp_path), np.random.default_rng(20), sorted(true())
    for _ in range(CASES):
        name = names[rng.integers(len(names))]
        content = attack(rng, true()[name], true())
        # A certificate of one's own can be anywhere else; that of a paper lies where the theorem is wanted.
        path = root / ("own.json" if b'"paper": null' in content else f"certificates/{name}.json")
        path.write_bytes(content)
        refused(path, root)


FALSE: list[tuple[str, dict[str, Any]]] = [
    ("mustafa/printed-filter-level", {"level": "1/100"}),
    ("mustafa/range-2-lower", {"level": "3"}),
    ("mustafa/range-1-no-filter", {"level": "1/7"}),
    ("mustafa/range-1-no-filter", {"period": "middle"}),
    ("mustafa/same-level-1", {"cells": 1000}),
    ("okajima2023/gains-33", {"periods": [3, 2]}),
    ("okajima2023/gains-33", {"relative": "1/100000000"}),
    ("okajima2023/optimum-1-1", {"sensors": [1, 0]}),
    ("okajima2023/section-4c-poles", {"diagonal": ["1", "1", "1"]}),
    ("peet2019/ex1-near-optimal", {"factor": "1"}),
    ("peet2019/ex1-near-optimal", {"degree": 2}),
    ("peet2019/ex1-pade-upper", {"order": 1}),
    ("peet2019/ex4-not-unstable", {"eigenvalues": ["2"]}),
    ("shao/apo-below-pmi", {"pairs": [[{"observer": "model_interpolation", "frequency": "1"}] * 2] * 6}),
    ("shao/counterexample", {"longest": "1"}),
    ("shao/estimate-bound", {"longest": "2"}),
    ("shao/output-bounds", {"weights": {"CA": "1", "CBK": "7/5"}}),
    ("shao/prediction-bound", {"longest": "1"}),
    ("shao/stable-apo", {"observer": "single_rate"}),
    ("shao/transient", {"observer": "fast_sensor"}),
    ("shao/unstable-src", {"observer": "fast_sensor"}),
]
"""Theorems made false by other parameters."""


@pytest.mark.parametrize(("name", "parameters"), FALSE)
def test_a_false_theorem_is_refused_even_if_it_is_listed(name: str, parameters: dict[str, Any], tmp_path: Path) -> None:
    root, (paper, theorem) = project(tmp_path), name.split("/")
    path, listed = root / "certificates" / f"{name}.json", root / "papers" / paper / "theorems.json"
    certificate, wanted = copy.deepcopy(true()[name]), json.loads(listed.read_bytes())
    path.write_text(json.dumps(certificate), encoding="utf-8")
    (entry,) = (entry for entry in wanted if entry.get("name") == theorem)
    entry["parameters"] |= parameters
    listed.write_text(json.dumps(wanted), encoding="utf-8")
    assert refused(path, root) == f"parameters is not that of the wanted theorem {theorem}"
    certificate["parameters"] |= parameters
    path.write_text(json.dumps(certificate), encoding="utf-8")
    assert "wanted theorem" not in refused(path, root)


def test_a_certificate_is_for_the_list_and_the_data_as_they_are(tmp_path: Path) -> None:
    root, rng = project(tmp_path), np.random.default_rng(21)
    for _ in range(CASES):
        paper, theorem = sorted(true())[rng.integers(len(true()))].split("/")
        path, listed = root / "certificates" / paper / f"{theorem}.json", root / "papers" / paper / "theorems.json"
        path.write_text(json.dumps(true()[f"{paper}/{theorem}"]), encoding="utf-8")
        kept, wanted = listed.read_bytes(), json.loads(listed.read_bytes())
        place = next(i for i, entry in enumerate(wanted) if entry.get("name") == theorem)
        match int(rng.integers(4)):
            case 0:
                wanted[place]["claims"] = [*wanted[place]["claims"], f"{paper}.more"]
            case 1:
                wanted[place]["parameters"]["more"] = "1"
            case 2:
                wanted[place]["statement"] += "-more"
            case _:
                del wanted[place]
        listed.write_text(json.dumps(wanted), encoding="utf-8")
        assert "wanted theorem" in refused(path, root) or "wants no theorem" in refused(path, root)
        listed.write_bytes(kept)


@pytest.mark.parametrize("paper", ["mustafa", "okajima2023", "peet2019", "shao"])
def test_a_certificate_is_for_the_printed_plant(paper: str, tmp_path: Path) -> None:
    root = project(tmp_path)
    data = root / "papers" / paper / "printed.toml"
    # In each string that is no key, each decimal has another first digit, each whole number one more.
    numeral = re.compile(r"(?<![\w.])[0-9](?=[0-9]*(\.[0-9]|\b))")
    printed = re.compile(r'"[^"\n]*"(?! *=)')
    other = printed.sub(
        lambda text: numeral.sub(lambda digit: str((int(digit[0]) + 1) % 10), text[0]),
        data.read_text(encoding="utf-8"),
    )
    data.write_text(other, encoding="utf-8")
    (name, certificate) = next(
        item for item in true().items() if item[0].startswith(paper) and item[1]["plant"]["name"]
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

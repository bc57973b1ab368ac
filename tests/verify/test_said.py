"""What each committed theorem exports is pinned, with its truth, and the readings and classes that it stands for.

`python tests/verify/test_said.py` writes the pins anew; a change of one is a change of what is proved.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from replication.verify.predicate import exported
from replication.verify.run import STATEMENTS
from replication.verify.theorem import Found

ROOT = Path(__file__).parents[2]
PINS = Path(__file__).with_name("said.json")
PAPERS = ("mustafa", "okajima2023", "peet2019", "shao")


def exports(paper: str) -> dict[str, list[Any]]:
    """By theorem: whether it holds, if declared; quantity, plant, setting, class, readings of each term; no proof."""
    return {path.stem: said(json.loads(path.read_bytes())) for path in (ROOT / "certificates" / paper).glob("*.json")}


def said(certificate: dict[str, Any]) -> list[Any]:
    of_all = STATEMENTS[certificate["statement"]]
    nothing, terms = Found(lower=None, upper=None), []
    for says in of_all.says:
        for one in exported(replace(says, found=None), certificate, {}, nothing):
            of = one.of
            terms.append([of.quantity, of.plant, dict(of.setting), of.estimators, list(one.readings)])
    return json.loads(json.dumps([of_all.holds, *terms]))  # type: ignore[no-any-return]


@pytest.mark.parametrize("paper", PAPERS)
def test_the_exports_are_the_pinned_ones(paper: str) -> None:
    assert exports(paper) == json.loads(PINS.read_text(encoding="utf-8"))[paper]


if __name__ == "__main__":
    PINS.write_text(
        json.dumps({paper: exports(paper) for paper in PAPERS}, indent=1, sort_keys=True) + "\n", encoding="utf-8"
    )

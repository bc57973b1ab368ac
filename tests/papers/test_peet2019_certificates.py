"""Certificates of the delay paper: made again, they are those committed; every claim has a theorem or says why not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from papers.peet2019.certificates import make
from papers.peet2019.paper import PAPER
from replication.audit.model import Kind
from replication.verify.subjects import theorems

FOLDER = Path(__file__).parents[2] / "certificates" / "peet2019"


@pytest.mark.parametrize("name", ["ex1-upper", "ex2-d1-lower", "ex2-lower", "ex1-pade-lower", "ex2-unstable"])
def test_what_is_made_is_what_is_committed(name: str) -> None:
    assert make(name) == json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def test_every_value_bound_and_feasibility_has_a_theorem() -> None:
    wanted, unproved = theorems("peet2019")
    supported = {claim for entry in wanted.values() for claim in entry.claims}
    claims = {claim.id for claim in PAPER.claims if claim.kind in (Kind.VALUE, Kind.BOUND, Kind.FEASIBLE)}
    assert supported == claims
    orders = {claim.id for claim in PAPER.claims if claim.kind is Kind.ORDER}
    assert {claim for entry in unproved for claim in entry.claims} == orders

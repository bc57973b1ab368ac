"""Certificates of the delay paper: made again they prove the same theorems as tightly; claims without one say why."""

from __future__ import annotations

import copy
import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from papers.peet2019.certificates import make
from replication.certify.delay import gram, levels
from replication.verify.run import check
from replication.verify.theorem import Refused

FOLDER = Path(__file__).parents[2] / "certificates" / "peet2019"
BRACKETS = {
    "ex1-upper": ("ex1-lower", 1.5e-6),
    "ex2-d1-lower": ("ex2-d1-upper", 1e-5),
    "ex2-lower": ("ex2-d3-upper", 6e-6),
    "ex1-pade-lower": ("ex1-pade-upper", 1.5e-6),
}
"""The committed theorem that bounds the same level from the other side, and the largest relative distance of the two.

What a solver returns depends on the processor in its last digits, so a certificate is not one file but one theorem.
"""
ROOT_WIDTH = Fraction(4, 2**levels.ROOT_BITS)


def committed(name: str) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return loaded


def is_proved(name: str, certificate: dict[str, Any]) -> bool:
    """Whether it proves the wanted theorem `name`, and with it a bracket as narrow as stated."""
    theorem = check(certificate, place=("peet2019", name))
    if name == "ex2-unstable":
        left, right = (Fraction(certificate["witness"][side]) for side in ("left", "right"))
        return theorem.holds is True and 0 < left < right <= left + ROOT_WIDTH
    other, width = BRACKETS[name]
    opposite = check(committed(other), place=("peet2019", other))
    lower, upper = (
        Fraction(
            str(next(bound for bound in (getattr(part, side) for part in (theorem, opposite)) if bound is not None))
        )
        for side in ("lower", "upper")
    )
    return lower < upper < lower * (1 + Fraction(width))


@pytest.mark.parametrize("name", [*BRACKETS, "ex2-unstable"])
def test_what_is_made_and_what_is_committed_prove_the_same_as_tightly(name: str) -> None:
    assert is_proved(name, committed(name))
    assert is_proved(name, json.loads(json.dumps(make(name))))


def test_a_looser_certificate_is_proved_but_too_wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(levels, "STEPS", (5e-6,))
    monkeypatch.setattr(gram, "INTERIOR_STEPS", (2e-5,))
    monkeypatch.setattr(levels, "BELOW", 1e-5)
    monkeypatch.setattr(levels, "ROOT_BITS", 18)
    for name in (*BRACKETS, "ex2-unstable"):
        assert not is_proved(name, make(name)), name


@pytest.mark.parametrize(
    ("name", "side", "factor"), [("ex1-upper", "upper", "0.99999"), ("ex2-lower", "lower", "1.00001")]
)
def test_a_bound_beyond_its_witness_is_refused(name: str, side: str, factor: str) -> None:
    certificate = make(name)
    moved = Fraction(certificate["bound"][side]) * Fraction(factor)
    with pytest.raises(Refused):
        is_proved(name, {**certificate, "bound": {side: str(moved)}})


def test_a_spoiled_witness_is_refused() -> None:
    certificate = copy.deepcopy(make("ex2-d1-lower"))
    row = certificate["witness"]["functional"]["P"][0]
    row[0] = str(Fraction(row[0]) - 1)
    with pytest.raises(Refused):
        is_proved("ex2-d1-lower", certificate)

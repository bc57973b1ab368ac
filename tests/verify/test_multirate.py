"""The verifier says yes to the certificates that were made, and no, with the reason, to every tampered one."""

import copy
import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from replication.verify.run import check
from replication.verify.theorem import Refused

ROOT = Path(__file__).parents[2]
Tamper = Callable[[dict[str, Any]], None]


@pytest.fixture
def certificate() -> dict[str, Any]:
    path = ROOT / "certificates" / "okajima2023" / "gains-33.json"
    loaded: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return loaded


def test_the_certificate_proves_its_bound(certificate: dict[str, Any]) -> None:
    theorem = check(certificate)
    assert str(theorem.upper) == certificate["bound"]["upper"]


def lower_the_bound(certificate: dict[str, Any]) -> None:
    for side, bound in certificate["bound"].items():
        certificate["bound"][side] = str(Fraction(bound) * (1 - Fraction(1, 100_000)))


def change_an_entry(certificate: dict[str, Any]) -> None:
    certificate["witness"]["P"][2][1][1] = "4"


def swap_the_schedule(certificate: dict[str, Any]) -> None:
    certificate["parameters"]["periods"] = [3, 2]


def take_another_plant(certificate: dict[str, Any]) -> None:
    certificate["plant"]["A"][0][0] = "1/2"


@pytest.mark.parametrize(
    ("tamper", "reason"),
    [
        (lower_the_bound, "the matrix of Theorem 1 at phase"),
        (change_an_entry, "the matrix of Theorem 1 at phase"),
        (swap_the_schedule, "parameters is not that of the wanted theorem"),
        (take_another_plant, "plant is not that of the wanted theorem"),
    ],
)
def test_a_tampered_certificate_is_refused(certificate: dict[str, Any], tamper: Tamper, reason: str) -> None:
    tampered = copy.deepcopy(certificate)
    tamper(tampered)
    with pytest.raises(Refused, match=reason):
        check(tampered)

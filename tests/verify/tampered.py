"""Committed certificates of the papers, as one of a plant of one's own, altered, and why they are refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from replication.verify.run import STATEMENTS, check
from replication.verify.theorem import Refused, Theorem

FOLDER = Path(__file__).parents[2] / "certificates" / "mustafa"
DELAY = FOLDER.parent / "peet2019"
Json = dict[str, Any]
Certificate = Json
Tamper = Callable[[Certificate], None]


def delayed(name: str) -> Json:
    """A certificate of the delay paper."""
    found: Json = json.loads((DELAY / f"{name}.json").read_text(encoding="utf-8"))
    return found


def refusal(given: Json, statement: Callable[[Json], object] = check) -> str:
    """Why a certificate is refused."""
    with pytest.raises(Refused) as caught:
        statement(given)
    return str(caught.value)


def load(name: str) -> Certificate:
    """A certificate as one of a plant of one's own, so that not its subject but its mathematics is checked."""
    certificate: Certificate = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return {**certificate, "paper": None, "claims": []}


def scaled(side: str, factor: str) -> Tamper:
    def tamper(certificate: Certificate) -> None:
        certificate["bound"][side] = str(Fraction(certificate["bound"][side]) * Fraction(factor))

    return tamper


def put(value: Any, *path: Any) -> Tamper:
    """Write a value at a path of keys and positions."""

    def tamper(certificate: Certificate) -> None:
        inner: Any = certificate
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = value

    return tamper


def remove(*path: Any) -> Tamper:
    def tamper(certificate: Certificate) -> None:
        inner: Any = certificate
        for key in path[:-1]:
            inner = inner[key]
        del inner[path[-1]]

    return tamper


def check_stated(certificate: dict[str, Any]) -> Theorem:
    """As `check`, but the words of any paper may stand with a plant of one's own."""
    with patch.dict(STATEMENTS, {name: replace(one, source="") for name, one in STATEMENTS.items()}):
        return check(certificate)

"""Committed certificates of the papers, as one of a plant of one's own, altered, and why they are refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from replication.verify.run import STATEMENTS, check
from replication.verify.theorem import Refused, Theorem

CERTIFICATES = Path(__file__).parents[2] / "certificates"
Json = dict[str, Any]
Certificate = Json
Tamper = Callable[[Certificate], None]


@cache
def _text(name: str) -> str:
    return (CERTIFICATES / f"{name}.json").read_text(encoding="utf-8")


def committed(name: str) -> Certificate:
    """A certificate by paper and name; nobody else has the same object."""
    found: Certificate = json.loads(_text(name))
    return found


def own(name: str, *tampers: Tamper) -> Certificate:
    """As one of a plant of one's own, so that not its subject but its mathematics is checked, then altered."""
    certificate = {**committed(name), "paper": None, "claims": []}
    for tamper in tampers:
        tamper(certificate)
    return certificate


def delayed(name: str) -> Certificate:
    """A certificate of the delay paper."""
    return committed(f"peet2019/{name}")


def load(name: str, *tampers: Tamper) -> Certificate:
    """One of the paper on nonuniform sampling, as `own`."""
    return own(f"mustafa/{name}", *tampers)


def refusal(given: Json, statement: Callable[[Json], object] = check) -> str:
    """Why a certificate is refused."""
    with pytest.raises(Refused) as caught:
        statement(given)
    return str(caught.value)


def at(certificate: Certificate, *path: Any) -> tuple[Any, Any]:
    """What holds the value at a path of keys and positions, and the last of these."""
    inner: Any = certificate
    for key in path[:-1]:
        inner = inner[key]
    return inner, path[-1]


def put(value: Any, *path: Any) -> Tamper:
    """Write a value, as a copy, at a path."""

    def tamper(certificate: Certificate) -> None:
        inner, key = at(certificate, *path)
        inner[key] = deepcopy(value)

    return tamper


def scaled(factor: str, *path: Any) -> Tamper:
    """Multiply the number at a path."""

    def tamper(certificate: Certificate) -> None:
        inner, key = at(certificate, *path)
        inner[key] = str(Fraction(inner[key]) * Fraction(factor))

    return tamper


def remove(*path: Any) -> Tamper:
    """Delete what is at a path."""

    def tamper(certificate: Certificate) -> None:
        inner, key = at(certificate, *path)
        del inner[key]

    return tamper


def check_stated(certificate: dict[str, Any]) -> Theorem:
    """As `check`, but the words of any paper may stand with a plant of one's own."""
    with patch.dict(STATEMENTS, {name: replace(one, source="") for name, one in STATEMENTS.items()}):
        return check(certificate)

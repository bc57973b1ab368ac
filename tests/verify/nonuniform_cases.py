"""Certificates of the nonuniform-sampling paper, and ways to tamper with them."""

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[2] / "certificates" / "mustafa"
Certificate = dict[str, Any]
Tamper = Callable[[Certificate], None]


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

"""Committed certificates of the papers, as one of a plant of one's own, altered, and why they are refused."""

import json
import tomllib
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
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


def check_stated(certificate: dict[str, Any]) -> Theorem:
    """As `check`, but the words of any paper may stand with a plant of one's own."""
    with patch.dict(STATEMENTS, {name: replace(one, source="") for name, one in STATEMENTS.items()}):
        return check(certificate)


@dataclass(frozen=True)
class Altered:
    """A row of `refused.toml`: a certificate by name, its changes, and words of the reason why it is refused."""

    name: str
    reason: str
    changes: tuple[Json, ...]

    def __str__(self) -> str:
        return f"{self.name}: {', '.join(change['path'] for change in self.changes)}"

    def applied(self, certificate: Certificate) -> Certificate:
        """A certificate with these changes."""
        for change in self.changes:
            inner, key = at(certificate, *way(change["path"]))
            if "gone" in change:
                del inner[key]
            else:
                inner[key] = changed(inner.get(key) if isinstance(inner, dict) else inner[key], change)
        return certificate

    def check(self, certificate: Certificate | None = None) -> None:
        """That it is refused; the committed certificate by this name, as `own`, unless another one is given."""
        given = self.applied(own(self.name) if certificate is None else certificate)
        assert self.reason in refusal(given, check_stated)


def refused(section: str) -> list[Altered]:
    """The rows of a section of `refused.toml`."""
    listed = tomllib.loads(Path(__file__).with_name("refused.toml").read_text(encoding="utf-8"))[section]
    return [
        Altered(name, row["reason"], tuple(row.get("changes", [row]))) for name, rows in listed.items() for row in rows
    ]


def way(path: str) -> list[str | int]:
    """The keys and positions of a path with points."""
    return [int(step) if step.lstrip("-").isdecimal() else step for step in path.split(".")]


def changed(old: Any, how: Json) -> Any:
    """What comes in the place of a value."""
    match how:
        case {"to": new, "shape": (rows, columns)}:
            return [[new] * columns] * rows
        case {"to": new}:
            return deepcopy(new)
        case {"by": factor}:
            return _numbers(old, lambda number: number * Fraction(factor))
        case {"plus": term}:
            return _numbers(old, lambda number: number + Fraction(term))
        case {"all": same}:
            return _numbers(old, lambda number: Fraction(same))
        case {"cropped": size}:
            return [row[:size] for row in old[:size]]
        case {"reversed": True}:
            return old[::-1]
        case {"again": True}:
            return [*old, old[0]]
    raise ValueError(f"no change: {how}")


def _numbers(value: Any, change: Callable[[Fraction], Fraction]) -> Any:
    if isinstance(value, dict):
        return {key: _numbers(part, change) for key, part in value.items()}
    return [_numbers(part, change) for part in value] if isinstance(value, list) else str(change(Fraction(value)))

"""Nothing that a module of a paper declares is lost: every part, with its claims, stands in the scope of the paper."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator

import pytest

import papers
from replication.audit.declare import Part


def parts(key: str) -> Iterator[Part]:
    """The parts that are names of some module of a paper."""
    package = importlib.import_module(f"papers.{key}")
    for found in pkgutil.walk_packages(package.__path__, f"papers.{key}."):
        yield from (value for value in vars(importlib.import_module(found.name)).values() if isinstance(value, Part))


@pytest.mark.parametrize("key", papers.KEYS)
def test_every_part_is_in_the_scope(key: str) -> None:
    (paper,) = papers.load([key])
    scope = {item.part: item for item in paper.scope}
    for part in parts(key):
        assert {f"{key}.{claim.id}" for claim in part.claims} <= set(scope[part.title].claims), part.title

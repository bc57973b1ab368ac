"""A module that only one other module imports could be a part of that one: each such module says why it is none."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from pathlib import Path

import pytest
from test_doors import ROOT, Graph, import_graph

TABLE = Path(__file__).with_name("one_importer.toml")
MOST_WORDS = 20


def alone(graph: Graph) -> set[str]:
    """The modules that exactly one other module imports."""
    importers = Counter(imported for module, found in graph.items() for imported in found if imported != module)
    return {module for module, count in importers.items() if count == 1}


def reasons() -> dict[str, str]:
    """By name or pattern the reason."""
    entries = tomllib.loads(TABLE.read_text(encoding="utf-8"))["alone"]
    return {name: entry["reason"] for entry in entries for name in entry["modules"]}


def named_by(pattern: str, modules: set[str]) -> set[str]:
    """The modules of a pattern, in which a star stands for one name."""
    fits = re.compile(r"[^.]+".join(map(re.escape, pattern.split("*"))))
    return {module for module in modules if fits.fullmatch(module)}


def told(found: set[str], patterns: list[str]) -> list[str]:
    """What is wrong with a table for these modules: those without a reason, with two, and entries without a module."""
    count = Counter(module for pattern in patterns for module in named_by(pattern, found))
    return [
        *(
            f"{module}: one module imports it; make it a part of that one, or say why not"
            for module in found - count.keys()
        ),
        *(f"{module}: two reasons" for module, times in count.items() if times > 1),
        *(f"{pattern}: no longer a module with one importer" for pattern in patterns if not named_by(pattern, found)),
    ]


def test_every_module_with_one_importer_has_a_reason() -> None:
    found = alone(import_graph(ROOT))
    assert len(found) > 50
    assert told(found, list(reasons())) == []


def test_reasons_are_one_line() -> None:
    assert all(3 < len(reason.split()) <= MOST_WORDS for reason in reasons().values())


@pytest.mark.parametrize(
    ("patterns", "words"),
    [
        (["a.x"], ["a.b.y: one module imports it"]),
        (["a.*"], ["a.b.y: one module imports it"]),
        (["a.x", "a.*", "a.b.y"], ["a.x: two reasons"]),
        (["a.x", "a.b.y", "a.z"], ["a.z: no longer"]),
        (["a.x", "a.b.*"], []),
    ],
)
def test_a_gap_a_double_and_a_leftover_are_told(patterns: list[str], words: list[str]) -> None:
    graph: Graph = {"a.x": {"a.b.y": 1, "a.z": 2}, "a.b.y": {"a.z": 1, "a.x": 3}, "a.z": {"a.z": 1}}
    assert alone(graph) == {"a.x", "a.b.y"}
    found = told(alone(graph), patterns)
    assert len(found) == len(words)
    assert all(text.startswith(start) for text, start in zip(found, words, strict=True))

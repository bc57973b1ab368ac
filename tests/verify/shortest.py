"""The pins of the shortest certificate of each kind: quick enough for a sample of the mutants."""

import json

import pytest
from test_said import PATHS, pins, said


def kind(name: str) -> tuple[object, ...]:
    """What is stated, whether it holds, and of which observer or rule."""
    told = json.loads(PATHS[name].read_bytes())
    return told["statement"], pins()[name]["holds"], *map(told["parameters"].get, ("observer", "rule"))


SHORTEST = {kind(name): name for name in sorted(PATHS, key=lambda name: -PATHS[name].stat().st_size)}


@pytest.mark.parametrize("name", SHORTEST.values())
def test_what_is_proved_is_as_pinned(name: str) -> None:
    assert said(name) == pins()[name]

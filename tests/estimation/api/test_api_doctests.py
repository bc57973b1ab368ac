"""The examples in the docstrings of the public functions run and give what they print."""

import doctest
import importlib

import pytest


@pytest.mark.parametrize(
    ("module", "least"),
    [
        ("multirate.facade", 3),
        ("nonuniform.facade", 3),
        ("nonuniform.stamped.kalman", 1),
        ("nonuniform.stamped.running", 1),
        ("dualrate.facade", 3),
        ("delay.facade", 3),
    ],
)
def test_doctests(module: str, least: int) -> None:
    failures, tried = doctest.testmod(importlib.import_module(f"replication.estimation.{module}"))
    assert (failures, tried >= least) == (0, True)

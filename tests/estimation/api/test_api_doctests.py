"""The examples in the docstrings of the public functions run and give what they print."""

import doctest
import importlib

import pytest


@pytest.mark.parametrize("method", ["multirate", "nonuniform", "dualrate", "delay"])
def test_doctests(method: str) -> None:
    module = importlib.import_module(f"replication.estimation.{method}.facade")
    failures, tried = doctest.testmod(module)
    assert (failures, tried > 2) == (0, True)

"""Squares."""

from typing import Any

from papers.toy2020 import arithmetic


def square(values: list[float]) -> dict[str, Any]:
    solver = {"name": "abacus", "version": "1", "status": "optimal", "residuals": {"gap": 1e-17}}
    return {"squares": [arithmetic.product(value, value) for value in values], "deep": [{"solvers": [solver]}]}

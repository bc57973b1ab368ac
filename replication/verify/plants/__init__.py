"""The plants of the papers in exact numbers, from the literals of `papers/<key>/data.py`: name, then matrices by name.

A paper without an entry here has theorems without a plant only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from replication.verify.plants import mustafa, okajima2023, peet2019

Plants = Mapping[str, Mapping[str, Any]]
"""For each plant of a paper, its matrices (fmpq_mat), numbers (fmpq), and lists of them, by name."""

PLANTS: Mapping[str, Callable[[Mapping[str, Any]], Plants]] = {
    "mustafa": mustafa.plants,
    "okajima2023": okajima2023.plants,
    "peet2019": peet2019.plants,
}

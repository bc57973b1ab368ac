"""One plant of ours for all estimators: a damped oscillator whose position is measured through noise, SI units.

It stands for no device. Every paper's estimator is tried on it with a sensor that is slower, less regular or later, and
each result is compared with that of the ideal sensor, which measures at every base period at once.
"""

from __future__ import annotations

from typing import Any

PLANT: dict[str, Any] = {
    "A": [[0.0, 1.0], [-1.0, -0.6]],
    "B": [[0.0], [1.0]],
    "C": [[1.0, 0.0]],
    "noise": 0.1,
    "h": 0.2,
}
"""Position and speed; force per mass; sensor noise; base period in s."""

MULTIPLES = (1, 2, 3, 4, 6, 8)
"""How many base periods: from one measurement to the next, at the most, or of lateness plus one."""

INPUTS: dict[str, Any] = {"plant": PLANT, "multiples": list(MULTIPLES)}

"""How each loop looks in every figure of this paper, and what it is called there."""

from __future__ import annotations

from typing import Any

from papers.shao.printed import APO, FAST, HELD, PMI, RESTARTED, SINGLE, SLOW_INPUT, STATE
from replication.drawing.style import FOREGROUND, GREY, OURS, REFUTED

_LOOKS: dict[str, tuple[str, Any, float]] = {
    APO: (REFUTED, "-", 1.8),
    PMI: (FOREGROUND, "--", 1.3),
    HELD: (GREY, "-.", 1.3),
    SINGLE: (FOREGROUND, ":", 1.5),
    RESTARTED: (OURS, ":", 1.8),
    FAST: (GREY, "-", 1.1),
    STATE: (GREY, (0, (1, 2)), 1.3),
}
NAMES = {
    APO: "DRC-APO",
    PMI: "DRC-PMI",
    HELD: "PMI, y held",
    SINGLE: "PMI, one correction",
    SLOW_INPUT: "PMI, slow input",
    RESTARTED: "APO, restarted",
    "open_loop_prediction": "APO, open loop",
    FAST: "fast sensor",
    STATE: "state feedback",
}
"""The literal readings of both controllers are called after them, the others after what they change."""


def look(loop: str) -> dict[str, Any]:
    """Keywords of `Axes.plot` for the curve of a loop: its colour, dashes and weight, the same in every figure."""
    colour, dashes, width = _LOOKS[loop]
    return {"color": colour, "linestyle": dashes, "linewidth": width}

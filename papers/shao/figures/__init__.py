"""How each loop looks in every figure of this paper."""

from typing import Any

from papers.shao.printed import APO, FAST, HELD, PMI, RESTARTED, SINGLE, STATE
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


def look(loop: str) -> dict[str, Any]:
    """Keywords of `Axes.plot` for the curve of a loop: its colour, dashes and weight, the same in every figure."""
    colour, dashes, width = _LOOKS[loop]
    return {"color": colour, "linestyle": dashes, "linewidth": width}

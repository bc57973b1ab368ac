"""What a figure of a result shows, as data: curves and levels, without any plot library."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over a common axis x (M,). levels: horizontal lines. steps: values are held until the next x."""

    x: npt.NDArray[Any]
    x_label: str
    y_label: str
    lines: Mapping[str, npt.NDArray[Any]]
    levels: Mapping[str, float]
    steps: bool = False

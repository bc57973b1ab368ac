"""A reader who follows one own plant through `multirate.design` meets few files."""

from __future__ import annotations

import sys
from pathlib import Path
from types import FrameType
from typing import Any

from replication.estimation import multirate

ROOM = str(Path(multirate.__file__).parents[2])
MOST = 14


def files_of(run: Any) -> set[str]:
    """The files of the library in which `run` calls a function."""
    entered: set[str] = set()

    def enter(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(ROOM):
            entered.add(frame.f_code.co_filename)

    before = sys.getprofile()
    sys.setprofile(enter)
    try:
        run()
    finally:
        sys.setprofile(before)
    return entered


def design() -> Any:
    cart = multirate.MultiratePlant(
        A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=[[0, 1], [1, 0]], D=[[0.5, 0], [0, 0.1]]
    )
    return multirate.design(cart, periods=(1, 4))


def test_an_own_plant_enters_few_files() -> None:
    design()  # modules load when they are first used
    assert 5 < len(files_of(design)) <= MOST


def test_another_room_is_seen() -> None:
    result = design()
    assert len(files_of(lambda: (design(), result.observer().to_c(), result.panels()))) > MOST

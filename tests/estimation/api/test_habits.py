"""What an engineer tries first: `dir`, `help`, arguments slightly wrong."""

from __future__ import annotations

import pydoc
from typing import Any

import pytest

from replication import estimation
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation import delay, dualrate, multirate, nonuniform
from tests.estimation.api.api_plants import CART, SPRING, result_of

PACKAGES = (estimation, multirate, nonuniform, dualrate, delay)


@pytest.mark.parametrize("package", PACKAGES)
def test_dir_shows_the_public_names_alone(package: Any) -> None:
    assert [name for name in dir(package) if not name.startswith("__")] == sorted(package.__all__)


@pytest.mark.parametrize("package", PACKAGES[1:])
def test_help_shows_design(package: Any) -> None:
    assert "\n    design(" in pydoc.plain(pydoc.render_doc(package))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"weight": [1, 0]}, r"write a row as \[\[1, 0\]\]"),
        ({"noise": [-1, 0.1]}, "noise must be .* not negative"),
        ({"noise": [1e-9, 0.1]}, "noise of the sensors differs by a factor of 1.0e\\+08"),
    ],
)
def test_the_message_says_what_to_write(given: dict[str, Any], words: str) -> None:
    fitting: dict[str, Any] = {"periods": (1, 4), "noise": [0.5, 0.1], "disturbances": ["wind"]}
    with pytest.raises(InvalidInputError, match=words):
        multirate.design(CART, **{**fitting, **given})


def test_the_row_that_the_message_gives_is_taken() -> None:
    given: dict[str, Any] = {"periods": (1, 4), "noise": [0.5, 0.1], "disturbances": ["wind"]}
    assert multirate.design(CART, weight=[[1, 0]], **given).value > 0


def test_a_level_out_of_reach_names_the_least() -> None:
    least = result_of("multirate").fact("optimum").value
    given: dict[str, Any] = {"periods": (1, 4), "offsets": (0, 2), "noise": [0.5, 0.1], "disturbances": ["wind"]}
    with pytest.raises(InfeasibleError, match=f"the least is {least:.4g}"):
        multirate.design(CART, level=least / 2, **given)


def test_periods_that_look_like_milliseconds_are_asked_about() -> None:
    with pytest.raises(InvalidInputError, match="if milliseconds were meant, divide by 1000"):
        nonuniform.design(SPRING, periods=(10, 100), measured=["gauge"])


def test_what_came_out_is_said_in_words() -> None:
    how = result_of("nonuniform").fact("level of the design").method
    assert "LMI" not in how and "matrix inequality (10)" in how

"""Dual-rate designs at the slow rate from plant files, by the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from replication.cli import main
from replication.estimation import dualrate

PLANT = """
A = [[0.0, 1.0], [22.0, 0.0]]
B = [[0.0], [1.0]]
C = [[1.0, 0.0], [0.0, 1.0]]
sensor_noise = [[1.0, 0.0], [0.0, 4.0]]

[names]
measurements = ["camera", "gyro"]
"""
GAINS = "K = [[-30.0, -9.0]]\nL = [[1.0, 0.0], [0.0, 1.0]]\n"
CALL = ("--period", "0.02", "--ratio", "10,2", "--at", "slow", "--hold", "2")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "ball.toml"
    path.write_text(PLANT, encoding="utf-8")
    return path


def designed(file: Path, *options: str) -> int:
    return main(["design", "dualrate", str(file), *options, "--output", str(file.with_name("out"))])


@pytest.mark.parametrize("goal", ["h2", "hinf"])
def test_the_file_gives_what_the_library_gives(goal: str, file: Path) -> None:
    assert designed(file, *CALL, "--goal", goal) == 0
    written = json.loads((file.with_name("out") / "gains.json").read_text(encoding="utf-8"))
    plant = dualrate.make_plant([[0, 1], [22, 0]], [[0], [1]], np.eye(2))
    own = dualrate.design(
        plant, period=0.02, ratio=[10, 2], hold=[2], at="slow", goal=goal, sensor_noise=np.diag([1.0, 4.0])
    )
    assert written["value"] == pytest.approx(own.value, rel=1e-9)
    assert np.allclose(written["gains"]["K"]["value"], own.gains["K"], rtol=1e-6)
    assert written["signals"]["measurements"] == ["camera", "gyro"]
    assert "level of the Kalman filter" in (file.with_name("out") / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--level", "3"), 'level belongs to goal="hinf"'),
        (("--goal", "hinf", "--level", "1e-3"), "no controller at these rates keeps the level 0.001: the least is"),
        (("--hold", "2,3"), "hold must be one number, or one for each of the 1 inputs"),
        (("--at", "continuous"), 'belong to designs at the slow rate: at="slow"'),
    ],
)
def test_what_does_not_fit_is_named(
    options: tuple[str, ...], told: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert designed(file, *CALL, *options) in (2, 3)
    assert told in capsys.readouterr().err and not file.with_name("out").exists()


def test_gains_of_ones_own_are_not_designed(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file.write_text(GAINS + PLANT, encoding="utf-8")
    assert designed(file, *CALL) == 2
    assert "sensor_noise, at, hold: for a design; the file has gains K and L" in capsys.readouterr().err


def test_a_certificate_of_it_is_refused(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert designed(file, *CALL, "--certificate") == 2
    assert "the verifier has no statement on a SlowRateResult" in capsys.readouterr().err

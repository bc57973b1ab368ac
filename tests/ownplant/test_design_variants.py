"""Designs at the slow rate and with time stamps, from the command line."""

import copy
import json
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from replication import twice
from replication.certify import nonuniform as makers
from replication.certify.own import certificate
from replication.cli import main
from replication.errors import InvalidInputError, SolverError
from replication.estimation import dualrate
from replication.estimation.linear.norms import l2_gain
from replication.estimation.nonuniform import StampedPlant, StampedResult, design_stamped
from replication.estimation.nonuniform.stamped.design import StampedFilter
from replication.verify import run as first
from replication.verify.run import check
from tests.ownplant.test_design_command import BALL, SLOW


@pytest.mark.parametrize("goal", ["h2", "hinf"])
def test_the_file_gives_what_the_library_gives(goal: str, tmp_path: Path) -> None:
    file, out = tmp_path / "ball.toml", tmp_path / "out"
    file.write_text(f'{BALL}[names]\nmeasurements = ["camera", "gyro"]\n', encoding="utf-8")
    assert main(["design", "dualrate", str(file), *SLOW.split(), "--goal", goal, "--output", str(out)]) == 0
    written = json.loads((out / "gains.json").read_text(encoding="utf-8"))
    plant = dualrate.make_plant([[0, 1], [22, 0]], [[0], [1]], np.eye(2))
    own = dualrate.design(
        plant, period=0.02, ratio=[10, 2], hold=[2], at="slow", goal=goal, sensor_noise=np.diag([1.0, 4.0])
    )
    assert written["value"] == pytest.approx(own.value, rel=1e-9)
    assert np.allclose(written["gains"]["K"]["value"], own.gains["K"], rtol=1e-6)
    assert written["signals"]["measurements"] == ["camera", "gyro"]
    assert "level of the Kalman filter" in (out / "index.html").read_text(encoding="utf-8")


ROOT = Path(__file__).parents[2]
LOAD = ROOT / "docs" / "examples" / "load.toml"
OMEGA = 2 * np.pi * 0.8
PLANTS = {
    "oscillator of 0.8 Hz": (
        StampedPlant([[0, 1], [-(OMEGA**2), -0.6]], [[0, 0], [OMEGA**2, 0]], [[1, 0]], [[0, 0.1]], [[1, 0]]),
        (0.01, 0.1),
    ),
    "unstable": (
        StampedPlant([[1.5, 2], [-1, 0.2]], [[1, 0], [1, 0]], [[1, 0]], [[0, 0.1]], [[0, 1], [1, 1]]),
        (0.05, 0.4),
    ),
    "integrators, two sensors": (
        StampedPlant([[0, 1], [0, 0]], [[0, 0, 0], [1, 0, 0]], np.eye(2), [[0, 0.1, 0], [0, 0, 0.2]], [[1, 0]]),
        (0.05, 0.2),
    ),
    "no noise": (StampedPlant([[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], [[0, 1]]), (0.05, 0.2)),
    "other units": (
        StampedPlant([[0, 1e3], [0, -50]], [[0, 0], [1e-3, 0]], [[1, 0]], [[0, 1e-4]], [[1, 0]]),
        (0.001, 0.01),
    ),
    "sensor that tells nothing": (
        StampedPlant([[0, 1], [-4, -0.2]], [[0, 0], [1, 0]], [[1, 0]], [[0, 1e4]], [[1, 0]]),
        (0.1, 1.0),
    ),
}


TWICE = ("unstable", "integrators, two sensors")
"""Those that the slower arithmetic checks too."""


@cache
def result_of(name: str) -> StampedResult:
    plant, periods = PLANTS[name]
    return design_stamped(plant, periods=periods, horizon=20)


def test_both_arithmetics_prove_the_level_and_what_is_nearly_attained(tmp_path: Path) -> None:
    paths = {name: tmp_path / f"{place}.json" for place, name in enumerate(PLANTS)}
    for name, path in paths.items():
        path.write_text(json.dumps(certificate(result_of(name), "mine")), encoding="utf-8")
    said = (twice.by(arithmetic, [paths[name] for name in TWICE], ROOT, 1) for arithmetic in twice.ARITHMETICS)
    for name, one, other in zip(TWICE, *said, strict=True):
        assert not twice.difference(one, other), name
    for name, path in paths.items():
        outcome, result = first.verify(path), result_of(name)
        assert outcome.theorem is not None, name
        lower, upper = (float(Fraction(str(end))) for end in (outcome.theorem.lower, outcome.theorem.upper))
        assert result.value * (1 - 1e-9) <= upper <= result.value * (1 + 1e-5), name
        # The pattern repeats for ever, where the search ends after some samples.
        assert result.bracket.lower * 0.999 <= lower <= result.value, name


def test_the_certificate_has_the_gains_and_the_edges_that_run() -> None:
    result = result_of("oscillator of 0.8 Hz")
    made = certificate(result)
    filter_ = made["witness"]["filter"]
    assert [[[Fraction(x) for x in row] for row in G] for G in filter_["G"]] == result.filter.G.tolist()
    low, high = Fraction(result.periods.h_l), Fraction(result.periods.h_u)
    edges = [low + Fraction(share) * (high - low) for share in filter_["cells"]]
    assert edges == result.gains["edges"].tolist() == [low, *result.filter.edges, high]
    assert made["paper"] is None and made["statement"] == "nonuniform.stamped-gain"


def test_a_filter_with_other_gains_has_no_such_certificate() -> None:
    result = result_of("oscillator of 0.8 Hz")
    for factor, edges in ((1.05, result.filter.edges), (1.0, tuple(np.array(result.filter.edges) * 0.9))):
        proof = replace(result.gain.guarantee, edges=(result.periods.h_l, *edges, result.periods.h_u))
        other = replace(
            result,
            filter=StampedFilter(factor * result.filter.G[:: 1 if factor > 1 else -1], edges),
            gain=replace(result.gain, guarantee=proof),
        )
        with pytest.raises(SolverError, match="storage inequality"):
            certificate(other)
    with pytest.raises(InvalidInputError, match="not finite"):
        certificate(replace(result, filter=StampedFilter(result.filter.G * np.nan, result.filter.edges)))


def test_a_single_period_has_none() -> None:
    plant, _ = PLANTS["unstable"]
    with pytest.raises(InvalidInputError, match=r"nonuniform\.stamped-gain is a statement on a range"):
        certificate(design_stamped(plant, periods=(0.1, 0.1), horizon=20))


def test_a_pattern_that_is_too_long_for_balls_is_cut() -> None:
    result = result_of("no noise")
    theorem = copy.deepcopy(certificate(result))
    made = makers.stamped_gain(theorem, result.filter, result.gain.guarantee, (400, 30))
    counts = [count for _, count in made["witness"]["pattern"]]
    assert sum(counts) < 430 and min(counts) >= 1
    assert check({**theorem, **made}).lower is not None
    T = makers.coordinates(result.gain.guarantee)
    plant, filter_ = result.plant.in_coordinates(T), result.filter.in_coordinates(T)
    whole, cut = (
        makers.error_system(plant, filter_, makers.pattern_of(runs, result.periods)[1]) for runs in ((400, 30), counts)
    )
    assert makers.lost_bits(cut) <= makers.LOST < makers.lost_bits(whole)
    assert float(Fraction(made["bound"]["lower"])) <= l2_gain(cut).value


@pytest.mark.slow
def test_a_file_says_that_samples_have_time_stamps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["design", "nonuniform", str(LOAD), "--periods", "0.01,0.1", "--horizon", "50"]
    assert main([*command, "--certificate"]) == 0
    printed = capsys.readouterr().out
    assert "proved: The filter with time stamps that stands here has a gain of more than 0.2568" in printed
    folder = tmp_path / "load-nonuniform"
    assert {path.name for path in folder.iterdir()} >= {"observer.c", "observer.json", "gains.json", "index.html"}
    file = folder / "load-nonuniform.certificate.json"
    monkeypatch.chdir(ROOT)
    assert main(["verify", "--both", str(file)]) == 0
    assert "1 of them in both arithmetics" in capsys.readouterr().out
    made = json.loads(file.read_text(encoding="utf-8"))
    assert made["plant"]["A"][1] == ["-253/10", "-3/5"] and made["plant"]["h_u"] == ["1/10", "0"]
    # Fewer cells, a gain for each.
    assert main([*command, "--cells", "3", "--force", "--output", str(folder)]) == 0
    assert "G_x (3, 2, 1)" in capsys.readouterr().out

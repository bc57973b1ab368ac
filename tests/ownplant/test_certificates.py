"""Certificates of own designs: the verifier proves them, refuses perturbed ones, and what has no statement says so."""

import dataclasses
import doctest
import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replication import twice
from replication.certify import own
from replication.certify.own import certificate, certified
from replication.cli import main
from replication.errors import InvalidInputError, SolverError
from replication.estimation import delay, dualrate, multirate, nonuniform
from replication.verify.run import check
from replication.verify.theorem import Refused
from tests.estimation.api.api_cases import result_of
from tests.ownplant.test_design_command import CASES

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "examples"
SENTENCES = {
    "multirate": "l2 gain between 0.435",
    "nonuniform": "over all periods from 1/20 to 1/5 s is at most 0.682",
    "dualrate": "is stable: its spectral radius over one slow period is below 0.853",
    "delay": "is feasible at the level 0.579",
}


def test_the_level_of_a_kalman_filter_is_proved_and_correlated_noise_is_refused() -> None:
    given = {"A": [[1, 0.1], [0, 0.98]], "C": [[0, 1], [1, 0]], "B_d": [[0], [0.1]], "R": np.eye(2) / 9}
    plain = multirate.MultiratePlant.from_covariances(**given, Q=[[1]])
    assert certificate(multirate.design(plain, periods=(1, 2), goal="h2"))["statement"] == "multirate.gain"
    common = multirate.MultiratePlant.from_covariances(**given, Q=[[1]], S=[[0.1, 0]])
    with pytest.raises(InvalidInputError, match="sensor noise that also drives the plant"):
        certificate(multirate.design(common, periods=(1, 2), goal="h2"))


@pytest.mark.parametrize("method", CASES)
def test_the_file_of_a_design_is_proved_by_the_verifier(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    file, *options = CASES[method]
    name, command = Path(file).stem, ["design", method, str(EXAMPLES / file), *options, "--certificate"]
    assert main(command) == 0
    printed = capsys.readouterr().out.splitlines()
    (proved,) = (line for line in printed if line.startswith("proved: "))
    assert SENTENCES[method] in proved
    folder = tmp_path / f"{name}-{method}"
    made = folder / f"{name}-{method}.certificate.json"
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert f'href="{made.name}"' in page and "--certificate" in page
    assert twice.main([str(made)]) == 0  # what verify.py calls
    assert f"own plant: {proved.removeprefix('proved: ')}" in capsys.readouterr().out
    # A design with a certificate is replaced as any other; nothing else there is.
    assert main([*command, "--force"]) == 0
    made.rename(folder / "other.certificate.json")
    assert main([*command, "--force"]) == 2
    assert "holds more than a design (other.certificate.json)" in capsys.readouterr().err


@pytest.mark.parametrize("method", CASES)
def test_the_result_of_the_library_is_certified_and_its_floats_are_exact(method: str) -> None:
    made = json.loads(json.dumps(certificate(result_of(method), "mine")))
    assert made["paper"] is None and made["claims"] == [] and made["plant"]["name"] == "mine"
    theorem = check(made)
    if theorem.upper is not None:
        upper, value = float(Fraction(str(theorem.upper))), result_of(method).value
        assert value * (1 - 1e-9) <= upper <= value * (1 + 1e-5)
    numbers = made["plant"]["A0" if method == "delay" else "A"]
    assert all(Fraction(float(Fraction(entry))) == Fraction(entry) for row in numbers for entry in row)


@pytest.mark.parametrize(("time", "state", "output"), [(1e-3, 1e-3, 10.0), (1e3, 1e3, 1.0), (1.0, 1.0, 1e4)])
def test_units_do_not_matter_to_a_certificate_with_delays(time: float, state: float, output: float) -> None:
    """Two tanks in other units: solvers would fail on its matrices as they stand."""
    scale = np.array([[1.0, 1.0 / state], [state, 1.0]])
    A0, A1 = scale * [[-1, 0.2], [0.5, -2]] / time, scale * [[0, 0], [0.5, 0.2]] / time
    plant = delay.delay_system(A0, [A1], [0.4 * time], np.diag([1.0, state]), [[0.0, output / state]], [[1.0, 0.0]])
    result = delay.design(plant)
    upper = check(certificate(result)).upper
    assert upper is not None and float(Fraction(str(upper))) == pytest.approx(result.value, rel=1e-6)


def test_units_do_not_matter_to_a_certificate_of_several_rates() -> None:
    """States in units that are five orders of magnitude apart, and a small weight of the error."""
    rng = np.random.default_rng(1)
    A, units = rng.standard_normal((5, 5)), np.diag([1e-3, 1e2, 1.0, 1e1, 1e-2])
    back = np.linalg.inv(units)
    A *= 0.9 / np.abs(np.linalg.eigvals(A)).max()
    plant = multirate.MultiratePlant(
        A=units @ A @ back,
        B_d=units @ rng.standard_normal((5, 2)),
        C=rng.standard_normal((2, 5)) @ back,
        D=np.eye(2),
        W=1e-4 * np.eye(5)[:1] @ back,
    )
    result = multirate.design(plant, periods=(2, 3))
    theorem = check(certificate(result))
    assert theorem.lower is not None and theorem.upper is not None
    bounds = [float(Fraction(str(bound))) for bound in (theorem.lower, theorem.upper)]
    assert bounds[0] < result.bracket.lower <= result.value < bounds[1] < bounds[0] * (1 + 1e-6)


def test_numbers_are_taken_as_written_or_as_floats() -> None:
    given = (certificate(result_of("multirate"), as_written=written)["plant"]["A"] for written in (True, False))
    written, exact = (Fraction(A[0][1]) for A in given)
    assert written == Fraction(1, 10) != exact == Fraction(0.1)


PERTURBED = {
    "multirate": lambda made: made["plant"]["L"][0][0].__setitem__(0, "9"),
    "nonuniform": lambda made: made["bound"].__setitem__("upper", str(Fraction(made["bound"]["upper"]) * 99 / 100)),
    "dualrate": lambda made: made["witness"].__setitem__("radius", "1/2"),
    # Of the state that is not measured: the other one may change, as the free operator of Theorem 3 makes up for it.
    "delay": lambda made: made["plant"]["A0"][1].__setitem__(1, "-19/10"),
}


@pytest.mark.parametrize("method", CASES)
def test_a_perturbed_certificate_is_refused(method: str) -> None:
    made = json.loads(json.dumps(certificate(result_of(method))))
    PERTURBED[method](made)
    with pytest.raises(Refused):
        check(made)


def test_a_number_that_is_not_finite_is_refused() -> None:
    result = result_of("multirate")
    with pytest.raises(InvalidInputError, match="L of the result holds a number that is not finite"):
        certificate(dataclasses.replace(result, gains={"L": np.nan * result.gains["L"]}))


def test_a_result_without_a_statement_says_which_one_does_not_fit() -> None:
    tank = nonuniform.SampledPlant([[-1, 0], [1, -0.5]], [[1, 0], [0, 0]], [[0, 1]], [[0, 0.1]], [[1, 0]])
    constant = nonuniform.design(tank, periods=(0.2, 0.2), goal="nominal", leaves=1, horizon=20)
    with pytest.raises(InvalidInputError, match=r"nonuniform\.gain-upper is a statement on a range"):
        certificate(constant)
    loop: Any = result_of("dualrate")
    with pytest.raises(InvalidInputError, match="one of the observers single_rate"):
        certificate(dataclasses.replace(loop, observer_name="lifted"))
    with pytest.raises(InvalidInputError, match="a gain in the differential equation"):
        certificate(dataclasses.replace(loop, discrete_gain=True))
    two = dualrate.make_plant([[-1.0, 0.0], [0.0, -2.0]], np.eye(2), np.eye(2))
    with pytest.raises(InvalidInputError, match="one input and one output"):
        certificate(dualrate.design(two, period=0.01, ratio=2))
    with pytest.raises(InvalidInputError, match="result of `design`"):
        certificate(delay.analyse(result_of("delay").plant))  # type: ignore[arg-type, attr-defined]


@pytest.mark.parametrize("observer", [name for name in dualrate.OBSERVERS if name != "state_feedback"])
def test_observers_that_are_taken_are_those_that_the_verifier_carries_out(observer: str) -> None:
    servo = dualrate.make_plant([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])
    if observer in {*own.Observer}:
        assert check(certificate(dualrate.design(servo, period=0.01, ratio=2, observer=observer))).holds
    else:
        made = certificate(result_of("dualrate"))
        with pytest.raises(Refused, match="observer must be one of"):
            check({**made, "parameters": {"observer": observer}})


def test_what_the_verifier_refuses_is_not_handed_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own, "WIDTH", "1/1000000000000")
    with pytest.raises(SolverError, match=r"verifier refuses.*relative width"):
        certified(result_of("multirate"))
    with pytest.raises(SolverError, match="name must have"):
        certified(result_of("dualrate"), "no name")


def test_the_example_in_the_docstring_runs() -> None:
    failures, tried = doctest.testmod(own)
    assert (failures, tried > 2) == (0, True)

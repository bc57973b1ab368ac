"""The alternating predictive observer: plants, the search, the counter-example, the limit of rates, true plants."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from computed import result
from faults import verdict

from papers.shao import PAPER, printed
from papers.shao.experiments.theorem import longer_ratios, slow_rate_gap, theorem_constants
from papers.shao.experiments.tracking import SEARCH, merged, over_plants
from papers.shao.plants import PARAMETERS, plants
from papers.shao.printed import APO, DESIGN, FAST, RESTARTED, literal_loop
from papers.shao.printed import COUNTEREXAMPLE as SCALAR
from replication.audit.model import Verdict
from replication.errors import InfeasibleError
from replication.estimation.dualrate.loop import stability_radius, tracking_error_ratio
from replication.estimation.dualrate.problem import dual_rate_design, make_plant
from replication.verify import subjects

BLOCKS = tuple(f"shao.{name}" for name in SEARCH)
CLAIMS = {claim.id: claim for claim in PAPER.claims}
FINDINGS_USE = ("shao.longer", "shao.eigenvalues", "shao.theorem", "shao.table", "shao.transients", "shao.orderings")


def number(exact: object) -> float:
    return int(exact.numer()) / int(exact.denom())


def floats(exact: object) -> list[list[float]]:
    return [[number(entry) for entry in row] for row in exact.tolist()]


def test_the_verifier_is_given_the_plants_that_are_computed_with() -> None:
    exact = plants(subjects.printed(Path(printed.__file__).with_suffix(".toml")))
    motor, started = exact["parameters"], exact["motor-from-start"]
    assert {name: number(motor[symbol]) for symbol, name in PARAMETERS.items()} == asdict(printed.MOTOR)
    for name, design in {"motor": printed.DESIGN, "scalar": printed.COUNTEREXAMPLE}.items():
        loop, model = exact[name], design.model
        matrices = {"A": model.A, "B": model.B_u, "C": model.C, "K": design.feedback, "L": design.injection}
        for symbol, matrix in matrices.items():
            np.testing.assert_allclose(floats(loop[symbol]), matrix, rtol=1e-14)
        assert (number(loop["T"]), loop["M"]) == (design.period, design.ratio)
    assert floats(started.pop("start")) == printed.START[:, None].tolist()
    assert started == exact["motor"]
    assert all(motor[symbol] == exact["motor"][symbol] for symbol in "ABC")


def test_bounds_of_the_proof_are_approached() -> None:
    bounds = result("shao.bounds")
    assert 0.2 < bounds["worst"]["12"] <= 1


@pytest.mark.slow
def test_no_reading_hits_table_one() -> None:
    results = {name: result(name) for name in BLOCKS}
    found = merged(list(results.values()))
    assert sum(found.tried.values()) >= 1e6
    assert found.joint_hits == 0
    short = {name.removeprefix("shao."): found for name, found in results.items()}
    assert verdict(PAPER, CLAIMS["shao.table.any-reading"], short) is Verdict.DIFFERS
    assert 0 < sum(found.distinct.values()) < sum(found.tried.values()) / 10
    words = " ".join(PAPER.findings({**short, **{PAPER.short(name): result(name) for name in FINDINGS_USE}}))
    assert "Not searched: windows that start between slow instants" in words
    assert f"{100 * found.joint['apo'].values[0]:.2f}" in CLAIMS["shao.table.any-reading"].answer(short).note


def by_hand(ratio: int) -> float:
    """The radius of the restarted predictor's loop over (x, ζ) from powers of its step over (x, ζ, ȳ), h = e^T − 1."""
    h = np.expm1(SCALAR.period)
    step = np.array([[1 + h, -2 * h, 0], [0, (1 - 2 * h) / (1 + h), 2 * h / (1 + h)], [0, -h, 1]])
    period = (np.linalg.matrix_power(step, ratio) @ [[1, 0], [0, 1], [1, 0]])[:2]
    return float(np.abs(np.linalg.eigvals(period)).max())


def test_the_restarted_predictor_diverges_where_the_sensor_is_slow_enough() -> None:
    """(18) is the same for every M; another formula finds the same ratio, and a simulation by hand the same growth."""
    longer = result("shao.longer")
    ratio = longer["ratio"]
    assert by_hand(ratio - 1) < 1.0 < by_hand(ratio)
    assert longer["radius"] == pytest.approx([by_hand(ratio - 1), by_hand(ratio)], abs=1e-9)
    assert all(
        value > 1.0 and value == pytest.approx(by_hand(int(M)), rel=1e-6) for M, value in longer["beyond"].items()
    )
    assert theorem_constants(replace(SCALAR, ratio=ratio)).condition == theorem_constants(SCALAR).condition < 1.0
    drawn = result("shao.divergence")
    x, zeta, last, step = 1.0, 0.0, (0.0, 0.0), SCALAR.period
    for k in range(4000):  # (1) and (7) by hand, y_p by (6)
        measured = x if k % SCALAR.ratio == 0 else np.exp(step) * last[0] + np.expm1(step) * last[1]
        u, last = -2.0 * zeta, (zeta, -2.0 * zeta)
        x = np.exp(step) * x + np.expm1(step) * u
        zeta = np.exp(-step) * zeta - np.expm1(-step) * (u + 2.0 * measured)
    assert drawn["own"][APO][drawn["time"].index(4.0)] == pytest.approx(x, rel=1e-9)
    with pytest.raises(InfeasibleError, match="stable at M = 1100"):
        longer_ratios(1100, 2000, [])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_slow_rates_tend_to_a_fraction_of_the_observer_gain(seed: int) -> None:
    """With (6) the gain acts once in M periods; with the running prediction it acts in full."""
    rng = np.random.default_rng(seed)
    design = dual_rate_design(
        make_plant(rng.normal(size=(3, 3)), rng.normal(size=(3, 1)), rng.normal(size=(1, 3))),
        feedback=0.3 * rng.normal(size=(1, 3)),
        injection=0.3 * rng.normal(size=(3, 1)),
        period=0.2,
        ratio=4,
    )
    for name, share in ((APO, 1 / 4), (RESTARTED, 1.0), (FAST, 1.0)):
        near, nearer = (slow_rate_gap(design, name, period=period, share=share) for period in (1e-3, 5e-4))
        assert nearer == pytest.approx(near / 2, rel=0.1)
    assert slow_rate_gap(design, APO, period=1e-4, share=1.0) > 0.01


def test_true_plants_that_differ_are_swept_with_the_command_of_the_model() -> None:
    """The nominal plant gives the nominal numbers; a reversed input has no steady state."""
    nominal = literal_loop(APO, 1.0)
    A, B, C = DESIGN.model.A, DESIGN.model.B_u, DESIGN.model.C
    plants = [DESIGN.model, make_plant(A, 1.2 * B, C), make_plant(A, -B, C)]
    same, other, reversed_input = over_plants(nominal, APO, plants)
    assert same == pytest.approx([stability_radius(nominal), 100 * tracking_error_ratio(nominal)], rel=1e-9)
    assert other[0] != pytest.approx(same[0], rel=1e-3)
    assert reversed_input[0] > 1
    assert reversed_input[1] is None

"""The audit of the alternating predictive observer: plants, verdicts, and what changed data would do."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from computed import result
from faults import verdict

from papers.shao import PAPER, printed
from papers.shao.experiments.tracking import SEARCH, merged, table_columns
from papers.shao.method.search import BlockResult, search_block
from papers.shao.plants import PARAMETERS, plants
from replication.audit.model import Verdict
from replication.estimation.dualrate.loop import close_loop, stability_radius
from replication.estimation.dualrate.observers import OBSERVERS
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


def test_a_table_that_agrees_is_reproduced() -> None:
    table = dict(result("shao.table"))
    column = {printed.APO: [float(v) for v in printed.table_1("DRC-APO")]}
    readings = {choice: {**found, **column} for choice, found in table["readings"].items()}
    agreeing = {**table, "ratios": {**table["ratios"], **column}, "readings": readings}
    found = {"table": agreeing, "windows": result("shao.windows")}
    assert verdict(PAPER, CLAIMS["shao.table.apo-3"], found) is Verdict.REPRODUCED


def test_stored_blocks_merge_to_what_was_searched() -> None:
    small = replace(printed.READINGS, horizon=6, substeps=8)
    found = [search_block(small, table_columns(), index) for index in (0, 3)]
    stored = [json.loads(json.dumps(asdict(one))) for one in found]
    again = merged(stored)
    assert isinstance(again, BlockResult)
    assert again == merged([asdict(one) for one in reversed(found)])


def test_steady_state_is_near_that_of_a_fast_sensor_and_the_transient_is_not() -> None:
    table, constants = result("shao.table"), result("shao.transients")["time_constants"]
    own, fast = (np.array(table["ratios"][name]) for name in (printed.APO, printed.FAST))
    assert np.abs(own / fast - 1)[1:].max() < 0.03
    assert constants[printed.APO] > 5 * constants[printed.FAST]
    assert all(constants[printed.APO] > constants[name] for name in (printed.PMI, printed.HELD, printed.SINGLE))


def test_every_cell_of_the_table_was_simulated_at_its_own_frequency() -> None:
    agreement = result("shao.table")["agreement"]
    for name in (printed.PMI, printed.APO):
        assert len(agreement[name]) == len(printed.FREQUENCIES)
        assert max(agreement[name]) < 1e-10


def test_bounds_of_the_proof_are_approached() -> None:
    bounds = result("shao.bounds")
    assert 0.2 < bounds["worst"]["12"] <= 1


def test_weak_gain_finding_is_not_an_artefact_of_the_table_experiment() -> None:
    """Held measurements with L/M: the loop itself, built again, is stable and slow as the virtual one."""
    weak = replace(printed.DESIGN, injection=printed.DESIGN.injection / printed.DESIGN.ratio)
    virtual = stability_radius(close_loop(printed.DESIGN, OBSERVERS[printed.APO]))
    for name in (printed.PMI, printed.HELD):
        assert stability_radius(close_loop(weak, OBSERVERS[name])) == pytest.approx(virtual, rel=0.02)


@pytest.mark.slow
def test_no_reading_hits_table_one() -> None:
    results = {name: result(name) for name in BLOCKS}
    found = merged(list(results.values()))
    assert sum(found.tried.values()) >= 1e6
    assert found.joint_hits == 0
    short = {name.removeprefix("shao."): found for name, found in results.items()}
    assert verdict(PAPER, CLAIMS["shao.table.any-reading"], short) is Verdict.DIFFERS
    assert 0 < sum(found.distinct.values()) < sum(found.tried.values()) / 10
    words = " ".join(PAPER.findings({**results, **{name: result(name) for name in FINDINGS_USE}}))
    assert "Not searched: windows that start between slow instants" in words
    assert f"{100 * found.joint['apo'].values[0]:.2f}" in CLAIMS["shao.table.any-reading"].answer(results).note

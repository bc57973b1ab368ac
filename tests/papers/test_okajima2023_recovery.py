"""Recovery of the data behind Sec. IV-C: planted problems, brute force on small grids, and the printed numbers."""

import itertools

import numpy as np
import pytest

from papers.okajima2023 import certificates
from papers.okajima2023.experiments.declared import EXPERIMENTS
from papers.okajima2023.experiments.unstable import any_entries
from papers.okajima2023.method.lmi import central_path
from papers.okajima2023.method.recovery import (
    error_poles,
    exact_diagonals,
    recover_inputs,
    recover_outputs,
    recover_poles,
    with_diagonal,
)
from papers.okajima2023.printed import DATA
from papers.okajima2023.printed import GAINS as PRINTED_GAINS
from replication.audit.judge.printed import number
from replication.errors import AuditError, InfeasibleError
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate.optimum import kalman_design, optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array
from replication.verify.subjects import subject

A_RECOVERED = [[1.2, 0.5, 0.2], [-0.1, 1.0, -0.2], [0.0, 0.1, 1.0]]
C_RECOVERED = [[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]]
STATED_POLES = [1.031, [1.085, 0.240]]
STATED_ERROR_POLES = [0.1270, -0.0000, -0.0002]
GAINS = PRINTED_GAINS["42"]
A_41 = number(DATA["unstable-A"])

A_PLANTED = np.array([[0.7, 0.4, 0.1], [-0.3, 1.3, 0.2], [0.1, -0.2, 1.1]])


def planted(B_d: list[float], C: list[list[float]], noise: list[float], periods: tuple[int, ...]) -> MultirateProblem:
    n = len(B_d)
    plant = MultiratePlant(A=A_PLANTED[:n, :n], B_d=np.array(B_d)[:, None], C=C, D=np.diag(noise))
    return MultirateProblem(plant, SensingSchedule(periods))


def rounded(values: Array, decimals: int) -> list[list[list[float]]]:
    return np.round(values, decimals).tolist()


@pytest.mark.parametrize("diagonal", [(0.8, 1.3, 1.1), (0.5, 0.6, 1.5), (1.2, 1.0, 1.0)])
def test_exact_diagonals_hold_the_planted_one_and_all_have_its_poles(diagonal: tuple[float, ...]) -> None:
    def poles(values: list[float] | tuple[float, ...]) -> Array:
        return np.sort_complex(np.linalg.eigvals(with_diagonal(A_PLANTED.tolist(), values)))

    stated = [[pole.real, pole.imag] for pole in poles(diagonal).astype(complex)]
    found = exact_diagonals(A_PLANTED.tolist(), stated)
    assert any(row == pytest.approx(diagonal, abs=1e-7) for row in found)
    for row in found:
        assert np.abs(poles(row) - poles(diagonal)).max() < 1e-7


def test_some_a_with_the_stated_poles_is_stabilised_and_its_error_system_has_the_stated_poles() -> None:
    """By products written out here."""
    (given,) = (one.inputs for one in EXPERIMENTS if one.name == "unstable.any-entries")
    found = any_entries(**given)
    stated = given["stated"]
    A, C = np.array(found["rounded"]), np.array(stated["C"])
    monodromy = np.linalg.multi_dot([A - np.array(gain) @ C for gain in stated["gains"][::-1]])
    assert np.abs(np.linalg.eigvals(monodromy)).max() == pytest.approx(found["radius"], rel=1e-6)
    assert found["radius"] < 1
    assert np.abs(np.array(found["poles"]) - np.array(stated["poles"])).max() < 0.5e-3
    reached = sorted(real for real, _ in found["error_poles"])
    assert reached == pytest.approx(sorted(stated["error_poles"]), abs=1e-6)


@pytest.mark.parametrize("diagonal", [(0.8, 1.3, 1.1), (0.5, 0.6, 1.5)])
def test_planted_diagonals_are_found_and_no_other_fit_is_missed(diagonal: tuple[float, ...]) -> None:
    def printed(values: tuple[float, ...]) -> list[tuple[float, float]]:
        poles = np.linalg.eigvals(with_diagonal(A_PLANTED.tolist(), values))
        return sorted((round(p.real, 3), round(p.imag, 3)) for p in poles)

    stated = [list(pole) for pole in printed(diagonal)]
    found = recover_poles(A_PLANTED.tolist(), stated, 0.1)
    grid = [tuple(np.round(d, 1)) for d in itertools.product(np.arange(0.5, 1.55, 0.1), repeat=3)]
    expected = {d for d in grid if printed(d) == printed(diagonal)}
    assert found["tried"] == len(grid)
    assert {tuple(fit) for fit in found["fits"]} == expected
    assert diagonal in expected


def test_the_diagonal_of_section_4c_whichever_way_the_poles_are_stated() -> None:
    found = recover_poles(A_41, STATED_POLES, 0.05)
    assert found["fits"] == [np.diag(A_RECOVERED).tolist()]
    assert np.round(found["poles_recovered"], 3).tolist() == [[1.031, 0.0], [1.085, 0.240]]
    assert recover_poles(A_41, [[1.031, 0.0], [1.085, 0.240], [1.085, -0.240]], 0.05) == found
    with pytest.raises(InfeasibleError, match="smaller step"):
        recover_poles(A_41, [1.033, [1.083, 0.240]], 0.1)


def brute_force_misfits(A: Array, gains: Array, stated: Array, bound: int) -> list[float]:
    """Misfits of all integer C, by central differences of numpy's characteristic polynomial of a plain product."""

    def coefficients(L: Array, C: Array) -> Array:
        total = np.eye(len(A))
        for L_k in L:
            total = (A - L_k @ C) @ total
        return np.poly(total)[1:].real

    half = [0.5e-4 if pole.imag == 0 else 0.5e-4 * 2**0.5 for pole in stated]
    largest = [abs(pole) + moved for pole, moved in zip(stated, half, strict=True)]
    pole_reach = np.zeros(len(stated))
    for i, moved in enumerate(half):
        pole_reach += moved * np.poly([-size for j, size in enumerate(largest) if j != i])
    entries = [e for e in np.ndindex(gains.shape) if np.any(gains[e[0], :, e[2]])]
    misfits = []
    for numbers in itertools.product(range(-bound, bound + 1), repeat=gains.shape[2] * len(A)):
        C = np.array(numbers, dtype=float).reshape(gains.shape[2], len(A))
        reach = pole_reach.copy()
        for entry in entries:
            shift = np.zeros(gains.shape)
            shift[entry] = 1e-4
            reach += np.abs(coefficients(gains + shift, C) - coefficients(gains - shift, C)) / 2e-4 * 0.5e-3
        misfits.append(float(np.max(np.abs(coefficients(gains, C) - np.poly(stated).real[1:]) / reach)))
    return misfits


def test_planted_outputs_are_found_as_by_brute_force() -> None:
    C = [[1.0, 0.0, -1.0], [0.0, 1.0, 1.0]]
    problem = planted([1.0, 0.5, 0.5], C, [1.0, 1.0], (2, 3))
    exact = kalman_design(problem).gains
    gains = np.round(exact, 3)
    stated = np.round(np.linalg.eigvals(problem.error_system(exact).monodromy()).astype(complex), 4)
    pairs = [[pole.real, pole.imag] for pole in stated]
    for order in (1, -1):  # as planted, and with the gains the other way round
        found = recover_outputs(A_PLANTED.tolist(), gains[::order].tolist(), pairs, 1)
        misfits = sorted(brute_force_misfits(A_PLANTED, gains[::order], stated, 1))
        assert found["tried"] == len(misfits)
        assert found["fits"] == sum(misfit <= 1 for misfit in misfits)
        assert [found["best_misfit"], found["second_misfit"]] == pytest.approx(misfits[:2], rel=1e-6)
        assert order == -1 or found["C"] == C
    recovered = np.sort_complex([complex(*pole) for pole in error_poles(A_PLANTED, gains, C)])
    # What rounding the gains to three decimals moves: the poles are simple here, so about as much.
    np.testing.assert_allclose(recovered, np.sort_complex(stated), atol=5e-3)


def test_outputs_of_section_4c() -> None:
    found = recover_outputs(A_RECOVERED, GAINS, STATED_ERROR_POLES, 3)
    assert found["tried"] == 7**6
    assert (found["C"], found["fits"]) == (C_RECOVERED, 1)
    assert found["best_misfit"] < 0.5 < 1 < found["second_misfit"]
    # Nothing fits with the gains the other way round, nor with A as printed.
    for other in (
        recover_outputs(A_RECOVERED, GAINS[::-1], STATED_ERROR_POLES, 3),
        recover_outputs(A_41, GAINS, STATED_ERROR_POLES, 2),
    ):
        assert other["fits"] == 0 and other["best_misfit"] > 1


@pytest.mark.parametrize(
    ("B_d", "C", "noise", "periods", "bound"),
    [
        ([0.5, 1.0], [[1.0, 0.5]], [1.0], (2,), 1.5),
        ([1.0, -0.5, 0.5], [[1.0, 0.0, -1.0], [0.0, 1.0, 1.0]], [1.0, 2.0], (2, 3), 1.0),
        ([0.5, 1.0, 0.0], [[1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]], [1.0, 0.5], (2, 3), 1.0),
    ],
)
def test_planted_inputs_are_found(
    B_d: list[float], C: list[list[float]], noise: list[float], periods: tuple[int, ...], bound: float
) -> None:
    problem = planted(B_d, C, noise, periods)
    best = optimum(problem).value
    *_, point = central_path(problem, kalman_design(problem).gains, gap=1e-3 * best**2)
    found = recover_inputs(problem.plant.A.tolist(), C, rounded(point.gains, 3), problem.schedule, bound)
    assert found["B_d"] == [[b] for b in B_d]
    assert found["D"] == np.diag(noise).tolist()
    assert 0 <= found["best_excess"] < found["second_excess"]
    # Rounding moves the gains by half a unit; the path is followed in steps, so allow one unit in all.
    assert found["largest_gain_difference"] < 1e-3


def test_no_candidate_with_a_smaller_excess_is_dropped() -> None:
    """All candidates of a small grid by the exact optimum, without any screening."""
    problem = planted([0.5, 1.0], [[1.0, 0.5]], [1.0], (3,))
    gains = np.round(kalman_design(problem).gains, 2)
    found = recover_inputs(problem.plant.A.tolist(), [[1.0, 0.5]], gains.tolist(), problem.schedule, 1.0)
    values = [-1.0, -0.5, 0.0, 0.5, 1.0]
    excesses = []
    for B_d in itertools.product(values, repeat=2):
        if B_d > (0.0, 0.0):
            candidate = planted(list(B_d), [[1.0, 0.5]], [1.0], (3,))
            excesses.append(l2_gain(candidate.error_system(gains)).value / optimum(candidate).value - 1)
    assert found["tried"] == len(excesses)
    assert [found["best_excess"], found["second_excess"]] == pytest.approx(sorted(excesses)[:2], rel=1e-6)
    # Those of the Kalman filter are near no centre.
    assert found["largest_gain_difference"] > 5e-3


def test_inputs_of_section_4c() -> None:
    found = recover_inputs(A_RECOVERED, C_RECOVERED, GAINS, SensingSchedule((2, 3)))
    assert found["B_d"] == [[1.0], [1.5], [2.0]]
    assert found["D"] == [[1.0, 0.0], [0.0, 1.0]]
    assert found["best_excess"] < 1e-3 < 5e-3 < found["second_excess"]
    # The gains of a solver stop near the central path, not on it: within two half-units of the print, not within one.
    assert found["largest_gain_difference"] < 1e-3


@pytest.mark.parametrize("name", ["section-4c-poles", "section-4c-error-poles", "section-4c-second-setting"])
def test_the_search_finds_the_plant_that_the_theorems_are_about(name: str) -> None:
    theorem = subject("okajima2023", name)
    assert certificates.recovered(theorem) == {}


def test_a_plant_that_the_search_does_not_find_gets_no_certificate() -> None:
    theorem = subject("okajima2023", "section-4c-poles")
    theorem["parameters"] = {**theorem["parameters"], "diagonal": ["1", "1", "6/5"]}
    with pytest.raises(AuditError, match=r"diagonal of section-4c-poles is .*, the search finds"):
        certificates.recovered(theorem)

"""Section IV-C: what its printed data give as they stand, and what plant they can have belonged to."""

from __future__ import annotations

from typing import Any

import numpy as np

from papers.okajima2023.experiments.designs import design, norm_of_gains
from papers.okajima2023.experiments.problem import Json, Matrix, build
from papers.okajima2023.method.input_recovery import recover_inputs
from papers.okajima2023.method.recovery import by_modulus, recover_outputs, recover_poles, upper_half

PERIODS, OFFSETS = [2, 3], [0, 0]
"""The schedule of Sec. IV-A, which Sec. IV-C keeps."""


def as_printed(plant: dict[str, Matrix], gains: list[Matrix]) -> Json:
    """Poles of the printed A, and of A_e for the printed A, C and gains (42)."""
    poles = np.linalg.eigvals(np.array(plant["A"]))
    monodromy = build(plant, PERIODS, OFFSETS, [0, 1]).error_system(np.array(gains)).monodromy()
    return {"poles": upper_half(poles), "error_poles": by_modulus(np.linalg.eigvals(monodromy))}


def recovered(
    printed_A: Matrix,
    printed_gains: list[Matrix],
    stated_poles: list[list[float]],
    stated_error_poles: list[float],
    half_unit: float,
    step: float,
    bound: int,
    wider_bound: int,
) -> Json:
    """Search A, then C, then B_d and D, and check the plant that comes out by a design of its own.

    bound: largest entry of C in the search that counts; wider_bound: how far it is looked for rivals of its result.
    attained: the smallest change of the gains that makes the poles of A_e the stated ones exactly, beside the half unit
    by which rounding may have changed them.
    """
    state = recover_poles(printed_A, stated_poles, step)
    A = np.array(printed_A)
    A[np.diag_indices(len(A))] = state["fits"][0]
    outputs = recover_outputs(A.tolist(), printed_gains, stated_error_poles, bound)
    wider = recover_outputs(A.tolist(), printed_gains, stated_error_poles, wider_bound)
    inputs = recover_inputs(A.tolist(), outputs["C"], printed_gains)
    plant = {"A": A.tolist(), "B_d": inputs["B_d"], "C": outputs["C"], "D": inputs["D"]}
    change = smallest_change(plant, np.array(printed_gains), np.array(stated_error_poles))
    return {
        "state": state,
        "outputs": outputs,
        "wider": {key: wider[key] for key in ("bound", "tried", "fits", "C", "best_misfit", "second_misfit")},
        "inputs": inputs,
        "design": design(plant, PERIODS, OFFSETS, [0, 1]),
        "gains": norm_of_gains(plant, PERIODS, OFFSETS, printed_gains, half_unit),
        "attained": {"largest_change": change, "half_unit": half_unit},
    }


def smallest_change(plant: dict[str, Matrix], gains: np.ndarray[Any, Any], poles: np.ndarray[Any, Any]) -> float:
    """Largest entry of a small change of the measured gains after which A_e has exactly the given poles.

    Gauss-Newton on the coefficients of the characteristic polynomial, least change in the Euclidean norm each time.
    """
    problem = build(plant, PERIODS, OFFSETS, [0, 1])
    acting = np.flatnonzero(np.repeat(problem.schedule.mask[:, None, :], problem.plant.order, axis=1).ravel())
    target = np.poly(poles)[1:]

    def coefficients(change: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        moved = gains.ravel().copy()
        moved[acting] += change
        return np.real(np.poly(problem.error_system(moved.reshape(gains.shape)).monodromy())[1:])

    change = np.zeros(len(acting))
    for _ in range(20):
        residual = target - coefficients(change)
        if np.abs(residual).max() < 1e-13:
            break
        step = 1e-7
        jacobian = np.array(
            [
                (coefficients(change + step * row) - coefficients(change - step * row)) / (2 * step)
                for row in np.eye(len(acting))
            ]
        ).T
        change = change + np.linalg.lstsq(jacobian, residual, rcond=None)[0]
    return float(np.abs(change).max())

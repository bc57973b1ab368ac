"""Section IV-C: what its printed data give as they stand, and what plant they can have belonged to."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from papers.okajima2023.experiments.designs import Json, Matrix, build, design
from papers.okajima2023.method.input_recovery import recover_inputs
from papers.okajima2023.method.recovery import (
    complete,
    error_monodromy,
    error_poles,
    exact_diagonals,
    recover_outputs,
    recover_poles,
    upper_half,
    with_diagonal,
)
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate.optimum import optimum
from replication.estimation.multirate.problem import SensingSchedule
from replication.estimation.validation import Array

PERIODS, OFFSETS = [2, 3], [0, 0]
"""The schedule of Sec. IV-A, which Sec. IV-C keeps."""
SCHEDULE = SensingSchedule(tuple(PERIODS), tuple(OFFSETS))


def as_printed(plant: dict[str, Matrix], gains: list[Matrix]) -> Json:
    """Poles of the printed A, and of A_e for the printed A, C and gains (42)."""
    poles = upper_half(np.linalg.eigvals(np.array(plant["A"])))
    return {"poles": poles, "error_poles": error_poles(plant["A"], gains, plant["C"])}


def recovered(
    printed_A: Matrix,
    C: Matrix,
    printed_gains: list[Matrix],
    stated_poles: list[list[float]],
    stated_error_poles: list[float],
    printed_inputs: dict[str, Matrix],
    half_unit: float,
    step: float,
    bound: int,
    wider_bound: int,
) -> Json:
    """Search A, then C, then B_d and D, and evaluate the gains for the plant that comes out.

    C, printed_inputs: those of Sec. IV-A, for which the gains are evaluated too.
    bound: largest entry of C in the search that counts; wider_bound: how far it is looked for rivals of its result.
    attained: the largest entry of a small change of the gains with which A_e has the stated poles, beside the half unit
    by which rounding may have changed them.
    """
    state = recover_poles(printed_A, stated_poles, step)
    A = with_diagonal(printed_A, state["fits"][0])
    outputs, wider = (recover_outputs(A, printed_gains, stated_error_poles, most) for most in (bound, wider_bound))
    inputs = recover_inputs(A, outputs["C"], printed_gains, SCHEDULE)
    plant = {"A": A, "B_d": inputs["B_d"], "C": outputs["C"], "D": inputs["D"]}
    gains = np.array(printed_gains)

    def achieved(plant: dict[str, Matrix]) -> Json:
        problem = build(plant, PERIODS, OFFSETS, [0, 1])
        return {"norm": l2_gain(problem.error_system(gains)).value, "optimum": optimum(problem).value}

    change = smallest_change(plant, gains, np.array(stated_error_poles))
    return {
        "state": state,
        "outputs": {
            **outputs,
            "error_poles": error_poles(A, printed_gains, outputs["C"]),
            "error_poles_printed_C": error_poles(A, printed_gains, C),
        },
        "wider": wider,
        "inputs": inputs,
        "gains": achieved(plant),
        "printed_inputs": achieved({**plant, **printed_inputs}),
        "attained": {"largest_change": float(np.abs(change).max()), "half_unit": half_unit},
    }


def diagonals(
    printed_A: Matrix,
    C: Matrix,
    printed_gains: list[Matrix],
    stated_poles: list[list[float]],
    stated_error_poles: list[float],
    half_unit: float,
    bound: int,
) -> Json:
    """All real diagonals of A with the stated poles, other entries as printed, and what the gains do with this C.

    For each: the diagonal, the spectral radius of A_e, and its least value while the stated poles move to the ends and
    the middle of their rounding, `half_unit` either way; and how many integer C with entries up to `bound` explain the
    stated poles of A_e.
    """

    def radii(poles: Any) -> list[float]:
        matrices = [with_diagonal(printed_A, found) for found in exact_diagonals(printed_A, poles)]
        return [abs(complex(*error_poles(A, printed_gains, C)[0])) for A in matrices]

    # The imaginary part of a real pole stays zero.
    moves = [(-half_unit, 0.0, half_unit) if part else (0.0,) for part in np.ravel(stated_poles)]
    moved = [radii(np.add(stated_poles, np.reshape(move, (-1, 2)))) for move in itertools.product(*moves)]
    rows = zip(exact_diagonals(printed_A, stated_poles), radii(stated_poles), zip(*moved, strict=True), strict=True)
    return {
        "moved": len(moved),
        "bound": bound,
        "found": [
            {
                "diagonal": found,
                "radius": radius,
                "least_radius": min(others),
                "fits": recover_outputs(with_diagonal(printed_A, found), printed_gains, stated_error_poles, bound)[
                    "fits"
                ],
            }
            for found, radius, others in rows
        ],
    }


def smallest_change(plant: dict[str, Matrix], gains: Array, poles: Array) -> Array:
    """A small change of the measured gains after which A_e has the given poles, in the shape of the gains."""
    acting = np.broadcast_to(SCHEDULE.mask[:, None, :], gains.shape)
    target = np.poly(poles)

    def placed(change: Array) -> Array:
        found = np.zeros(gains.shape)
        found[acting] = change
        return found

    def residual(change: Array) -> Array:
        return np.real(np.poly(error_monodromy(plant["A"], gains + placed(change), plant["C"])) - target)[1:]

    return placed(_root(residual, np.zeros(acting.sum())))


def _root(residual: Callable[[Array], Array], start: Array) -> Array:
    """A root near `start` by Gauss-Newton, with the least change in the Euclidean norm each time."""
    found = start
    for _ in range(20):
        if np.abs(residual(found)).max() < 1e-13:
            break
        step = 1e-7
        moves = step * np.eye(len(found))
        jacobian = np.array([(residual(found + move) - residual(found - move)) / (2 * step) for move in moves]).T
        found = found - np.linalg.lstsq(jacobian, residual(found), rcond=None)[0]
    return found


def stated_matrices(
    printed_A: Matrix,
    C: Matrix,
    printed_gains: list[Matrix],
    stated_poles: list[list[float]],
    stated_error_poles: list[float],
    step: float,
    diagonal_decimals: int,
    decimals: int,
) -> dict[str, Matrix]:
    """Each A tried that has the stated poles: with two diagonals, and one all of whose entries may differ.

    The second diagonal is rounded to `diagonal_decimals` places, the last A to `decimals`.
    """
    second = np.round(exact_diagonals(printed_A, stated_poles)[1], diagonal_decimals)
    free = any_entries(printed_A, C, printed_gains, stated_poles, stated_error_poles, decimals)
    return {
        "diagonal in steps": with_diagonal(printed_A, recover_poles(printed_A, stated_poles, step)["fits"][0]),
        "other diagonal": with_diagonal(printed_A, second),
        "any entries": free["rounded"],
    }


def stated_designs(inputs: dict[str, Matrix], C: Matrix, **given: Any) -> Json:
    """Designs for each of `stated_matrices`, which takes C and `given`; inputs: the B_d and D of Sec. IV-A."""
    return {
        name: {
            "poles": upper_half(np.linalg.eigvals(A)),
            **design({**inputs, "A": A, "C": C}, PERIODS, OFFSETS, [0, 1]),
        }
        for name, A in stated_matrices(C=C, **given).items()
    }


def any_entries(
    printed_A: Matrix,
    C: Matrix,
    printed_gains: list[Matrix],
    stated_poles: list[list[float]],
    stated_error_poles: list[float],
    decimals: int,
) -> Json:
    """An A with the stated poles for which A_e with this C and these gains has the stated poles too.

    All its entries may differ from the printed ones; it is sought from the first diagonal with the stated poles on.
    Of A there are more entries than conditions, so it is one of many. error_poles: those of A_e. rounded: A to
    `decimals` places, with its poles and the spectral radius of A_e for it.
    """
    start = np.array(with_diagonal(printed_A, exact_diagonals(printed_A, stated_poles)[0]))
    target, error_target = np.poly(complete(stated_poles)), np.poly(stated_error_poles)

    def residual(entries: Array) -> Array:
        A = entries.reshape(start.shape)
        found = (np.poly(A) - target, np.poly(error_monodromy(A, printed_gains, C)) - error_target)
        return np.real(np.concatenate([difference[1:] for difference in found]))

    A = _root(residual, start.ravel()).reshape(start.shape)
    rounded = np.round(A, decimals)
    return {
        "error_poles": error_poles(A, printed_gains, C),
        "furthest": float(np.abs(A - printed_A).max()),
        "rounded": rounded.tolist(),
        "poles": upper_half(np.linalg.eigvals(rounded)),
        "radius": abs(complex(*error_poles(rounded, printed_gains, C)[0])),
    }

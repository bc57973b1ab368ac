"""Section IV-C: what its printed data give as they stand, and what plant they can have belonged to."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from papers.okajima2023.experiments.designs import Json, Matrix, build, design, norm_of_gains
from papers.okajima2023.method.input_recovery import recover_inputs
from papers.okajima2023.method.recovery import (
    by_modulus,
    error_poles,
    exact_diagonals,
    recover_outputs,
    recover_poles,
    upper_half,
)
from papers.okajima2023.printed import PLANT
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate.optimum import optimum
from replication.estimation.validation import Array

PERIODS, OFFSETS = [2, 3], [0, 0]
"""The schedule of Sec. IV-A, which Sec. IV-C keeps."""


def as_printed(plant: dict[str, Matrix], gains: list[Matrix]) -> Json:
    """Poles of the printed A, and of A_e for the printed A, C and gains (42)."""
    poles, error_poles = np.linalg.eigvals(np.array(plant["A"])), _error_poles(plant["A"], plant["C"], gains)
    return {"poles": upper_half(poles), "error_poles": by_modulus(error_poles)}


def _monodromy(A: Matrix | Array, C: Matrix, gains: list[Matrix]) -> Array:
    """A_e over one period; what disturbs plant and sensors plays no part."""
    plant: dict[str, Any] = {"A": A, "B_d": [[0.0]] * len(A), "C": C, "D": np.eye(len(C)).tolist()}
    return build(plant, PERIODS, OFFSETS, list(range(len(C)))).error_system(np.array(gains)).monodromy()


def _error_poles(A: Matrix | Array, C: Matrix, gains: list[Matrix]) -> Array:
    return np.asarray(np.linalg.eigvals(_monodromy(A, C, gains)))


def recovered(
    printed_A: Matrix,
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

    printed_inputs: the B_d and D of Sec. IV-A, for which the gains are evaluated too.
    bound: largest entry of C in the search that counts; wider_bound: how far it is looked for rivals of its result.
    attained: the largest entry of a small change of the gains with which A_e has the stated poles, beside the half unit
    by which rounding may have changed them.
    """
    state = recover_poles(printed_A, stated_poles, step)
    A = np.array(printed_A)
    A[np.diag_indices(len(A))] = state["fits"][0]
    outputs = recover_outputs(A.tolist(), printed_gains, stated_error_poles, bound)
    wider = recover_outputs(A.tolist(), printed_gains, stated_error_poles, wider_bound)
    inputs = recover_inputs(A.tolist(), outputs["C"], printed_gains)
    plant = {"A": A.tolist(), "B_d": inputs["B_d"], "C": outputs["C"], "D": inputs["D"]}
    same = build({**plant, **printed_inputs}, PERIODS, OFFSETS, [0, 1])
    gains = np.array(printed_gains)
    change = smallest_change(plant, gains, np.array(stated_error_poles))
    return {
        "state": state,
        "outputs": {
            **outputs,
            "error_poles": error_poles(A.tolist(), printed_gains, outputs["C"]),
            "error_poles_printed_C": error_poles(A.tolist(), printed_gains, PLANT["C"]),
        },
        "wider": wider,
        "inputs": inputs,
        "gains": norm_of_gains(plant, PERIODS, OFFSETS, printed_gains, half_unit),
        "printed_inputs": {"norm": l2_gain(same.error_system(gains)).value, "optimum": optimum(same).value},
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
    rows = [_row(printed_A, diagonal) for diagonal in exact_diagonals(printed_A, stated_poles)]
    parts = [part for pole in stated_poles for part in pole]
    # The imaginary part of a real pole stays zero.
    moves = [(-half_unit, 0.0, half_unit) if part else (0.0,) for part in parts]
    for move in itertools.product(*moves):
        moved = [part + by for part, by in zip(parts, move, strict=True)]
        found = exact_diagonals(printed_A, [moved[i : i + 2] for i in range(0, len(moved), 2)])
        for row, diagonal in zip(rows, found, strict=True):
            error_poles_there = _error_poles(_row(printed_A, diagonal)["A"], C, printed_gains)
            row["radii"].append(float(np.abs(error_poles_there).max()))
    return {
        "moved": len(rows[0]["radii"]),
        "bound": bound,
        "found": [
            {
                "diagonal": row["diagonal"],
                "radius": row["radii"][len(row["radii"]) // 2],
                "least_radius": min(row["radii"]),
                "fits": recover_outputs(row["A"], printed_gains, stated_error_poles, bound)["fits"],
            }
            for row in rows
        ],
    }


def _row(printed_A: Matrix, diagonal: list[float]) -> Json:
    A = np.array(printed_A)
    A[np.diag_indices(len(A))] = diagonal
    return {"diagonal": diagonal, "A": A.tolist(), "radii": []}


def smallest_change(plant: dict[str, Matrix], gains: Array, poles: Array) -> Array:
    """A small change of the measured gains after which A_e has the given poles, in the shape of the gains.

    Gauss-Newton on the coefficients of the characteristic polynomial, least change in the Euclidean norm each time.
    """
    problem = build(plant, PERIODS, OFFSETS, [0, 1])
    acting = np.flatnonzero(np.repeat(problem.schedule.mask[:, None, :], problem.plant.order, axis=1).ravel())
    target = np.poly(poles)[1:]

    def placed(change: Array) -> Array:
        all_entries = np.zeros(gains.size)
        all_entries[acting] = change
        return all_entries.reshape(gains.shape)

    def coefficients(change: Array) -> Array:
        return np.real(np.poly(problem.error_system(gains + placed(change)).monodromy())[1:])

    return placed(_root(lambda change: coefficients(change) - target, np.zeros(len(acting))))


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


def stated_designs(
    plant: dict[str, Matrix],
    printed_gains: list[Matrix],
    stated_poles: list[list[float]],
    stated_error_poles: list[float],
    step: float,
    diagonal_decimals: int,
    decimals: int,
) -> Json:
    """Designs for each A tried that has the stated poles, all else of the plant as in Sec. IV-A.

    They are the two diagonals, the second to `diagonal_decimals` places, and the A of which all entries may differ.
    """
    A = plant["A"]
    grid = recover_poles(A, stated_poles, step)["fits"][0]
    second = np.round(exact_diagonals(A, stated_poles)[1], diagonal_decimals).tolist()
    free = any_entries(A, plant["C"], printed_gains, stated_poles, stated_error_poles, decimals)["rounded"]
    found = {"diagonal in steps": _row(A, grid)["A"], "other diagonal": _row(A, second)["A"], "any entries": free}
    return {
        name: {"poles": upper_half(np.linalg.eigvals(one)), **design({**plant, "A": one}, PERIODS, OFFSETS, [0, 1])}
        for name, one in found.items()
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
    start = np.array(_row(printed_A, exact_diagonals(printed_A, stated_poles)[0])["A"])
    known = [complex(*pole) for pole in stated_poles]
    target = np.poly([*known, *(pole.conjugate() for pole in known if pole.imag)]).real[1:]
    error_target = np.poly(stated_error_poles)[1:]

    def residual(entries: Array) -> Array:
        A = entries.reshape(start.shape)
        monodromy = _monodromy(A, C, printed_gains)
        found = (np.poly(A) - [1.0, *target], np.poly(monodromy) - [1.0, *error_target])
        return np.real(np.concatenate([difference[1:] for difference in found]))

    A = _root(residual, start.ravel()).reshape(start.shape)
    rounded = np.round(A, decimals)
    return {
        "error_poles": by_modulus(_error_poles(A, C, printed_gains)),
        "furthest": float(np.abs(A - printed_A).max()),
        "rounded": rounded.tolist(),
        "poles": upper_half(np.linalg.eigvals(rounded)),
        "radius": float(np.abs(_error_poles(rounded, C, printed_gains)).max()),
    }

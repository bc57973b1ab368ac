"""Section IV-C: what its printed data give as they stand, and what plant they can have belonged to."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from papers.okajima2023.experiments.designs import Json, Matrix, build, design
from papers.okajima2023.method.recovery import (
    complete,
    error_monodromy,
    error_poles,
    exact_diagonals,
    recover_inputs,
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


def as_printed(stated: Json) -> Json:
    """Poles of the printed A, and of A_e for the printed A, C and gains (42).

    stated: what Sec. IV-C prints, A of eq. (41), gains (42) and the poles of A and of A_e; and the C of Sec. IV-A.
    """
    poles = upper_half(np.linalg.eigvals(np.array(stated["A"])))
    return {"poles": poles, "error_poles": error_poles(stated["A"], stated["gains"], stated["C"])}


def recovered(
    stated: Json, inputs: dict[str, Matrix], half_unit: float, step: float, bound: int, wider_bound: int
) -> Json:
    """Search A, then C, then B_d and D, and evaluate the gains for the plant that comes out.

    inputs: the B_d and D of Sec. IV-A, for which the gains are evaluated too.
    bound: largest entry of C in the search that counts; wider_bound: how far it is looked for rivals of its result.
    attained: the largest entry of a small change of the gains with which A_e has the stated poles, beside the half unit
    by which rounding may have changed them.
    """
    state, gains = recover_poles(stated["A"], stated["poles"], step), np.array(stated["gains"])
    A = with_diagonal(stated["A"], state["fits"][0])
    outputs, wider = (recover_outputs(A, stated["gains"], stated["error_poles"], most) for most in (bound, wider_bound))
    channels = recover_inputs(A, outputs["C"], stated["gains"], SCHEDULE)
    plant = {"A": A, "B_d": channels["B_d"], "C": outputs["C"], "D": channels["D"]}

    def achieved(plant: dict[str, Matrix]) -> Json:
        problem = build(plant, PERIODS, OFFSETS, [0, 1])
        return {"norm": l2_gain(problem.error_system(gains)).value, "optimum": optimum(problem).value}

    change = smallest_change(plant, gains, np.array(stated["error_poles"]))
    return {
        "state": state,
        "outputs": {
            **outputs,
            "error_poles": error_poles(A, gains, outputs["C"]),
            "error_poles_printed_C": error_poles(A, gains, stated["C"]),
        },
        "wider": wider,
        "inputs": channels,
        "gains": achieved(plant),
        "printed_inputs": achieved({**plant, **inputs}),
        "attained": {"largest_change": float(np.abs(change).max()), "half_unit": half_unit},
    }


def diagonals(stated: Json, half_unit: float, bound: int) -> Json:
    """All real diagonals of A with the stated poles, other entries as printed, and what the gains do with this C.

    For each: the diagonal, the spectral radius of A_e, and its least value while the stated poles move to the ends and
    the middle of their rounding, `half_unit` either way; and how many integer C with entries up to `bound` explain the
    stated poles of A_e.
    """

    def evaluations(poles: Any) -> list[tuple[list[float], Matrix, float]]:
        candidates = [(entries, with_diagonal(stated["A"], entries)) for entries in exact_diagonals(stated["A"], poles)]
        return [
            (entries, A, abs(complex(*error_poles(A, stated["gains"], stated["C"])[0]))) for entries, A in candidates
        ]

    # The imaginary part of a real pole stays zero.
    moves = [(-half_unit, 0.0, half_unit) if part else (0.0,) for part in np.ravel(stated["poles"])]
    moved = [evaluations(np.add(stated["poles"], np.reshape(move, (-1, 2)))) for move in itertools.product(*moves)]
    return {
        "moved": len(moved),
        "bound": bound,
        "found": [
            {
                "diagonal": entries,
                "radius": radius,
                "least_radius": min(row[number][2] for row in moved),
                "fits": recover_outputs(A, stated["gains"], stated["error_poles"], bound)["fits"],
            }
            for number, (entries, A, radius) in enumerate(evaluations(stated["poles"]))
        ],
    }


def smallest_change(plant: dict[str, Matrix], gains: Array, poles: Array) -> Array:
    """A small change of the measured gains after which A_e has the given poles, in the shape of the gains."""
    acting = np.broadcast_to(SCHEDULE.mask[:, None, :], gains.shape)
    target = np.poly(poles)

    def gain_shifts(change: Array) -> Array:
        shifts = np.zeros(gains.shape)
        shifts[acting] = change
        return shifts

    def residual(change: Array) -> Array:
        return np.real(np.poly(error_monodromy(plant["A"], gains + gain_shifts(change), plant["C"])) - target)[1:]

    return gain_shifts(_root(residual, np.zeros(acting.sum())))


def _root(residual: Callable[[Array], Array], start: Array) -> Array:
    """A root near `start` by Gauss-Newton, with the least change in the Euclidean norm each time."""
    root = start
    for _ in range(20):
        if np.abs(residual(root)).max() < 1e-13:
            break
        step = 1e-7
        moves = step * np.eye(len(root))
        jacobian = np.array([(residual(root + move) - residual(root - move)) / (2 * step) for move in moves]).T
        root = root - np.linalg.lstsq(jacobian, residual(root), rcond=None)[0]
    return root


def stated_matrices(stated: Json, step: float, diagonal_decimals: int, decimals: int) -> dict[str, Matrix]:
    """Each A tried that has the stated poles: with two diagonals, and one all of whose entries may differ.

    The second diagonal is rounded to `diagonal_decimals` places, the last A to `decimals`.
    """
    A, poles = (stated[name] for name in ("A", "poles"))
    return {
        "diagonal in steps": with_diagonal(A, recover_poles(A, poles, step)["fits"][0]),
        "other diagonal": with_diagonal(A, np.round(exact_diagonals(A, poles)[1], diagonal_decimals)),
        "any entries": any_entries(stated, decimals)["rounded"],
    }


def stated_designs(stated: Json, inputs: dict[str, Matrix], **search: Any) -> Json:
    """Designs for each of `stated_matrices`, which takes `search`; inputs: the B_d and D of Sec. IV-A."""
    plants = {name: {**inputs, "A": A, "C": stated["C"]} for name, A in stated_matrices(stated, **search).items()}
    return {
        name: {"poles": upper_half(np.linalg.eigvals(plant["A"])), **design(plant, PERIODS, OFFSETS, [0, 1])}
        for name, plant in plants.items()
    }


def any_entries(stated: Json, decimals: int) -> Json:
    """An A with the stated poles for which A_e with this C and these gains has the stated poles too.

    All its entries may differ from the printed ones; it is sought from the first diagonal with the stated poles on.
    Of A there are more entries than conditions, so it is one of many. error_poles: those of A_e. rounded: A to
    `decimals` places, with its poles and the spectral radius of A_e for it.
    """
    start = np.array(with_diagonal(stated["A"], exact_diagonals(stated["A"], stated["poles"])[0]))
    target, error_target = np.poly(complete(stated["poles"])), np.poly(stated["error_poles"])

    def residual(entries: Array) -> Array:
        A = entries.reshape(start.shape)
        differences = (np.poly(A) - target, np.poly(error_monodromy(A, stated["gains"], stated["C"])) - error_target)
        return np.real(np.concatenate([difference[1:] for difference in differences]))

    A = _root(residual, start.ravel()).reshape(start.shape)
    rounded = np.round(A, decimals)
    return {
        "error_poles": error_poles(A, stated["gains"], stated["C"]),
        "furthest": float(np.abs(A - stated["A"]).max()),
        "rounded": rounded.tolist(),
        "poles": upper_half(np.linalg.eigvals(rounded)),
        "radius": abs(complex(*error_poles(rounded, stated["gains"], stated["C"])[0])),
    }

"""Statements on the method: lemmas, intervals (9), Algorithm 1, the inequality (10), the printed filter's columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flint import arb, arb_mat, ctx, fmpq

from replication.verify.algebra.decimals import above, below
from replication.verify.algebra.linear import require_hurwitz
from replication.verify.nonuniform import identities
from replication.verify.nonuniform.gain import lyapunov_level
from replication.verify.nonuniform.grid import (
    Covering,
    logarithmic_norm,
    require_lower_end,
    require_one_interval_is_not_enough,
    require_radius,
    require_response,
    require_stall,
    require_upper_end,
    run_algorithm,
    state_transition,
)
from replication.verify.nonuniform.system import (
    PRECISION,
    Plant,
    along,
    read_filter,
    read_plant,
    seconds,
)
from replication.verify.reading import fields, integer, positive, require_empty
from replication.verify.theorem import Theorem, require

Certificate = Mapping[str, Any]
DIGITS = 40
"""Bits of the bounds of entries."""


def lemma_2(certificate: Certificate) -> Theorem:
    """Lemma 2."""
    require_empty(certificate, "parameters", "bound", "witness")
    identities.require_lemma_2()
    return _holds("Phi and Gamma at h_0 + theta are those at h_0 with Delta(theta) in a loop, for every A and B.")


def lemma_3(certificate: Certificate) -> Theorem:
    """Lemma 3 for two states, with mu of the plant."""
    plant = _plant(certificate)
    require_empty(certificate, "parameters", "bound", "witness")
    identities.require_lemma_3()
    with ctx.workprec(PRECISION):
        mu = logarithmic_norm(plant.A).str(10, radius=False)
    return _holds(f"|e^(At)| <= e^(mu t) for all t >= 0 and every A of order two; here mu(A) = {mu}.")


def loop_map(certificate: Certificate) -> Theorem:
    """The map below (7) and in (12), in the right order; the printed order has no value for the plant."""
    plant = _plant(certificate)
    require_empty(certificate, "parameters", "bound", "witness")
    identities.require_map()
    n, m, s = plant.A.nrows(), plant.B.ncols(), plant.L.nrows()
    require(m != n and s != n, "the printed order of the factors has a value here: m = n or s = n")
    return _holds(
        "For signals of two components w -> e at a constant Delta is Sigma_22 + Sigma_21 Delta (I - Sigma_11 Delta)^-1 "
        f"Sigma_12. As printed, Sigma_12 ({n} x {m}) would be multiplied by Delta ({n} x {n}), and ({n} x {n}) by "
        f"Sigma_21 ({s} x {n})."
    )


def congruence(certificate: Certificate) -> Theorem:
    """(10) from (6)."""
    require_empty(certificate, "parameters", "bound", "witness")
    identities.require_congruence()
    return _holds(f"(10) is the congruence of (6) by diag(J_1, I, J_1, I), entry by entry, for {identities.SIZE}.")


def recovery(certificate: Certificate) -> Theorem:
    """The filter by (11)."""
    require_empty(certificate, "parameters", "bound", "witness")
    identities.require_recovery()
    return _holds(
        "The filter by (11) is the one behind the unknowns of (10), in other coordinates of its state, for "
        f"{identities.SIZE}."
    )


def sizes(certificate: Certificate) -> Theorem:
    """The size of F in (10): F C is added to Y Phi."""
    plant = _plant(certificate)
    filter_ = read_filter(certificate["plant"]["filter"], "plant.filter", plant)
    require_empty(certificate, "parameters", "bound", "witness")
    n, r = plant.A.nrows(), plant.C.nrows()
    require((filter_.B.nrows(), filter_.B.ncols()) == (n, r), "the printed B_f = -Y^-1 F has another size")
    require(r != n, "both sizes are the same here")
    return _holds(f"F, to be multiplied by C ({r} x {n}) and added to an {n} x {n} block, is {n} x {r}, not {r} x {n}.")


def upper_end(certificate: Certificate) -> Theorem:
    """Case U3 of (9) with mu(A), and as printed."""
    plant = _plant(certificate)
    require_empty(certificate, "parameters", "bound", "witness")
    identities.require_sharp_ends()
    with ctx.workprec(PRECISION):
        printed = require_upper_end(plant)
    return _holds(f"With mu(A) in U3, alpha times the bound of Lemma 3 reaches one at the upper end of (9); {printed}.")


def lower_end(certificate: Certificate) -> Theorem:
    """Case L3 of (9)."""
    plant = _plant(certificate)
    require_empty(certificate, "parameters", "bound", "witness")
    identities.require_sharp_ends()
    with ctx.workprec(PRECISION):
        require_lower_end(plant)
    return _holds("At the lower end of (9), case L3, alpha times the bound of Lemma 3 for -A is one.")


def grid_size(certificate: Certificate) -> Theorem:
    """The number of elements with which Algorithm 1, corrected, ends."""
    _, covering = _covering(certificate)
    stated = fields(certificate["bound"], "bound", "lower", "upper")
    require(stated == (str(covering.size),) * 2, f"the grid has {covering.size} elements, not {' to '.join(stated)}")
    size = fmpq(covering.size)
    return Theorem(
        sentence=f"Algorithm 1 with U3 corrected, alpha in both steps and a set-minus in step 4 ends with "
        f"{covering.size} elements after {covering.passes} passes.",
        lower=size,
        upper=size,
    )  # fmt: skip


def one_interval(certificate: Certificate) -> Theorem:
    """Theorem 1 for one period leaves out periods for which the error system is stable all the same."""
    plant, covering = _covering(certificate)
    require_empty(certificate, "bound")
    require_hurwitz(plant.A, "the plant")
    with ctx.workprec(PRECISION):
        require_one_interval_is_not_enough(plant, covering)
    return _holds(
        "The interval (9) around the middle leaves out part of the range, although the error system of every filter "
        f"with A_f Schur is stable on all of it; {covering.size} elements cover the range."
    )


def stalls(certificate: Certificate) -> Theorem:
    """Algorithm 1 as printed neither covers the range nor adds an element."""
    plant = _plant(certificate)
    require_empty(certificate, "parameters", "bound")
    with ctx.workprec(PRECISION):
        how = require_stall(plant, certificate["witness"])
    return Theorem(
        sentence="Algorithm 1 as printed does not reach a grid: step 3 fails at the first element and step 4 leaves "
        f"all as it is, with a set-minus as without: {how}.",
        holds=False,
    )  # fmt: skip


def same_level(certificate: Certificate) -> Theorem:
    """One level for both channels of (13) is larger than a level that a filter has for every sequence.

    In the coordinates of the plant: a change of coordinates would change alpha and the norm of Delta.
    """
    plant = _plant(certificate)
    require_empty(certificate, "bound")
    (count,) = fields(certificate["parameters"], "parameters", "cells")
    cells = integer(count, "parameters.cells", 1)
    names = ("cell", "alpha", "response", "radius", "direction", "filter", "level", "storage")
    cell, alpha, response, radius, direction, given, stated, storage = fields(certificate["witness"], "witness", *names)
    number = integer(cell, "witness.cell")
    require(number < cells, "witness.cell is not one of the cells")
    middle = fmpq(2 * number + 1, 2 * cells)
    gain, size = positive(alpha, "witness.alpha"), positive(radius, "witness.radius")
    with ctx.workprec(PRECISION):
        Phi = state_transition(plant, seconds(along(plant.h_l, plant.h_u, middle)))
        require_response(plant.A, Phi, gain, response, "witness.response")
        half = (seconds(plant.h_u) - seconds(plant.h_l)) / (2 * cells)
        require_radius(plant.A, half, size, direction, "witness.direction")
        filter_ = read_filter(given, "witness.filter", plant)
        level = lyapunov_level(plant, filter_, (plant.h_l, plant.h_u), "samples", {"upper": stated}, storage)
    forced = min(gain, gain * size)
    require(level < forced, f"the level {level} of the filter is not below {forced}")
    return Theorem(
        sentence=f"With {cells} cells, in the coordinates of the plant, one level for both channels is at least "
        f"{below(forced)}, whether or not Delta is divided by its norm; a filter has the level {above(level)} for "
        "every sequence.",
        holds=True,
    )


def observer_column(certificate: Certificate) -> Theorem:
    """A column of Phi(h) - B_f C at the middle of the range, with the printed B_f."""
    plant = _plant(certificate)
    filter_ = read_filter(certificate["plant"]["filter"], "plant.filter", plant)
    (number,) = fields(certificate["parameters"], "parameters", "column")
    require_empty(certificate, "bound", "witness")
    column = integer(number, "parameters.column")
    require(column < plant.A.nrows(), "parameters.column is not one of the columns")
    with ctx.workprec(PRECISION):
        whole = state_transition(plant, seconds(along(plant.h_l, plant.h_u, fmpq(1, 2)))) - arb_mat(filter_.B * plant.C)
        entries = [row[column] for row in whole.tolist()]
        items = tuple(_ends(entry) for entry in entries)
    shown = ", ".join(entry.str(8, radius=False) for entry in entries)
    return Theorem(sentence=f"Column {column + 1} of Phi(h) - B_f C at the middle is [{shown}].", items=items)


def _plant(certificate: Certificate) -> Plant:
    return read_plant(certificate["plant"])


def _holds(sentence: str) -> Theorem:
    return Theorem(sentence=sentence, holds=True)


def _covering(certificate: Certificate) -> tuple[Plant, Covering]:
    """The plant, and how the corrected Algorithm 1 ends."""
    plant = _plant(certificate)
    require_empty(certificate, "parameters")
    (passes,) = fields(certificate["witness"], "witness", "passes")
    with ctx.workprec(PRECISION):
        return plant, run_algorithm(plant, passes)


def _ends(ball: arb) -> tuple[fmpq, fmpq]:
    """Multiples of 2^-DIGITS on both sides of a ball."""
    scaled = ball * 2**DIGITS
    return tuple(fmpq(end.unique_fmpz(), 2**DIGITS) for end in (scaled.lower().floor(), scaled.upper().ceil()))  # type: ignore[return-value]


STATEMENTS: Mapping[str, Callable[[Certificate], Theorem]] = {
    "nonuniform.lemma-2": lemma_2,
    "nonuniform.lemma-3": lemma_3,
    "nonuniform.map": loop_map,
    "nonuniform.congruence": congruence,
    "nonuniform.recovery": recovery,
    "nonuniform.sizes": sizes,
    "nonuniform.upper-end": upper_end,
    "nonuniform.lower-end": lower_end,
    "nonuniform.grid-size": grid_size,
    "nonuniform.one-interval": one_interval,
    "nonuniform.stalls": stalls,
    "nonuniform.same-level": same_level,
    "nonuniform.observer-column": observer_column,
}

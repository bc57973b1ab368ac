"""Statements that compare two dual-rate loops of Shao et al.: tracking errors, estimation errors, transients."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flint import acb, acb_mat, arb, fmpq

from replication.verify.algebra.decimals import above, below
from replication.verify.dualrate.loop import Loop, monodromy, precisely, read_loop, read_observer
from replication.verify.dualrate.loops import NAMES, require_eigenvalue_beyond
from replication.verify.dualrate.response import (
    Place,
    error_at,
    largest,
    read_place,
    require_all_below,
    require_position_form,
    steady_motion,
    steady_passage,
)
from replication.verify.dualrate.roots import is_less, require_roots_within
from replication.verify.reading import fields, positive, require_empty, sequence
from replication.verify.theorem import Theorem, require

MOST_PAIRS = 20


def errors_ordered(certificate: Mapping[str, Any]) -> Theorem:
    """In each pair of (observer, σ) the first has the smaller largest error: below a level that the second exceeds."""
    (given,) = fields(certificate["parameters"], "parameters", "pairs")
    (places,) = fields(certificate["witness"], "witness", "places")
    require_empty(certificate, "bound")
    loop = read_loop(certificate["plant"])
    pairs = sequence(given, "parameters.pairs", lambda value, path: sequence(value, path, _setting, 2))
    require(len(pairs) > 0, "parameters.pairs is empty")
    require(len(pairs) <= MOST_PAIRS, f"parameters.pairs has {len(pairs)} pairs, more than {MOST_PAIRS}")

    def read(value: Any, path: str) -> tuple[fmpq, Place]:
        level, phase, time, scales = fields(value, path, "level", "phase", "time", "scales")
        return positive(level, f"{path}.level"), read_place(loop, phase, time, scales, path)

    levels = sequence(places, "witness.places", read, len(pairs))
    for i, ((smaller, greater), (bound, found)) in enumerate(zip(pairs, levels, strict=True)):
        moving, begun = steady_motion(loop, *greater, found.scales)
        reached = error_at(moving, begun[found.phase], found.time)
        require(is_less(arb(bound), reached), f"the second error of pair {i} does not exceed the level there")
        require_all_below(*steady_motion(loop, *smaller, found.scales), loop.T, bound)
    words = ", ".join(f"{_words(*smaller)} < {_words(*greater)}" for smaller, greater in pairs)
    return Theorem(sentence=f"Largest tracking errors in the steady state are ordered so: {words}.", holds=True)


def estimates_ordered(certificate: Mapping[str, Any]) -> Theorem:
    """The largest |y − C x̂| over the fast instants is smaller for one observer than for another.

    As for the tracking error, the supremum is the largest modulus of an amplitude, here over the M phases.
    """
    parameters = fields(certificate["parameters"], "parameters", "observer", "than", "frequency")
    require_empty(certificate, "bound", "witness")
    loop, sigma = read_loop(certificate["plant"]), positive(parameters[2], "parameters.frequency")
    names = [read_observer(value) for value in parameters[:2]]
    errors = [_estimation_error(loop, name, sigma) for name in names]
    require(is_less(errors[0], errors[1]), f"the estimation errors are {errors[0].str(5)} and {errors[1].str(5)}")
    sizes = [
        f"{below(100 * error.lower().fmpq(), 4)} to {above(100 * error.upper().fmpq(), 4)} percent of the amplitude in "
        f"{NAMES[name]}"
        for error, name in zip(errors, names, strict=True)
    ]
    return Theorem(
        sentence=f"With y_d = sin({sigma} t) the largest error of C x̂ at the fast instants is {sizes[0]}, {sizes[1]}.",
        holds=True,
    )


def as_fast(certificate: Mapping[str, Any]) -> Theorem:
    """That one loop decays as fast as another is false: an eigenvalue lies outside a circle that holds the others.

    This compares asymptotic rates, those of almost every start; a given start need not excite the eigenvalue.
    """
    chosen, other = fields(certificate["parameters"], "parameters", "observer", "than")
    guess, size = fields(certificate["witness"], "witness", "root", "radius")
    require_empty(certificate, "bound")
    loop, observer, than = read_loop(certificate["plant"]), read_observer(chosen), read_observer(other)
    radius = positive(size, "witness.radius")
    require_eigenvalue_beyond(loop, observer, guess, radius)
    require_roots_within(monodromy(loop, than).charpoly(), radius, "the eigenvalues of the other loop")
    return Theorem(
        sentence=f"In its asymptotic rate {NAMES[observer]} does not decay as fast as {NAMES[than]}: its spectral "
        f"radius over one slow period is at least {below(radius)}, and larger than the other one, which is below "
        f"{above(radius)}.",
        holds=False,
    )


def _estimation_error(loop: Loop, observer: str, sigma: fmpq) -> arb:
    require_position_form(loop)
    require_roots_within(monodromy(loop, observer).charpoly(), fmpq(1), "the eigenvalues of Φ")
    passage, C = steady_passage(loop, observer, acb(0, arb(sigma))), acb_mat(loop.C)
    return largest([abs((C * (x - used))[0, 0]) for x, used in zip(passage.states, passage.used, strict=True)])


def _setting(value: Any, path: str) -> tuple[str, fmpq]:
    observer, frequency = fields(value, path, "observer", "frequency")
    return read_observer(observer), positive(frequency, f"{path}.frequency")


def _words(observer: str, sigma: fmpq) -> str:
    return f"{observer} at σ = {sigma}"


STATEMENTS: Mapping[str, Callable[[Mapping[str, Any]], Theorem]] = {
    "dualrate.errors-ordered": precisely(errors_ordered),
    "dualrate.estimates-ordered": precisely(estimates_ordered),
    "dualrate.as-fast": precisely(as_fast),
}

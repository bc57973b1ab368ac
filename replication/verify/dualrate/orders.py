"""Statements that compare two dual-rate loops of Shao et al.: tracking errors, estimation errors, transients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import acb, acb_mat, arb, fmpq

from replication.verify.algebra.balls import is_less, largest
from replication.verify.algebra.decimals import above, below
from replication.verify.algebra.roots import require_roots_within
from replication.verify.dualrate import response
from replication.verify.dualrate.loop import Loop, Observer, monodromy, on_loop, read_observer
from replication.verify.dualrate.loops import read_guess, require_eigenvalue_beyond
from replication.verify.dualrate.response import Place
from replication.verify.reading import fields, positive, sequence, several, sized
from replication.verify.statement import Depends, Found
from replication.verify.theorem import require

MOST_PAIRS = 20


@dataclass(frozen=True)
class Setting:
    """An observer, and the frequency σ of its reference in rad/s."""

    observer: Observer
    frequency: fmpq

    def __str__(self) -> str:
        """In a sentence."""
        return f"{self.observer} at σ = {self.frequency}"


def read_setting(value: Any, path: str) -> Setting:
    """{observer, frequency}."""
    observer, frequency = fields(value, path, "observer", "frequency")
    return Setting(read_observer(observer, f"{path}.observer"), positive(frequency, f"{path}.frequency"))


def read_level(value: Any, path: str, loop: Loop) -> tuple[fmpq, Place]:
    """{level, phase, time, scales}: a level, and where the error of the second of a pair exceeds it."""
    level, *place = fields(value, path, "level", "phase", "time", "scales")
    found = response.read_place(dict(zip(("phase", "time", "scales"), place, strict=True)), path, loop)
    return positive(level, f"{path}.level"), found


@on_loop(
    "dualrate.errors-ordered",
    source="shao",
    parameters={"pairs": sized(several, sized(sequence, read_setting, 2), MOST_PAIRS)},
    witness={"places": Depends(lambda given: sized(sequence, sized(read_level, given.plant), len(given.pairs)))},
    holds=True,
)
def errors_ordered(plant: Loop, pairs: list[list[Setting]], places: list[tuple[fmpq, Place]]) -> Found:
    """With y_d = sin σt and the command <as printed|K x̂ + ȳ_d − K (y_d, y_d', y_d''), b ȳ_d = y_d'' + a₂ y_d' + a₃
    y_d>, held over T, the largest tracking errors in the steady state are ordered so: {ordered}.

    In each pair of (observer, σ) the first has the smaller largest error: below a level that the second exceeds.
    """
    for i, ((smaller, greater), (bound, found)) in enumerate(zip(pairs, places, strict=True)):
        moving, begun = response.steady_motion(plant, greater.observer, greater.frequency, found.scales)
        reached = response.error_at(moving, begun[found.phase], found.time)
        require(is_less(arb(bound), reached), f"the second error of pair {i} does not exceed the level there")
        moving, begun = response.steady_motion(plant, smaller.observer, smaller.frequency, found.scales)
        response.require_all_below(moving, begun, plant.T, bound)
    return Found(words={"ordered": ", ".join(f"{smaller} < {greater}" for smaller, greater in pairs)})


@on_loop(
    "dualrate.estimates-ordered",
    source="shao",
    parameters={"observer": read_observer, "than": read_observer, "frequency": positive},
    holds=True,
)
def estimates_ordered(plant: Loop, observer: Observer, than: Observer, frequency: fmpq) -> Found:
    """With y_d = sin({frequency} t) and the command <as printed|K x̂ + ȳ_d − K (y_d, y_d', y_d''), b ȳ_d = y_d'' + a₂
    y_d' + a₃ y_d>, held over T, the largest error of C x̂ at the fast instants in the steady state is {sizes}.

    The largest |y − C x̂| over the fast instants is smaller for one observer than for another.

    As for the tracking error, the supremum is the largest modulus of an amplitude, here over the M phases.
    """
    errors = [_estimation_error(plant, compared, frequency) for compared in (observer, than)]
    require(is_less(errors[0], errors[1]), f"the estimation errors are {errors[0].str(5)} and {errors[1].str(5)}")
    sizes = (
        f"{below(100 * error.lower().fmpq(), 4)} to {above(100 * error.upper().fmpq(), 4)} percent of the amplitude in "
        f"{compared.words}"
        for error, compared in zip(errors, (observer, than), strict=True)
    )
    return Found(words={"sizes": ", ".join(sizes)})


@on_loop(
    "dualrate.as-fast",
    parameters={"observer": read_observer, "than": read_observer},
    witness={"root": read_guess, "radius": positive},
    holds=False,
)
def as_fast(plant: Loop, observer: Observer, than: Observer, root: acb, radius: fmpq) -> None:
    """In its asymptotic rate {observer.words} does not decay as fast as {than.words}: its spectral radius over one slow
    period is at least {radius:down}, and larger than the other one, which is below {radius:up}.

    That one loop decays as fast as another is false: an eigenvalue lies outside a circle that holds the others.

    This compares asymptotic rates, those of almost every start; a given start need not excite the eigenvalue.
    """
    require_eigenvalue_beyond(plant, observer, root, radius)
    require_roots_within(monodromy(plant, than).charpoly(), radius, "the eigenvalues of the other loop")


def _estimation_error(loop: Loop, observer: Observer, sigma: fmpq) -> arb:
    response.require_position_form(loop)
    require_roots_within(monodromy(loop, observer).charpoly(), fmpq(1), "the eigenvalues of Φ")
    passage, C = response.steady_passage(loop, observer, acb(0, arb(sigma))), acb_mat(loop.C)
    return largest([abs((C * (x - used))[0, 0]) for x, used in zip(passage.states, passage.used, strict=True)])

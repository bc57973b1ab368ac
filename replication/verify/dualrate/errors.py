"""Statements on the errors of the dual-rate loops of Shao et al. in the steady state: of tracking, of the estimate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from flint import acb, acb_mat, arb, fmpq

from replication.verify.algebra.linear import above, below, largest
from replication.verify.dualrate import response
from replication.verify.dualrate.loop import INTERPOLATED, OBSERVER, Loop, Observer, held_over, monodromy, on_loop
from replication.verify.dualrate.response import Feedforward, Place
from replication.verify.kernel import Below, Within, decide
from replication.verify.predicate import NO_READING, Says
from replication.verify.reading import fields, one_of, positive, sequence, several, sized
from replication.verify.statement import Depends
from replication.verify.theorem import Found, require

MOST = 6
"""Frequencies of a theorem, those of Table I."""
INSTANTS = {"all": "at all times", "fast": "at the fast instants"}
READINGS: Mapping[tuple[str, str], str] = {
    ("printed", "all"): "literal",
    ("printed", "fast"): "fast-instants",
    ("corrected", "all"): "corrected-feedforward",
    ("corrected", "fast"): "corrected-feedforward-fast-instants",
}
"""Under which reading a command and instants are those of both columns of Table I."""
COLUMNS = (Observer.PMI, Observer.APO)


@dataclass(frozen=True)
class Error:
    """Bounds of a largest error in percent of the amplitude, and where the lower one is met."""

    lower: fmpq
    upper: fmpq
    place: Place


def read_error(value: Any, path: str, loop: Loop) -> Error:
    """{lower, upper, phase, time, scales}."""
    low, high, *place = fields(value, path, "lower", "upper", "phase", "time", "scales")
    found = response.read_place(dict(zip(("phase", "time", "scales"), place, strict=True)), path, loop)
    return Error(positive(low, f"{path}.lower"), positive(high, f"{path}.upper"), found)


def _readings(parameters: Mapping[str, Any]) -> tuple[str, ...]:
    observer, rest = parameters["observer"], (parameters["feedforward"], parameters["instants"])
    if rest == ("printed", "all") and observer not in (Observer.PMI, Observer.SRC):
        # Other readings of DRC-PMI leave DRC-APO as it is.
        other = ("literal", *INTERPOLATED.values()) if observer == Observer.APO else (INTERPOLATED.get(observer, ""),)
        return tuple(name for name in other if name) or (NO_READING,)
    return (READINGS[rest],) if observer in COLUMNS else (NO_READING,)


def _compared(parameters: Mapping[str, Any]) -> tuple[str, ...]:
    """The reading under which one of two observers is that of DRC-PMI, and the error is that at the fast instants."""
    found = [INTERPOLATED[name] for name in (parameters["observer"], parameters["than"]) if name in INTERPOLATED]
    return tuple(f"estimate-{name}" for name in found or ["literal"])


def _swapped(parameters: Mapping[str, Any]) -> dict[str, Any]:
    return {**parameters, "observer": parameters["than"], "than": parameters["observer"]}


def _setting(i: int, parameters: Mapping[str, Any]) -> dict[str, Any]:
    fixed = {name: value for name, value in parameters.items() if name != "frequencies"}
    return {**fixed, "frequency": parameters["frequencies"][min(i, len(parameters["frequencies"]) - 1)]}


def _bounds(i: int, known: Mapping[str, Any]) -> Found:
    error = known["errors"][min(i, len(known["errors"]) - 1)]
    return Found(lower=error.lower, upper=error.upper)


@on_loop(
    "dualrate.tracking-errors",
    source="shao",
    parameters={
        "observer": OBSERVER,
        "feedforward": sized(one_of, Feedforward),
        "instants": sized(one_of, INSTANTS),
        "frequencies": sized(several, positive, MOST),
    },
    witness={"errors": Depends(lambda given: sized(sequence, sized(read_error, given.plant), len(given.frequencies)))},
    says=tuple(
        Says(
            quantity="largest tracking error",
            setting=partial(_setting, i),
            readings=_readings,
            found=partial(_bounds, i),
        )
        for i in range(MOST)
    ),
)
def tracking_errors(
    plant: Loop,
    observer: Observer,
    feedforward: Feedforward,
    instants: str,
    frequencies: list[fmpq],
    errors: list[Error],
) -> Found:
    """With y_d = sin σt and the command <{command}|K x̂ + ȳ_d − K (y_d, y_d', y_d''), b ȳ_d = {input}>, held over
    {hold}, the largest tracking error of {observer.words}< of the plant {plant.name}|> {where} of the steady state is
    {sizes}.

    Bounds, in percent of the amplitude, of the largest |y − y_d| in the steady state.

    The error is Im(amplitude · e^{st}) with an amplitude of period M T. σ M T is rational and not zero, so no
    rational multiple of π: the phases at which an instant of the period is met are dense, and the supremum is the
    largest modulus of the amplitude.
    """
    for frequency, error in zip(frequencies, errors, strict=True):
        place = error.place
        moving, begun = response.steady_motion(plant, observer, frequency, place.scales, feedforward)
        reached = response.error_at(moving, begun[place.phase], place.time)
        decide(Below(error.lower / 100, reached, f"the error at the given time is not as large, σ = {frequency}"))
        if instants == "all":
            response.require_all_below(moving, begun, plant.T, error.upper / 100)
        else:
            require(place.time == 0, "the given time is not that of a fast instant")
            most = largest([abs((moving.row * start)[0, 0]) for start in begun])
            decide(Below(most, error.upper / 100, f"the largest error is above the bound, σ = {frequency}"))
    sizes = (
        f"{below(error.lower, 7)} to {above(error.upper, 7)} percent of the amplitude at σ = {frequency}"
        for frequency, error in zip(frequencies, errors, strict=True)
    )
    return Found(
        words={
            "command": feedforward.words,
            "hold": held_over(observer),
            "input": feedforward.formula,
            "where": INSTANTS[instants],
            "sizes": ", ".join(sizes),
        }
    )


@on_loop(
    "dualrate.estimates-ordered",
    source="shao",
    parameters={"observer": OBSERVER, "than": OBSERVER, "frequency": positive},
    holds=True,
    says=(
        Says(quantity="better estimate", readings=_compared),
        Says(quantity="better estimate", setting=_swapped, readings=_compared, found=lambda known: Found(holds=False)),
    ),
)
def estimates_ordered(plant: Loop, observer: Observer, than: Observer, frequency: fmpq) -> Found:
    """With y_d = sin({frequency} t) and the command <as printed|K x̂ + ȳ_d − K (y_d, y_d', y_d''), b ȳ_d = y_d'' + a₂
    y_d' + a₃ y_d>, held over {hold}, the largest error of C x̂ at the fast instants in the steady state< of the plant
    {plant.name}|> is {sizes}.

    The largest |y − C x̂| over the fast instants is smaller for one observer than for another.

    As for the tracking error, the supremum is the largest modulus of an amplitude, here over the M phases.
    """
    errors = [_estimation_error(plant, compared, frequency) for compared in (observer, than)]
    decide(Below(errors[0], errors[1], f"the estimation errors are {errors[0].str(5)} and {errors[1].str(5)}"))
    sizes = (
        f"{below(100 * error.lower().fmpq(), 4)} to {above(100 * error.upper().fmpq(), 4)} percent of the amplitude in "
        f"{compared.words}"
        for error, compared in zip(errors, (observer, than), strict=True)
    )
    return Found(words={"hold": held_over(observer, than), "sizes": ", ".join(sizes)})


def _estimation_error(loop: Loop, observer: Observer, sigma: fmpq) -> arb:
    response.require_position_form(loop)
    decide(Within(monodromy(loop, observer).charpoly(), "the eigenvalues of Φ"))
    passage, C = response.steady_passage(loop, observer, acb(0, arb(sigma))), acb_mat(loop.C)
    return largest([abs((C * (x - used))[0, 0]) for x, used in zip(passage.states, passage.used, strict=True)])

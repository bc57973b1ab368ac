"""Statements on the dual-rate loops of Shao et al.: stability by Φ, growth that references excite, tracking errors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from flint import acb, acb_mat, acb_poly, arb, fmpq

from replication.verify.algebra.decimals import above, below
from replication.verify.dualrate.loop import (
    APO,
    FAST,
    LOOP_FIELDS,
    PMI,
    REPAIRED,
    SRC,
    Loop,
    monodromy,
    precisely,
    read_loop,
    read_observer,
)
from replication.verify.dualrate.response import (
    error_at,
    read_place,
    require_all_below,
    require_position_form,
    steady_motion,
    steady_start,
)
from replication.verify.dualrate.roots import is_less, require_roots_within, root_near, without_root
from replication.verify.reading import fields, matrix, positive, rational, require_empty, sequence
from replication.verify.theorem import Theorem, require

MOST_STARTS = 100
NAMES = {
    SRC: "the single-rate loop",
    PMI: "the loop with model interpolation",
    APO: "the loop with the alternating predictive observer",
    REPAIRED: "the loop with the repaired predictor",
    FAST: "the loop with a sensor at every fast instant",
}


def radius(certificate: Mapping[str, Any]) -> Theorem:
    """Bounds of the largest modulus of the eigenvalues of Φ."""
    (chosen,) = fields(certificate["parameters"], "parameters", "observer")
    lower, upper = fields(certificate["bound"], "bound", "lower", "upper")
    (guess,) = fields(certificate["witness"], "witness", "root")
    loop, observer = read_loop(certificate["plant"]), read_observer(chosen)
    low, high = positive(lower, "bound.lower"), positive(upper, "bound.upper")
    require_eigenvalue_beyond(loop, observer, guess, low)
    require_roots_within(monodromy(loop, observer).charpoly(), high, "the eigenvalues of Φ")
    return Theorem(
        sentence=f"Over one slow period {NAMES[observer]} has the spectral radius {below(low)} to {above(high)}.",
        lower=low,
        upper=high,
    )


def stable(certificate: Mapping[str, Any]) -> Theorem:
    """All eigenvalues of Φ lie inside a circle of radius below one."""
    (chosen,) = fields(certificate["parameters"], "parameters", "observer")
    (size,) = fields(certificate["witness"], "witness", "radius")
    require_empty(certificate, "bound")
    loop, observer = read_loop(certificate["plant"]), read_observer(chosen)
    high = positive(size, "witness.radius")
    require(high < 1, f"witness.radius must be below one, got {size}")
    require_roots_within(monodromy(loop, observer).charpoly(), high, "the eigenvalues of Φ")
    return Theorem(
        sentence=f"Without a reference {NAMES[observer]} is stable: its spectral radius over one slow period is below "
        f"{above(high)}.",
        holds=True,
    )


def unstable(certificate: Mapping[str, Any]) -> Theorem:
    """Φ has an eigenvalue outside the unit circle."""
    (chosen,) = fields(certificate["parameters"], "parameters", "observer")
    guess, size = fields(certificate["witness"], "witness", "root", "radius")
    require_empty(certificate, "bound")
    loop, observer = read_loop(certificate["plant"]), read_observer(chosen)
    low = positive(size, "witness.radius")
    require(low > 1, f"witness.radius must be above one, got {size}")
    require_eigenvalue_beyond(loop, observer, guess, low)
    return Theorem(
        sentence=f"Without a reference {NAMES[observer]} is unstable: an eigenvalue over one slow period exceeds "
        f"{below(low)} in modulus.",
        holds=True,
    )


def no_bounded_error(certificate: Mapping[str, Any]) -> Theorem:
    """The tracking error is unbounded from x(0) = start with each of the given ζ(0).

    d(n) = y − (its steady state) at the slow instants is C Φⁿ (z(0) − Im X). With λ an eigenvalue outside the unit
    circle and ψ(z) = det(z I − Φ)/(z − λ), ψ of the shift makes c λⁿ of it, c = C ψ(Φ)(z(0) − Im X), which is no
    bounded sequence unless c = 0; then d is not bounded either, while y_d and the steady state are.
    """
    chosen, frequency, estimates = fields(certificate["parameters"], "parameters", "observer", "frequency", "estimates")
    (guess,) = fields(certificate["witness"], "witness", "root")
    require_empty(certificate, "bound")
    *plant, given = fields(certificate["plant"], "plant", *LOOP_FIELDS, "start")
    loop, observer = read_loop(dict(zip(LOOP_FIELDS, plant, strict=True))), read_observer(chosen)
    start = matrix(given, "plant.start", loop.order, 1)
    require_position_form(loop)
    n, sigma = loop.order, positive(frequency, "parameters.frequency")
    read = sequence(estimates, "parameters.estimates", lambda value, path: matrix(value, path, n, 1))
    require(len(read) > 0, "parameters.estimates is empty")
    require(len(read) <= MOST_STARTS, f"parameters.estimates has {len(read)} starts, more than {MOST_STARTS}")
    require(len({str(estimate) for estimate in read}) == len(read), "parameters.estimates names a start twice")
    root = root_near(acb_poly(monodromy(loop, observer).charpoly().coeffs()), _complex(guess))
    require(is_less(1, abs(root)), "the eigenvalue is not proved to lie outside the unit circle")
    for estimate in read:
        c = excitation(loop, observer, sigma, root, [*start.entries(), *estimate.entries()])
        require(not c.contains(0), "the eigenvalue is not proved to be excited and seen")
    return Theorem(
        sentence=f"With y_d = sin({sigma} t), {NAMES[observer]} has no bounded tracking error from this x(0) and "
        f"{len(read)} starts of ζ: they excite an eigenvalue of modulus {below(abs(root).lower().fmpq(), 3)} or more.",
        holds=True,
    )


def excitation(loop: Loop, observer: str, sigma: fmpq, root: acb, start: Sequence[fmpq]) -> acb:
    """c = C ψ(Φ)(z(0) − Im X) of `no_bounded_error`, z(0) = start."""
    Phi = acb_mat(monodromy(loop, observer))
    steady = steady_start(loop, observer, acb(0, arb(sigma)))
    offset = acb_mat([[arb(z) - X.imag] for z, X in zip(start, steady.entries(), strict=True)])
    reached = acb_mat([[*loop.C.entries(), *[0] * loop.order]])
    polynomial = without_root(acb_poly(Phi.charpoly().coeffs()), root)
    return (applied(polynomial, reached, Phi) * offset)[0, 0]


def tracking_error(certificate: Mapping[str, Any]) -> Theorem:
    """Bounds, in percent of the amplitude, of the largest |y − y_d| in the steady state over all times.

    The error is Im(amplitude · e^{st}) with an amplitude of period M T. σ M T is rational and not zero, so no
    rational multiple of π: the phases at which an instant of the period is met are dense, and the supremum is the
    largest modulus of the amplitude.
    """
    chosen, frequency = fields(certificate["parameters"], "parameters", "observer", "frequency")
    lower, upper = fields(certificate["bound"], "bound", "lower", "upper")
    phase, time, scales = fields(certificate["witness"], "witness", "phase", "time", "scales")
    loop, observer = read_loop(certificate["plant"]), read_observer(chosen)
    low, high = positive(lower, "bound.lower"), positive(upper, "bound.upper")
    sigma = positive(frequency, "parameters.frequency")
    place = read_place(loop, phase, time, scales, "witness")
    moving, begun = steady_motion(loop, observer, sigma, place.scales)
    reached = error_at(moving, begun[place.phase], place.time)
    require(is_less(arb(low / 100), reached), "the error at the given time is not as large")
    require_all_below(moving, begun, loop.T, high / 100)
    return Theorem(
        sentence=f"With y_d = sin({sigma} t) and the command as printed, held over T, the largest tracking error of "
        f"{NAMES[observer]} in the steady state is {below(low, 7)} to {above(high, 7)} percent of the amplitude.",
        lower=low,
        upper=high,
    )


def require_eigenvalue_beyond(loop: Loop, observer: str, guess: Any, low: fmpq) -> None:
    """Refuse unless Φ has an eigenvalue of modulus `low` or more near the guess of a witness."""
    root = root_near(acb_poly(monodromy(loop, observer).charpoly().coeffs()), _complex(guess))
    require(is_less(arb(low), abs(root)), f"the eigenvalue is not proved to be at least {below(low)} in modulus")


def _complex(value: Any) -> acb:
    real, imaginary = sequence(value, "witness.root", rational, 2)
    return acb(arb(real), arb(imaginary))


def applied(polynomial: acb_poly, row: acb_mat, matrix: acb_mat) -> acb_mat:
    """row · polynomial(matrix), by Horner's scheme."""
    total = row * acb(0)
    for coefficient in polynomial.coeffs()[::-1]:
        total = total * matrix + row * coefficient
    return total


STATEMENTS: Mapping[str, Callable[[Mapping[str, Any]], Theorem]] = {
    "dualrate.radius": precisely(radius),
    "dualrate.stable": precisely(stable),
    "dualrate.unstable": precisely(unstable),
    "dualrate.no-bounded-error": precisely(no_bounded_error),
    "dualrate.tracking-error": precisely(tracking_error),
}

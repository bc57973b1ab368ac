"""Statements on the dual-rate loops of Shao et al.: radius and stability by Φ, growth that a reference excites."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from flint import acb, acb_mat, acb_poly, arb, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.linear import below, complex_of, root_near, without_root
from replication.verify.dualrate.loop import (
    ALTERNATIVES,
    OBSERVER,
    Loop,
    Observer,
    held_over,
    monodromy,
    on_loop,
    on_paper,
    read_loop,
)
from replication.verify.dualrate.response import require_position_form, steady_start
from replication.verify.kernel import decide, equal, hurwitz, less, within
from replication.verify.predicate import NO_READING, Says
from replication.verify.reading import as_written, integer, matrix, one_of, positive, rational, sequence, several, sized
from replication.verify.statement import BOTH, Depends, Table, statement
from replication.verify.theorem import Found, require

RADIUS = "spectral radius over a slow period"


def _readings(parameters: Mapping[str, Any]) -> tuple[str, ...]:
    """Readings of the manuscript under which it speaks of this loop, or compares it with others by that number."""
    observer = parameters["observer"]
    return (ALTERNATIVES[observer],) if observer in ALTERNATIVES else (NO_READING, "literal", "slowest-mode")


STARTS: Mapping[str, Callable[[Loop], list[fmpq]]] = {
    "zero": lambda loop: [fmpq(0)] * loop.order,
    "output": lambda loop: [(loop.C * loop.start)[0, 0], *[fmpq(0)] * (loop.order - 1)],
    "true": lambda loop: loop.start.entries(),
}
"""Where the observer starts: at zero, at the measured position, at the state of the plant."""


def read_guess(value: Any, path: str) -> acb:
    """A complex number from the pair of its rationals."""
    return complex_of(sequence(value, path, rational, 2))


@on_loop(
    "dualrate.radius",
    parameters={"observer": OBSERVER},
    bound=BOTH,
    witness={"root": read_guess},
    says=Says(quantity=RADIUS, readings=_readings),
)
def radius(plant: Loop, observer: Observer, lower: fmpq, upper: fmpq, root: acb) -> None:
    """Over one slow period {observer.words}< of the plant {plant.name}|> ({plant.data}, T = {plant.T} s) has the
    spectral radius {lower:down} to {upper:up}.
    """
    modulus = abs(eigenvalue_near(plant, observer, root))
    decide(less(lower, modulus, f"the eigenvalue is not proved to be at least {below(lower)} in modulus"))
    decide(within(monodromy(plant, observer), "the eigenvalues of Φ", upper))


@on_loop(
    "dualrate.stable",
    parameters={"observer": OBSERVER},
    witness={"radius": positive},
    holds=True,
    says=Says(quantity=RADIUS, readings=_readings, found=lambda known: Found(upper=known["radius"])),
)
def stable(plant: Loop, observer: Observer, radius: fmpq) -> None:
    """Without a reference {observer.words}< of the plant {plant.name}|> ({plant.data}, T = {plant.T} s) is stable: its
    spectral radius over one slow period is below {radius:up}.
    """
    decide(less(radius, 1, f"witness.radius must be below one, got {radius}"))
    decide(within(monodromy(plant, observer), "the eigenvalues of Φ", radius))


def read_starts(value: Any, path: str, loop: Loop) -> dict[str, list[fmpq]]:
    """ζ(0) by the names of `STARTS`, each once."""
    starts = {name: STARTS[name](loop) for name in several(value, path, sized(one_of, STARTS))}
    require(len(starts) == len(value), f"{path} must name each once")
    return starts


@on_paper(
    "dualrate.no-bounded-error",
    plant=sized(read_loop, "start"),
    parameters={
        "observer": OBSERVER,
        "frequency": positive,
        "starts": Depends(lambda values: sized(read_starts, values.plant)),
    },
    witness={"root": read_guess},
    holds=True,
    says=Says(
        quantity="no bounded tracking error",
        setting=lambda parameters: {name: parameters[name] for name in ("observer", "frequency")},
        readings=lambda parameters: tuple(f"start-{name}" for name in parameters["starts"]),
    ),
)
def no_bounded_error(
    plant: Loop, observer: Observer, frequency: fmpq, starts: Mapping[str, list[fmpq]], root: acb
) -> Found:
    """With y_d = sin({frequency} t) and the command <as printed|K x̂ + ȳ_d − K (y_d, y_d', y_d''), b ȳ_d = y_d'' + a₂
    y_d' + a₃ y_d>, held over {hold}, {observer.words}< of the plant {plant.name}|> has no bounded tracking error from
    this x(0) and ζ(0) = {listed}: each excites an eigenvalue of modulus {size:down 3} or more.

    d(n) = y − (its steady state) at the slow instants is C Φⁿ (z(0) − Im X). With λ an eigenvalue outside the unit
    circle and ψ(z) = det(z I − Φ)/(z − λ), ψ of the shift makes c λⁿ of it, c = C ψ(Φ)(z(0) − Im X), which is no
    bounded sequence unless c = 0; then d is not bounded either, while y_d and the steady state are.
    """
    require_position_form(plant)
    root = eigenvalue_near(plant, observer, root)
    decide(less(1, abs(root), "the eigenvalue is not proved to lie outside the unit circle"))
    for name, estimate in starts.items():
        c = excitation(plant, observer, frequency, root, [*plant.start.entries(), *estimate])
        require(not c.contains(0), f"the eigenvalue is not proved to be excited and seen from {name}")
    listed = ", ".join(f"({', '.join(map(str, estimate))})" for estimate in starts.values())
    return Found(words={"hold": held_over(observer), "listed": listed, "size": abs(root)})


def excitation(loop: Loop, observer: Observer, sigma: fmpq, root: acb, start: Sequence[fmpq]) -> acb:
    """c = C ψ(Φ)(z(0) − Im X) of `no_bounded_error`, z(0) = start."""
    Phi = acb_mat(monodromy(loop, observer))
    steady = steady_start(loop, observer, acb(0, arb(sigma)))
    offset = acb_mat([[arb(z) - X.imag] for z, X in zip(start, steady, strict=True)])
    reached = acb_mat([[*loop.C.entries(), *[0] * loop.order]])
    polynomial = without_root(acb_poly(Phi.charpoly().coeffs()), root)
    return (applied(polynomial, reached, Phi) * offset)[0, 0]


def eigenvalue_near(loop: Loop, observer: Observer, guess: acb) -> acb:
    """A ball that holds an eigenvalue of Φ."""
    return root_near(acb_poly(monodromy(loop, observer).charpoly().coeffs()), guess)


def applied(polynomial: acb_poly, row: acb_mat, matrix: acb_mat) -> acb_mat:
    """row · polynomial(matrix), by Horner's scheme."""
    total = row * acb(0)
    for coefficient in polynomial.coeffs()[::-1]:
        total = total * matrix + row * coefficient
    return total


# The motor of Shao et al., Sec. V, exactly: torque constant, coordinates, Hurwitz matrices, feedforward.


LARGEST_ORDER = 20
"""Of a derivative in the feedforward."""
PARAMETERS = ("R", "Psi", "Lq", "p", "Bw", "J", "KT")
MOTOR: Table = {
    "name": as_written,
    **dict.fromkeys(PARAMETERS, positive),
    **{"A": sized(matrix, 3, 3), "B": sized(matrix, 3, 1), "C": sized(matrix, 1, 3)},
}
"""The parameters of the motor by their symbols, and its matrices."""


@statement(
    "dualrate.torque-constant",
    plant=MOTOR,
    bound=None,
    says=Says(quantity="torque constant", readings=("surface-magnets",)),
)
def torque_constant(p: fmpq, Psi: fmpq, **_: Any) -> Found:
    """1.5 p Ψ_f is {value} N m/A."""
    return _computed(fmpq(3, 2) * p * Psi)


@on_loop("dualrate.slow-period", bound=None, says="slow period")
def slow_period(plant: Loop) -> Found:
    """The sensor's period M T is {value} s."""
    return _computed(plant.M * plant.T)


@statement("dualrate.coordinates", source="shao", plant=MOTOR, holds=True, says="coordinates of the motor")
def coordinates(A: fmpq_mat, B: fmpq_mat, C: fmpq_mat, **motor: Any) -> None:
    """With x = (θ, ω, ω') the equations (23) with these parameters are those of A, B and C, exactly.

    (23) with z = (i_q, ω, θ), z' = N z + e u_q, and x = S z = (θ, ω, ω'): S N = A S, S e = B and C S z = θ.

    S is invertible, its determinant being −K_T/J.
    """
    R, Psi, Lq, p, Bw, J, KT = (motor[name] for name in PARAMETERS)
    N = fmpq_mat([[-R / Lq, -p * Psi / Lq, 0], [KT / J, -Bw / J, 0], [0, 1, 0]])
    S = fmpq_mat([[0, 0, 1], [0, 1, 0], [KT / J, -Bw / J, 0]])
    decide(equal(S * N, A * S, "A is not that of (23) in these coordinates"))
    decide(equal(S * fmpq_mat([[1 / Lq], [0], [0]]), B, "B is not that of (23) in these coordinates"))
    decide(equal((C * S).entries(), [0, 0, 1], "C does not read the position"))


@on_loop("dualrate.hurwitz", parameters={"matrix": sized(one_of, ("feedback", "observer"))}, holds=True, says="Hurwitz")
def matrix_is_hurwitz(plant: Loop, matrix: str) -> Found:
    """<For the plant {plant.name}, {name}|{name}> is Hurwitz: the Hurwitz determinants of its characteristic polynomial
    are positive.
    """
    feedback = matrix == "feedback"
    name, M = ("A + B K", plant.A + plant.B * plant.K) if feedback else ("A − L C", plant.guided)
    decide(hurwitz(M, name))
    return Found(words={"name": name})


@on_loop(
    "dualrate.feedforward",
    parameters={"orders": sized(sequence, sized(integer, 0, LARGEST_ORDER), 3)},
    says=Says(quantity="feedforward inverts the motor", readings=("inverse-feedforward",)),
)
def feedforward(plant: Loop, orders: list[int]) -> Found:
    """The feedforward with derivatives of orders {orders} is {negation}the inverse of the plant, as an identity of
    rational functions.

    Whether (y^(i) + a₂ y^(j) + a₃ y^(k))/b, (i, j, k) = orders, is the input with the output y of the plant.

    The transfer function is C adj(sI − A) B/det(sI − A); a₂, a₃ and b are entries of A and B.
    """
    require_position_form(plant)
    factors = (fmpq(1), -plant.A[2, 1], -plant.A[2, 2])
    terms = (fmpq_poly([*[0] * order, factor]) for order, factor in zip(orders, factors, strict=True))
    numerator = sum(terms, fmpq_poly([0]))
    inverse = numerator * transfer_numerator(plant) == plant.B[2, 0] * plant.A.charpoly()
    return Found(words={"negation": "" if inverse else "not "}, holds=inverse)


def transfer_numerator(loop: Loop) -> fmpq_poly:
    """C adj(sI − A) B with adj(sI − A) = Σ_k A^k Σ_{j > k} c_j s^{j−1−k}, c the characteristic polynomial of A."""
    coefficients, total, power = loop.A.charpoly().coeffs(), fmpq_poly([0]), loop.B
    for k in range(loop.order):
        total += fmpq_poly(coefficients[k + 1 :]) * (loop.C * power)[0, 0]
        power = loop.A * power
    return total


def _computed(value: fmpq) -> Found:
    return Found(words={"value": value}, lower=value, upper=value)

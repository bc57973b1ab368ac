"""The identities behind Theorems 1 and 3 of Peet and Gu, in letters: for any number of states, signals and delays.

A letter stands for a matrix, for a function at a point, or for a value of the history e: e_i(s) in an integral over
[-tau_i, 0], e_j(t) in a second one, e_0 = e_i(0) and e_i(-tau_i). Derivatives of the history are integrated by parts as
they come. A number is its own transpose, and the names s and t of a double integral may be exchanged: `canonical`.

Both sides are sums over the delays i and over pairs (i, j). Without delays, with one and with two they are equal; so
are then the terms without index, those of each i, and those of each pair, and both sides with any number of delays.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, identity, zeros
from replication.verify.algebra.symbolic import NONE, Letter, Words, letter, number, one
from replication.verify.kernel import decide, definite, identical, less
from replication.verify.predicate import Says
from replication.verify.reading import one_of, sequence, sized, text
from replication.verify.statement import statement
from replication.verify.theorem import Found, require

MOST = 2
"""Delays with which both sides are compared."""
GAMMA = number("gamma")
TAU = number("tau")
"""The level, and tau_K."""
MISPRINTS = {
    "d-sign": "the blocks of D with S_i(-tau_i)",
    "f-sign": "the derivative of S_i in F_i",
    "e-transposes": "the transposes in E_i",
    "eq10-factor": "the second row of (10)",
    "theorem-1-sign": "the square of C_1 e, which is right for v = C_1 e/gamma alone",
}


def a(name: str) -> Words:
    """The letter of this name; P and the values of S_i are symmetric."""
    return letter(name, symmetric=name[0] in "PS")


def canonical(form: Words) -> Words:
    """The same number, with one of each word and its transpose."""
    terms = (Words({(n, min(word, mirrored(word))): c}, form.symmetric) for (n, word), c in form.terms.items())
    return sum(terms, NONE)


def mirrored(word: tuple[Letter, ...]) -> tuple[Letter, ...]:
    """The transpose of a word; in a double integral s and t change places, and R_ij(t, s)' is R_ji(s, t)."""
    twice = any(name.endswith("(t)") for name, _ in word)
    return tuple(_turned(name, flag, twice) for name, flag in reversed(word))


def _turned(name: str, flag: bool, twice: bool) -> Letter:
    if twice and name[0] == "R":
        i, j, slope = name[1], name[2], {"s": "t", "t": "s"}[name[4]]
        return f"R{j}{i}_{slope}(s,t)", flag
    if twice and name[0] == "e":
        name = name.replace("(s)", "(.)").replace("(t)", "(s)").replace("(.)", "(t)")
    return name, flag if name[0] in "PS" else not flag


def drift(delays: Sequence[int]) -> Words:
    """A e - B w in the present."""
    return sum((a(f"A{i}") * a(f"e{i}(-tau)") for i in delays), a("A0") * a("e0") - a("B") * a("w"))


def dissipation(delays: Sequence[int], factor: Words) -> Words:
    """2<e, (P A + Z C_2) e - P B w> - gamma |w|^2 from (8) and (10), the second row of (10) times `factor`."""
    e0, w, C2, rate = a("e0"), a("w"), a("C_2"), drift(delays)
    form = e0.T * (a("P") * rate + a("Z0") * C2 * e0) * TAU * 2 - w.T * w * GAMMA
    for i in delays:
        e, late = a(f"e{i}(s)"), a(f"e{i}(-tau)")
        pulled = a(f"Q{i}(0)") * e0 - a(f"Q{i}(-tau)") * late - a(f"Q{i}_s(s)") * e
        form += e0.T * (pulled + a(f"Z3{i}(s)") * C2 * e + a(f"Z2{i}") * C2 * late) * TAU * 2
        form += e.T * a(f"Q{i}(s)").T * rate * TAU * 2
        form += (e0.T * a(f"S{i}(0)") * e0 - late.T * a(f"S{i}(-tau)") * late - e.T * a(f"S{i}_s(s)") * e) * TAU
        form += e.T * (a(f"Z4{i}(s)") * C2 * e0 + a(f"Z6{i}(s)") * C2 * e) * factor * 2
        for j in delays:
            other, late = a(f"e{j}(t)"), a(f"e{j}(-tau)")
            pulled = a(f"R{i}{j}(s,0)") * e0 - a(f"R{i}{j}(s,-tau)") * late - a(f"R{i}{j}_t(s,t)") * other
            injected = a(f"Z5{i}{j}(s)") * C2 * late + a(f"Z7{i}{j}(s,t)") * C2 * other
            form += e.T * (pulled + injected * factor) * 2
    return form


def output(delays: Sequence[int]) -> Words:
    """C_1 e."""
    return sum((a(f"C{i}") * a(f"e{i}(-tau)") for i in delays), a("C0") * a("e0"))


def quadratic_form(delays: Sequence[int], misprint: str) -> Words:
    """<h, P_(D, E, F, G) h> of Theorem 3; `misprint` leaves one group of its terms as printed."""
    e0, w, v, C2, B, P = (a(name) for name in ("e0", "w", "v", "C_2", "B", "P"))
    form = (w.T * w + v.T * v) * GAMMA * -1 + v.T * output(delays) * 2 - w.T * B.T * P * e0 * TAU * 2
    form += e0.T * (P * a("A0") + a("Z0") * C2) * e0 * TAU * 2
    for i in delays:
        e, late, Z6 = a(f"e{i}(s)"), a(f"e{i}(-tau)"), a(f"Z6{i}(s)") * C2
        form += e0.T * (a(f"Q{i}(0)") * 2 + a(f"S{i}(0)")) * e0 * TAU
        form += e0.T * (P * a(f"A{i}") - a(f"Q{i}(-tau)") + a(f"Z2{i}") * C2) * late * TAU * 2
        form += late.T * a(f"S{i}(-tau)") * late * TAU * (1 if misprint == "d-sign" else -1)
        form += (e0.T * _phi_0(i, delays, misprint) - w.T * B.T * a(f"Q{i}(s)") * TAU) * e * 2
        F = a(f"S{i}_s(s)") * (1 if misprint == "f-sign" else -1) + Z6 + Z6.T
        form += e.T * F * e * TAU
        for j in delays:
            form += a(f"e{j}(-tau)").T * _phi(i, j, misprint) * e * 2
            Z7 = a(f"Z7{i}{j}(s,t)") * C2 + C2.T * a(f"Z7{j}{i}(s,t)").T
            form += e.T * (Z7 * TAU - a(f"R{i}{j}_s(s,t)") - a(f"R{i}{j}_t(s,t)")) * a(f"e{j}(t)")
    return form


def _phi_0(i: int, delays: Sequence[int], misprint: str) -> Words:
    """tau_K times the block of e_0 against e_i."""
    local = (a("A0").T * a(f"Q{i}(s)") - a(f"Q{i}_s(s)")) * TAU
    block = sum((a(f"R{i}{k}(s,0)").T for k in delays), local)
    Z3, Z4 = a(f"Z3{i}(s)") * a("C_2"), a(f"Z4{i}(s)") * a("C_2")
    return (block + (Z4 + Z3.T) * TAU).T if misprint == "e-transposes" else block + (Z3 + Z4.T) * TAU


def _phi(i: int, j: int, misprint: str) -> Words:
    """tau_K times the block of e_j(-tau_j) against e_i."""
    block = a(f"A{j}").T * a(f"Q{i}(s)") * TAU - a(f"R{i}{j}(s,-tau)").T
    Z5 = a(f"Z5{i}{j}(s)") * a("C_2") * TAU
    return (block + Z5).T if misprint == "e-transposes" else block + Z5.T


def residual(delays: Sequence[int], misprint: str) -> Words:
    """Left side less right side of the identity, corrected but for one misprint, or none.

    As printed, `theorem-1-sign` has |z|^2/gamma for the supply 2 v'z - gamma |v|^2, beside a form that holds v; its
    residual is the one times gamma.
    """
    z, v = output(delays), a("v")
    left = dissipation(delays, one() if misprint == "eq10-factor" else TAU)
    right = quadratic_form(delays, misprint)
    if misprint == "theorem-1-sign":
        return canonical((left - right) * GAMMA + z.T * z)
    return canonical(left + v.T * z * 2 - v.T * v * GAMMA - right)


def require_identity(misprints: Sequence[str]) -> None:
    """Refuse unless the corrected identity holds, and none with one of the misprints does."""
    for count in range(MOST + 1):
        decide(identical(residual(range(1, count + 1), ""), NONE, f"the corrected statement with {count} delays"))
    for misprint in misprints:
        fails = not residual(range(1, MOST + 1), misprint).is_zero()
        require(fails, f"the identity holds with {MISPRINTS[misprint]} as printed")


@statement(
    "delay.dissipation-identity",
    source="peet2019",
    parameters={"misprints": sized(sequence, text)},
    holds=True,
    says=Says(quantity="dissipation identity", setting={}),
)
def dissipation_identity(misprints: list[str]) -> Found:
    """The dissipation is the quadratic form of Theorem 3, with the transposes in D and the name Z_1 in T_00 corrected
    and G_2ij as in the theorem, not its proof, for any number of states, signals and delays, every v and all
    differentiable self-adjoint storages, if these are corrected too; with any one of them as printed it is not:
    {corrected}.
    """
    require(set(misprints) == MISPRINTS.keys(), f"misprints must be all of {', '.join(MISPRINTS)}")
    require(len(set(misprints)) == len(misprints), "parameters.misprints names one twice")
    require_identity(misprints)
    return Found(words={"corrected": "; ".join(MISPRINTS[misprint] for misprint in misprints)})


ALONG = {"along": "solutions with d<e, P e>/dt = 2<e, P e'>"}
"""What Theorem 1 needs of its solutions; those of matrices, to which LMI (3) belongs, have it."""


@statement(
    "delay.observer-bound",
    source="peet2019",
    holds=True,
    says=(
        Says(quantity="bound (7)", setting={"by": "LMI (3)"}),
        Says(quantity="bound (7)", setting=ALONG),
        Says(quantity="error vanishes with w", setting=ALONG),
    ),
)
def observer_bound() -> None:
    """Where the inequality of Theorem 1, or LMI (3), holds with a coercive P = P*, the observer with L = P^-1 Z obeys
    (7), and its error tends to zero with w, along solutions with d<e, P e>/dt = 2<e, P e'>, for any number of states
    and signals; with a coercive P that is not self-adjoint the inequality does not suffice, with two states.

    With v = z/gamma the inequality is V' + |z|^2/gamma - gamma |w|^2 <= -eps |e|^2 along (6) for V = <e, P e>. Summed
    from e(0) = 0 it is (7), as V >= 0. With c the norm of P it gives V' <= gamma |w|^2 - (eps/c) V, so that V, and with
    it |e|, tends to zero with w. A strict LMI (3) is the inequality with some eps > 0. In the example with P != P* the
    error equation is e' = A e - w with z = e and an unstable A: a pulse w makes e grow without bound.
    """
    P, L, A, B, C1, C2, D, e, w, v = (a(name) for name in ("P", "L", "A", "B", "C1", "C_2", "D", "e", "w", "v"))
    Z, z = P * L, C1 * e
    along = e.T * P * ((A + L * C2) * e - (B + L * D) * w) * 2
    form = e.T * (P * A + Z * C2) * e * 2 - e.T * (P * B + Z * D) * w * 2
    decide(identical(canonical(along - form), NONE, "the rate of V as the form"))
    square = (z - v * GAMMA).T * (z - v * GAMMA)
    supply = (v.T * z * 2 - v.T * v * GAMMA) * GAMMA
    decide(identical(canonical(supply - z.T * z + square), NONE, "with v = z/gamma the supply as |z|^2/gamma"))
    require_self_adjoint(fmpq(1))


def require_self_adjoint(turn: fmpq) -> None:
    """Refuse unless the inequality of Theorem 1 holds for P = I + turn J, coercive, L = 0 and an error that grows.

    J is the rotation by a right angle, A = P^-1 (2 J - I), B = C_1 = I, gamma = 2. The trace of A, the sum of the real
    parts of its eigenvalues, is positive: one of them has a positive real part.
    """
    unit, J = identity(2), fmpq_mat([[0, 1], [-1, 0]])
    P = unit + J * turn
    A = P.inv() * (J * 2 - unit)
    rate = P * A + (P * A).transpose()
    decide(definite(P + P.transpose(), "P + P'"))
    form = block([[rate, -P, unit], [-P.transpose(), unit * -2, zeros(2, 2)], [unit, zeros(2, 2), unit * -2]])
    decide(definite(form * -1, "the inequality of Theorem 1"))
    decide(less(0, A[0, 0] + A[1, 1], "the error of the example with P that is not self-adjoint may vanish"))


# Theorem 4 and Lemma 5 of Peet and Gu in letters: the inverse of an operator (8), and the gains that it gives.
#
# The formulas use the histories through products at one point and through integrals, which are linear. So a letter
# stands for every matrix, for every function at one point s, and for every integral: K for that of Z V Z' with V =
# S^-1, `seen` for that of Z phi, where phi = V chi is the history; I_3, I_6 and I_7 for those of Z_3 y, Z V Z' W_6 y
# and W_7 Z y. The blocks of all delays stand in one matrix, as in H, K and Gamma = tau G, where tau is tau_K. What
# holds in letters holds for any number of states, measurements and delays.


SYMMETRIC = ("P", "Pi", "K", "G", "V")
HALF = fmpq(1, 2)
EXAMPLE = {"tau": 2, "P": 2, "H": HALF, "K": 2, "G": 1, "Z": 1, "V": 1, "x": 1, "seen": 1, "chi": HALF}
"""A coercive operator with one state and one delay, of 2, where Z = S = 1; a history, and in `GIVEN` an injection."""
ONES = ("Z_0", "Z_2", "W_4", "W_5", "W_6", "y", "end", "y_s")
GIVEN = {**dict.fromkeys(ONES, 1), "I_3": 2, "I_6": 2, "I_7": 2}


def named(names: str) -> tuple[Words, ...]:
    """The letters of these names."""
    return tuple(letter(name, symmetric=name in SYMMETRIC) for name in names.split())


def word(names: str) -> tuple[Letter, ...]:
    """A word in them, an apostrophe behind what is transposed."""
    return tuple((name.rstrip("'"), name.endswith("'")) for name in names.split())


def rules() -> dict[tuple[Letter, ...], Words]:
    """What follows from Pi = P^-1, W = (K H' Pi H - I - K G)^-1 and X = (I + K G)^-1; P, K and G are symmetric."""
    W, X, K, G = named("W X K G")
    rewrites = {word("P Pi"): one(), word("Pi P"): one()}
    rewrites |= {word("W K H' Pi H"): one() + W + W * K * G, word("W' H' Pi H K"): one() + W.T + W.T * G * K}
    rewrites |= {word("X K G"): one() - X, word("G K X'"): one() - X.T, word("X K"): K * X.T}
    return rewrites


def inverse(*, printed: bool) -> tuple[Words, Words, Words]:
    """P_hat, H_hat and Gamma_hat of Theorem 4, with Gamma = tau G as printed, or with G."""
    Pi, H, K, G, W, X = named("Pi H K G W X")
    used = G * TAU if printed else G
    H_hat = Pi * H * W
    return (one() - H_hat * K * H.T) * Pi, H_hat, (H_hat.T * H + used) * X * -1


def inverse_residuals(*, printed: bool) -> list[Words]:
    """Both rows of the inverse of Theorem 4 applied to the image of (x, phi), minus (x, phi), times tau.

    Printed: Gamma stands in the formulas and S^-1/tau in the inverse; corrected: G, and S^-1/tau^2.
    """
    P, H, K, G, Z, V, x, seen, chi = named("P H K G Z V x seen chi")
    P_hat, H_hat, G_hat = inverse(printed=printed)
    head = P * x + H * seen
    tail = (Z.T * H.T * x + chi + Z.T * G * seen) * TAU
    pulled = (K * H.T * x + seen + K * G * seen) * TAU
    local = tail * TAU if printed else tail
    inside = Z.T * (H_hat.T * head * TAU + G_hat * pulled)
    return [P_hat * head * TAU + H_hat * pulled - x * TAU, V * (inside + local - chi * TAU)]


def gains(P: Words, H: Words, G: Words) -> dict[str, Words]:
    """The gains of Lemma 5 from P_hat, H_hat and Gamma_hat; of L_3 and L_7 the integrals with y."""
    K, Z, V, Z_0, Z_2, I_3, W_4, W_5, W_6, I_6, I_7 = named("K Z V Z_0 Z_2 I_3 W_4 W_5 W_6 I_6 I_7")
    formulas = {"L_0": P * Z_0 + H * K * W_4, "L_2": P * Z_2 + H * K * W_5, "L_3": P * I_3 + H * I_6 + H * K * I_7}
    formulas |= {"L_4": H.T * Z_0 + W_4 + G * K * W_4, "L_5": H.T * Z_2 + W_5 + G * K * W_5, "L_6": W_6}
    formulas["L_7"] = H.T * I_3 + I_7 + G * I_6 + G * K * I_7
    return {name: V * Z.T * gain if name > "L_3" else gain for name, gain in formulas.items()}


def gain_residuals(*, printed: bool) -> list[Words]:
    """Both rows of the inverse {P, Q, S, R} of Theorem 4 (any P_hat, H_hat, Gamma_hat) applied to (10), minus (9) with
    the gains of Lemma 5, times tau. Printed: (10) and the inverse as printed; corrected: both as in the errata.
    """
    P, H, G, K, Z, V = named("P H G K Z V")
    Z_0, Z_2, I_3, W_4, W_5, W_6, I_6, I_7, y, end, y_s = named("Z_0 Z_2 I_3 W_4 W_5 W_6 I_6 I_7 y end y_s")
    head, injected = Z_0 * y + Z_2 * end + I_3, W_4 * y + W_5 * end + I_7
    row, pulled = Z.T * (injected + W_6 * y_s), K * injected + I_6
    pulled = pulled if printed else pulled * TAU
    L = gains(P, H, G)
    point = P * head * TAU + H * pulled - (L["L_0"] * y + L["L_2"] * end + L["L_3"]) * TAU
    history = V * (Z.T * (H.T * head * TAU + G * pulled) + row * TAU)
    return [point, history - (L["L_4"] * y + L["L_5"] * end + L["L_6"] * y_s + L["L_7"]) * TAU]


PARTS = {
    "theorem-4": (
        "Theorem 4, with Gamma/tau_K and S^-1/tau_K^2, inverts any coercive P = P* of the form (8) with Q_i = H_i Z "
        "and R_ij = Z' Gamma_ij Z",
        inverse_residuals,
    ),
    "lemma-5": ("Lemma 5 in (9) gives the inverse of Theorem 4 applied to (10), both as corrected", gain_residuals),
}


def example() -> dict[str, fmpq]:
    """All letters of the example as numbers, with the inverses as printed."""
    letters: dict[str, Any] = {**EXAMPLE, **GIVEN}
    at = {name: fmpq(value) for name, value in letters.items()}
    seen = at["K"] * at["G"] * at["tau"]
    at |= {"Pi": 1 / at["P"], "X": 1 / (1 + seen)}
    return at | {"W": 1 / (at["K"] * at["H"] ** 2 * at["Pi"] - 1 - seen)}


def require_correction(corrected: Sequence[Words], printed: Sequence[Words], at: Mapping[str, fmpq], what: str) -> None:
    """Refuse unless all residuals of the corrected formulas vanish, and not all printed ones in an example."""
    for i, residual in enumerate(corrected):
        decide(identical(residual.reduced(rules()), NONE, f"row {i} of {what} as corrected"))
    require(any(residual.at(at) != 0 for residual in printed), f"{what} holds as printed")


@statement(
    "delay.operator-identity",
    source="peet2019",
    parameters={"part": sized(one_of, PARTS)},
    holds=True,
    says="operator identity",
)
def operator_identity(part: str) -> Found:
    """{words}, for any number of states, measurements and delays; as printed it does not, with one state and a delay
    of {delay}.
    """
    words, residuals = PARTS[part]
    require_correction(residuals(printed=False), residuals(printed=True), example(), part)
    return Found(words={"words": words, "delay": EXAMPLE["tau"]})


@statement("delay.present-only", source="peet2019", holds=True, says="correction of the present state only")
def present_only() -> None:
    """Where Q_i and Z_3i to Z_7ij are zero, all gains of Lemma 5 are zero but L_0 = P^-1 Z_0 and L_2i = P^-1 Z_2i."""
    zero = ("H", "I_3", "W_4", "W_5", "W_6", "I_6", "I_7")
    formulas = {name: gain.without(*zero) for name, gain in gains(*inverse(printed=False)).items()}
    Pi, Z_0, Z_2 = named("Pi Z_0 Z_2")
    for name, expected in {"L_0": Pi * Z_0, "L_2": Pi * Z_2}.items():
        decide(identical(formulas.pop(name), expected, f"the formula of {name}"))
    for name, gain in formulas.items():
        decide(identical(gain, NONE, f"that {name} is zero"))

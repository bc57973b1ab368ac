"""Theorem 4 and Lemma 5 of Peet and Gu in letters: the inverse of an operator (8), and the gains that it gives.

The formulas use the histories through products at one point and through integrals, which are linear. So a letter stands
for every matrix, for every function at one point s, and for every integral: K for that of Z V Z' with V = S^-1, `seen`
for that of Z phi, where phi = V chi is the history; I_3, I_6 and I_7 for those of Z_3 y, Z V Z' W_6 y and W_7 Z y. The
blocks of all delays stand in one matrix, as in H, K and Gamma = tau G, where tau is tau_K. What holds in letters holds
for any number of states, measurements and delays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flint import fmpq

from replication.verify.algebra.words import NONE, Letter, Words, letter, number, one
from replication.verify.kernel import Identity, decide
from replication.verify.reading import text
from replication.verify.statement import statement
from replication.verify.theorem import Found, require

TAU = number("tau")
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
    found = {word("P Pi"): one(), word("Pi P"): one()}
    found |= {word("W K H' Pi H"): one() + W + W * K * G, word("W' H' Pi H K"): one() + W.T + W.T * G * K}
    found |= {word("X K G"): one() - X, word("G K X'"): one() - X.T, word("X K"): K * X.T}
    return found


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
    found = {"L_0": P * Z_0 + H * K * W_4, "L_2": P * Z_2 + H * K * W_5, "L_3": P * I_3 + H * I_6 + H * K * I_7}
    found |= {"L_4": H.T * Z_0 + W_4 + G * K * W_4, "L_5": H.T * Z_2 + W_5 + G * K * W_5, "L_6": W_6}
    found["L_7"] = H.T * I_3 + I_7 + G * I_6 + G * K * I_7
    return {name: V * Z.T * gain if name > "L_3" else gain for name, gain in found.items()}


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
    "lemma-5": (
        "Lemma 5 in (9) gives the inverse of Theorem 4 applied to (10), both as corrected",
        gain_residuals,
    ),
}


def example() -> dict[str, fmpq]:
    """All letters of the example as numbers, with the inverses as printed."""
    given: dict[str, Any] = {**EXAMPLE, **GIVEN}
    at = {name: fmpq(value) for name, value in given.items()}
    seen = at["K"] * at["G"] * at["tau"]
    at |= {"Pi": 1 / at["P"], "X": 1 / (1 + seen)}
    return at | {"W": 1 / (at["K"] * at["H"] ** 2 * at["Pi"] - 1 - seen)}


def require_correction(corrected: Sequence[Words], printed: Sequence[Words], at: Mapping[str, fmpq], what: str) -> None:
    """Refuse unless all residuals of the corrected formulas vanish, and not all printed ones in an example."""
    for i, residual in enumerate(corrected):
        decide(Identity(residual.reduced(rules()), NONE, f"row {i} of {what} as corrected"))
    require(any(residual.at(at) != 0 for residual in printed), f"{what} holds as printed")


@statement(
    "delay.operator-identity", source="peet2019", parameters={"part": text}, holds=True, says="operator identity"
)
def operator_identity(part: str) -> Found:
    """{words}, for any number of states, measurements and delays; as printed it does not, with one state and a delay
    of {delay}.
    """
    require(part in PARTS, f"parameters.part must be one of {', '.join(PARTS)}")
    words, residuals = PARTS[part]
    require_correction(residuals(printed=False), residuals(printed=True), example(), part)
    return Found(words={"words": words, "delay": EXAMPLE["tau"]})


@statement("delay.present-only", source="peet2019", holds=True, says="correction of the present state only")
def present_only() -> None:
    """Where Q_i and Z_3i to Z_7ij are zero, all gains of Lemma 5 are zero but L_0 = P^-1 Z_0 and L_2i = P^-1 Z_2i."""
    zero = ("H", "I_3", "W_4", "W_5", "W_6", "I_6", "I_7")
    found = {name: gain.without(*zero) for name, gain in gains(*inverse(printed=False)).items()}
    Pi, Z_0, Z_2 = named("Pi Z_0 Z_2")
    for name, expected in {"L_0": Pi * Z_0, "L_2": Pi * Z_2}.items():
        decide(Identity(found.pop(name), expected, f"the formula of {name}"))
    for name, gain in found.items():
        decide(Identity(gain, NONE, f"that {name} is zero"))

"""Theorem 4 and Lemma 5 of Peet and Gu in symbols: the inverse of an operator (8), and the gains it gives.

The formulas use the histories through products at one point and through integrals only. So an integral is taken as a
sum over a few points with weights omega, and the values at the points are symbols: Z (its block of W rows), V = S^-1,
and phi = V chi, so that S phi = chi. The sum K = T = sum omega Z V Z' stands for the integral of Z S^-1 Z'.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from flint import fmpq_mpoly

from replication.verify.algebra.symbolic import Symbolic, symbols, unit
from replication.verify.reading import text
from replication.verify.statement import Found, statement
from replication.verify.theorem import require

Size = tuple[int, tuple[int, ...], tuple[int, ...]]
"""Number of states, rows of Z for each delay, and the delay of each point."""
SMALL: tuple[Size, ...] = ((2, (2,), (0,)), (1, (2,), (0, 0, 0)), (2, (1, 1), (0, 1)))
LARGE: tuple[Size, ...] = ((2, (2, 2), (0, 0, 1, 1)),)


@dataclass(frozen=True)
class Points:
    """Symbols of a case: m by name; of each point its weight, Z with the rows of other delays zero, and V."""

    m: Mapping[str, Symbolic]
    weights: Sequence[fmpq_mpoly]
    Z: Sequence[Symbolic]
    V: Sequence[Symbolic]
    tau: fmpq_mpoly

    def total(self, values: Callable[[int], Symbolic]) -> Symbolic:
        """The integral: the weighted sum over the points."""
        first, *others = (values(k) * weight for k, weight in enumerate(self.weights))
        return sum(others, first)


def points(
    states: int, widths: Sequence[int], delays: Sequence[int], shapes: Mapping[str, tuple[int, int]], *symmetric: str
) -> Points:
    """The symbols of a case, and those of other names and shapes."""
    count = range(len(delays))
    own = {f"Z{k}": (widths[delay], states) for k, delay in enumerate(delays)}
    own |= {f"V{k}": (states, states) for k in count} | {f"omega{k}": (1, 1) for k in count} | {"tau": (1, 1)}
    m = symbols({**own, **shapes}, (*symmetric, *(f"V{k}" for k in count)))
    tau = m["tau"].entry
    Z = []
    for k, delay in enumerate(delays):
        empty = (tau - tau,) * states
        parts = [m[f"Z{k}"].rows if i == delay else (empty,) * width for i, width in enumerate(widths)]
        Z.append(Symbolic(tuple(row for rows in parts for row in rows)))
    return Points(m, [m[f"omega{k}"].entry for k in count], Z, [m[f"V{k}"] for k in count], tau)


def adjugate(M: Symbolic) -> tuple[Symbolic, fmpq_mpoly]:
    """adj(M) and det(M) of a matrix of order one or two."""
    if len(M.rows) == 1:
        return unit(1, M.entry**0), M.entry
    (a, b), (c, d) = M.rows
    return Symbolic(((d, -b), (-c, a))), a * d - b * c


def inverse_residuals(case: Size, *, printed: bool) -> list[Symbolic]:
    """The inverse of Theorem 4 applied to the image of (x, phi), minus (x, phi), times the denominators.

    Gamma = tau G. Printed: Gamma stands in the formulas and S^-1/tau in the inverse; corrected: G, and S^-1/tau^2.
    """
    n, widths, delays = case
    width = sum(widths)
    shapes = {"P": (n, n), "H": (n, width), "G": (width, width), "x": (n, 1)}
    shapes |= {f"chi{k}": (n, 1) for k in range(len(delays))}
    q = points(n, widths, delays, shapes, "P", "G")
    P, H, G, x, tau = q.m["P"], q.m["H"], q.m["G"], q.m["x"], q.tau
    used = G * tau if printed else G
    K = q.total(lambda k: q.Z[k] @ q.V[k] @ q.Z[k].T)
    P_adjugate, D = adjugate(P)
    X = unit(width, tau**0) + K @ used
    X_adjugate, xi = adjugate(X)
    W_adjugate, delta = adjugate(K @ H.T @ P_adjugate @ H - X * D)
    N = P_adjugate @ H @ W_adjugate  # H_hat = N / delta
    M = (N.T @ H + used * delta) @ X_adjugate  # Gamma_hat = -M / (delta xi)
    P_hat = (unit(n, delta) - N @ K @ H.T) @ P_adjugate  # times delta D
    seen = q.total(lambda k: q.Z[k] @ q.V[k] @ q.m[f"chi{k}"])
    head = P @ x + H @ seen
    tails = [(q.Z[k].T @ H.T @ x + q.m[f"chi{k}"]) * tau + q.Z[k].T @ G @ seen * tau for k in range(len(delays))]
    pulled = q.total(lambda k: q.Z[k] @ q.V[k] @ tails[k])
    residuals = [P_hat @ head * tau + N @ pulled * D - x * (delta * D * tau)]
    for k, tail in enumerate(tails):
        inside = q.Z[k].T @ (N.T @ head * (tau * xi) - M @ pulled)
        local = (tail * (tau if printed else tau**0) - q.m[f"chi{k}"] * tau) * (delta * xi)
        residuals.append(q.V[k] @ (inside + local))
    return residuals


def gain_residuals(case: Size, *, printed: bool) -> list[Symbolic]:
    """The inverse {P, Q, S, R} of Theorem 4 (any P_hat, H_hat, Gamma_hat) applied to (10), minus (9) with the gains
    of Lemma 5, times tau. Printed: (10) and the inverse as printed; corrected: both as in the errata.
    """
    n, widths, delays = case
    width, each = sum(widths), range(len(delays))
    shapes = {"P": (n, n), "H": (n, width), "G": (width, width), "Z_0": (n, 1), "W_4": (width, 1), "W_6": (width, 1)}
    shapes |= {"y": (1, 1)} | {f"y{k}": (1, 1) for k in each} | {f"Z_3{k}": (n, 1) for k in each}
    shapes |= {f"W_7{k}": (width, 1) for k in each}
    for j in range(len(widths)):
        shapes |= {f"end{j}": (1, 1), f"Z_2{j}": (n, 1), f"W_5{j}": (width, 1)}
    q = points(n, widths, delays, shapes, "P", "G")
    m, tau = q.m, q.tau
    P, H, G = m["P"], m["H"], m["G"]
    T = q.total(lambda k: q.Z[k] @ q.V[k] @ q.Z[k].T)
    ends = range(len(widths))
    # (10), its second row without Z(s)' in front.
    head = m["Z_0"] @ m["y"] + q.total(lambda k: m[f"Z_3{k}"] @ m[f"y{k}"])
    injected = m["W_4"] @ m["y"] + q.total(lambda k: m[f"W_7{k}"] @ m[f"y{k}"])
    for j in ends:
        head = head + m[f"Z_2{j}"] @ m[f"end{j}"]
        injected = injected + m[f"W_5{j}"] @ m[f"end{j}"]
    rows = [q.Z[k].T @ (injected + m["W_6"] @ m[f"y{k}"]) for k in each]
    pulled = q.total(lambda k: q.Z[k] @ q.V[k] @ rows[k]) * (tau**0 if printed else tau)
    point = P @ head * tau + H @ pulled
    histories = [q.V[k] @ (q.Z[k].T @ (H.T @ head * tau + G @ pulled) + rows[k] * tau) for k in each]
    # (9) with the gains of Lemma 5.
    local = [q.Z[k] @ q.V[k] @ q.Z[k].T @ m["W_6"] for k in each]
    L_0 = P @ m["Z_0"] + H @ T @ m["W_4"]
    L_3 = [P @ m[f"Z_3{k}"] + H @ local[k] + H @ T @ m[f"W_7{k}"] for k in each]
    L_4 = H.T @ m["Z_0"] + m["W_4"] + G @ T @ m["W_4"]
    L_7 = [H.T @ m[f"Z_3{k}"] + m[f"W_7{k}"] + G @ local[k] + G @ T @ m[f"W_7{k}"] for k in each]
    gained = L_0 @ m["y"] + q.total(lambda k: L_3[k] @ m[f"y{k}"])
    inside = L_4 @ m["y"] + q.total(lambda k: L_7[k] @ m[f"y{k}"])
    for j in ends:
        gained = gained + (P @ m[f"Z_2{j}"] + H @ T @ m[f"W_5{j}"]) @ m[f"end{j}"]
        inside = inside + (H.T @ m[f"Z_2{j}"] + m[f"W_5{j}"] + G @ T @ m[f"W_5{j}"]) @ m[f"end{j}"]
    residuals = [point - gained * tau]
    for k in each:
        residuals.append(histories[k] - q.V[k] @ q.Z[k].T @ (inside + m["W_6"] @ m[f"y{k}"]) * tau)
    return residuals


PARTS: Mapping[str, tuple[str, Callable[..., list[Symbolic]], tuple[Size, ...]]] = {
    "theorem-4": ("Theorem 4, with Gamma/tau_K and S^-1/tau_K^2, inverts the operator (8)", inverse_residuals, SMALL),
    "lemma-5": ("Lemma 5, with the corrected inverse and (10), composes them", gain_residuals, LARGE),
}


def require_correction(corrected: Sequence[Symbolic], printed: Sequence[Symbolic], what: str) -> None:
    """Refuse unless all residuals of the corrected formulas vanish, and not all of the printed ones."""
    for i, residual in enumerate(corrected):
        require(residual.vanishes(), f"{what} as corrected fails in row {i}")
    require(not all(residual.vanishes() for residual in printed), f"{what} holds as printed")


@statement("delay.operator-identity", source="peet2019", parameters={"part": text}, holds=True)
def operator_identity(part: str) -> Found:
    """{words}: checked with every integral replaced by a weighted sum over at most {most} points, for all operators of
    these sizes (states, rows of Z, points): {sizes}; as printed it does not, even so.
    """
    require(part in PARTS, f"parameters.part must be one of {', '.join(PARTS)}")
    words, residuals, cases = PARTS[part]
    for case in cases:
        require_correction(residuals(case, printed=False), residuals(case, printed=True), part)
    sizes = (f"{n}, {sum(widths)}, {len(delays)}" for n, widths, delays in cases)
    most = max(len(delays) for _, _, delays in cases)
    return Found(words={"words": words, "most": most, "sizes": "; ".join(sizes)})

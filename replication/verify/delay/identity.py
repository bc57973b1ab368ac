"""The identity behind Theorem 3 of Peet and Gu, in symbols: the dissipation is the quadratic form (D, E, F, G).

Both sides are polynomials in the entries of the plant, of P, Q_i, S_i, R_ij and Z, in gamma and the delays, and in the
coefficients of a history e with e_i(0) = e_0: two delays, polynomials Q, S, R, Z of degree one, e_i of degree two.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from flint import fmpq_mpoly

from replication.verify.algebra.symbolic import Symbolic, symbols
from replication.verify.reading import sequence, sized, text
from replication.verify.statement import Found, statement
from replication.verify.theorem import require

STATES = 2
DELAYS = (1, 2)
LAST = max(DELAYS)
POWERS = (0, 1)
MISPRINTS = {
    "d-sign": "the blocks of D with S_i(-tau_i)",
    "f-sign": "the derivative of S_i in F_i",
    "e-transposes": "the transposes in E_i",
    "eq10-factor": "the second row of (10)",
    "theorem-1-sign": "the square of C_1 e",
}


class Case:
    """All matrices of the identity as symbols; functions of s and t are polynomials in the symbols s and t."""

    def __init__(self, states: int) -> None:
        """Name the symbols."""
        n, one, scalar = states, 1, (1, 1)
        shapes: dict[str, tuple[int, int]] = {"gamma": scalar, "tau1": scalar, "tau2": scalar, "s": scalar, "t": scalar}
        shapes |= {"A0": (n, n), "B": (n, one), "C0": (one, n), "C_2": (one, n), "P": (n, n), "Z0": (n, one)}
        shapes |= {"w": scalar, "v": scalar, "e": (n, one)}
        for i in DELAYS:
            shapes |= {f"A{i}": (n, n), f"C{i}": (one, n), f"Z2{i}": (n, one)}
            shapes |= {f"e{i}{power}": (n, one) for power in (1, 2)}
            shapes |= {f"{name}{i}{a}": (n, n) for name in "QS" for a in POWERS}
            shapes |= {f"{name}{i}{a}": (n, one) for name in ("Z3", "Z4", "Z6") for a in POWERS}
            shapes |= {f"Z5{i}{j}{a}": (n, one) for j in DELAYS for a in POWERS}
            shapes |= {f"Z7{i}{j}{a}{b}": (n, one) for j in DELAYS for a in POWERS for b in POWERS}
            shapes |= {f"R{i}{j}{a}{b}": (n, n) for j in DELAYS for a in POWERS for b in POWERS}
        self.m = symbols(shapes, ("P", *(f"S{i}{a}" for i in DELAYS for a in POWERS)))
        self.s, self.t, self.gamma = self.m["s"].entry, self.m["t"].entry, self.m["gamma"].entry
        self.tau = {i: self.m[f"tau{i}"].entry for i in DELAYS}

    def of_s(self, name: str) -> Symbolic:
        """The polynomial `name` in s."""
        return self.m[f"{name}0"] + self.m[f"{name}1"] * self.s

    def kernel(self, name: str) -> Symbolic:
        """The polynomial `name` in s and t."""
        terms = [self.m[f"{name}{a}{b}"] * (self.s**a * self.t**b) for a in POWERS for b in POWERS]
        return terms[0] + terms[1] + terms[2] + terms[3]

    def R(self, i: int, j: int) -> Symbolic:
        """R_ij(s, t), with R_ij(s, t) the transpose of R_ji(t, s)."""
        return self.kernel(f"R{i}{j}") + self.swapped(self.kernel(f"R{j}{i}")).T

    def e(self, i: int) -> Symbolic:
        """The history e_i(s), with e_i(0) = e_0."""
        return self.m["e"] + self.m[f"e{i}1"] * self.s + self.m[f"e{i}2"] * self.s**2

    def put(self, M: Symbolic, **values: fmpq_mpoly) -> Symbolic:
        """M with s or t replaced."""
        gens = self.s.context().gens()
        chosen = {str(self.m[name].entry): value for name, value in values.items()}
        return M.each(lambda entry: entry.compose(*(chosen.get(str(gen), gen) for gen in gens)))

    def swapped(self, M: Symbolic) -> Symbolic:
        """M with s and t exchanged."""
        return self.put(M, s=self.t, t=self.s)

    def in_t(self, M: Symbolic) -> Symbolic:
        """A polynomial in s as one in t."""
        return self.put(M, s=self.t)

    def slope(self, M: Symbolic, name: str = "s") -> Symbolic:
        """The derivative in s or t."""
        return M.each(lambda entry: entry.derivative(str(self.m[name].entry)))

    def integral(self, M: Symbolic, i: int, name: str = "s") -> Symbolic:
        """The integral over [-tau_i, 0] in s or t."""
        primitive = M.each(lambda entry: entry.integral(str(self.m[name].entry)))
        return self.put(primitive, **{name: 0 * self.s}) - self.put(primitive, **{name: -self.tau[i]})


def dissipation(x: Case, factor: fmpq_mpoly | int) -> fmpq_mpoly:
    """2<e, (P A + Z C_2) e - P B w> - gamma |w|^2 from (8) and (10), the second row of (10) times `factor`."""
    m, last = x.m, x.tau[LAST]
    e0, C2 = m["e"], m["C_2"]
    late = {i: x.put(x.e(i), s=-x.tau[i]) for i in DELAYS}
    rate = m["A0"] @ e0 - m["B"] @ m["w"]
    for i in DELAYS:
        rate = rate + m[f"A{i}"] @ late[i]
    head = m["P"] @ rate + m["Z0"] @ C2 @ e0
    total = m["w"].T @ m["w"] * -x.gamma
    for i in DELAYS:
        Q, S, e, slope = x.of_s(f"Q{i}"), x.of_s(f"S{i}"), x.e(i), x.slope(x.e(i))
        head = head + x.integral(Q @ slope + x.of_s(f"Z3{i}") @ C2 @ e, i) + m[f"Z2{i}"] @ C2 @ late[i]
        tail = Q.T @ rate * last + S @ slope * last
        injected = x.of_s(f"Z4{i}") @ C2 @ e0 + x.of_s(f"Z6{i}") @ C2 @ e
        for j in DELAYS:
            other = x.in_t(x.e(j))
            tail = tail + x.integral(x.R(i, j) @ x.slope(other, "t"), j, "t")
            injected = injected + x.of_s(f"Z5{i}{j}") @ C2 @ late[j]
            injected = injected + x.integral(x.kernel(f"Z7{i}{j}") @ C2 @ other, j, "t")
        total = total + x.integral(e.T @ (tail + injected * factor), i) * 2
    return (total + e0.T @ head * (2 * last)).entry


def output(x: Case) -> Symbolic:
    """C_1 e."""
    late = [x.m[f"C{i}"] @ x.put(x.e(i), s=-x.tau[i]) for i in DELAYS]
    return x.m["C0"] @ x.m["e"] + late[0] + late[1]


def quadratic_form(x: Case, misprint: str) -> fmpq_mpoly:
    """<h, P_(D, E, F, G) h> of Theorem 3; `misprint` leaves one group of its terms as printed."""
    m, last = x.m, x.tau[LAST]
    e0, w, v, C2 = m["e"], m["w"], m["v"], m["C_2"]
    late = {i: x.put(x.e(i), s=-x.tau[i]) for i in DELAYS}
    total = (w.T @ w + v.T @ v) * -x.gamma + v.T @ output(x) * 2 - w.T @ m["B"].T @ m["P"] @ e0 * (2 * last)
    half = m["P"] @ m["A0"] + m["Z0"] @ C2
    for i in DELAYS:
        half = half + x.put(x.of_s(f"Q{i}"), s=0 * x.s)
        total = total + e0.T @ x.put(x.of_s(f"S{i}"), s=0 * x.s) @ e0 * last
        cross = m["P"] @ m[f"A{i}"] - x.put(x.of_s(f"Q{i}"), s=-x.tau[i]) + m[f"Z2{i}"] @ C2
        end = late[i].T @ x.put(x.of_s(f"S{i}"), s=-x.tau[i]) @ late[i] * last
        total = total + e0.T @ cross @ late[i] * (2 * last) + end * (1 if misprint == "d-sign" else -1)
    total = total + e0.T @ half @ e0 * (2 * last)
    for i in DELAYS:
        e, Q, Z6 = x.e(i), x.of_s(f"Q{i}"), x.of_s(f"Z6{i}") @ C2
        row = e0.T @ _phi_0(x, i, misprint) - w.T @ m["B"].T @ Q * last
        for j in DELAYS:
            row = row + late[j].T @ _phi(x, i, j, misprint)
        F = x.slope(x.of_s(f"S{i}")) * (1 if misprint == "f-sign" else -1) + Z6 + Z6.T
        total = total + x.integral(row @ e * 2 + e.T @ F @ e * last, i)
        for j in DELAYS:
            Z7 = x.kernel(f"Z7{i}{j}") @ C2 + (x.swapped(x.kernel(f"Z7{j}{i}")) @ C2).T
            G = Z7 * last - x.slope(x.R(i, j)) - x.slope(x.R(i, j), "t")
            total = total + x.integral(x.integral(e.T @ G @ x.in_t(x.e(j)), j, "t"), i)
    return total.entry


def _phi_0(x: Case, i: int, misprint: str) -> Symbolic:
    """tau_K times the block of e_0 against e_i."""
    last, C2 = x.tau[LAST], x.m["C_2"]
    block = (x.m["A0"].T @ x.of_s(f"Q{i}") - x.slope(x.of_s(f"Q{i}"))) * last
    for k in DELAYS:
        block = block + x.put(x.R(i, k), t=0 * x.s).T
    Z3, Z4 = x.of_s(f"Z3{i}") @ C2, x.of_s(f"Z4{i}") @ C2
    if misprint == "e-transposes":
        return (block + (Z4 + Z3.T) * last).T
    return block + (Z3 + Z4.T) * last


def _phi(x: Case, i: int, j: int, misprint: str) -> Symbolic:
    """tau_K times the block of e_j(-tau_j) against e_i."""
    last = x.tau[LAST]
    block = x.m[f"A{j}"].T @ x.of_s(f"Q{i}") * last - x.put(x.R(i, j), t=-x.tau[j]).T
    Z5 = x.of_s(f"Z5{i}{j}") @ x.m["C_2"] * last
    return (block + Z5).T if misprint == "e-transposes" else block + Z5.T


def residuals(x: Case, misprints: Sequence[str]) -> Iterator[fmpq_mpoly]:
    """Left side less right side of the corrected identity, and of that with each of the misprints.

    As printed, `theorem-1-sign` has |z|^2/gamma for the supply 2 v'z - gamma |v|^2, beside a form that holds v; its
    residual is the one times gamma.
    """
    z, v = output(x), x.m["v"]
    left, right = dissipation(x, x.tau[LAST]), quadratic_form(x, "")
    supply = (v.T @ z * 2 - v.T @ v * x.gamma).entry
    yield left + supply - right
    for misprint in misprints:
        if misprint == "eq10-factor":
            yield dissipation(x, 1) + supply - right
        elif misprint == "theorem-1-sign":
            yield (left - right) * x.gamma + (z.T @ z).entry
        else:
            yield left + supply - quadratic_form(x, misprint)


def require_identity(misprints: Sequence[str], states: int) -> None:
    """Refuse unless the corrected identity holds, and none with one of the misprints does."""
    corrected, *printed = residuals(Case(states), misprints)
    require(corrected.is_zero(), "the corrected identity fails")
    for misprint, residual in zip(misprints, printed, strict=True):
        require(not residual.is_zero(), f"the identity holds with {MISPRINTS[misprint]} as printed")


@statement("delay.dissipation-identity", source="peet2019", parameters={"misprints": sized(sequence, text)}, holds=True)
def dissipation_identity(misprints: list[str]) -> Found:
    """The dissipation is the quadratic form of Theorem 3 for all plants with two states and two delays, one
    disturbance, output and measurement, for all storages and injections of degree one and histories of degree two, if
    these are corrected; with any one of them as printed it is not: {corrected}.
    """
    require(bool(misprints) and set(misprints) <= MISPRINTS.keys(), f"misprints must be among {', '.join(MISPRINTS)}")
    require(len(set(misprints)) == len(misprints), "parameters.misprints names one twice")
    require_identity(misprints, STATES)
    return Found(words={"corrected": "; ".join(MISPRINTS[misprint] for misprint in misprints)})

"""From a certificate on a level of a multi-rate observer to a file for Coq: its theorem, its data, three checks.

The file holds no plant: it names one in the paper's `coq/Decimals.v`, and the gains of `multirate.gain`. Nothing here
is trusted: what is wrong, Coq refuses.
"""

import re
from collections.abc import Mapping, Sequence
from math import isqrt, lcm
from types import SimpleNamespace
from typing import Any

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat

from replication.errors import InfeasibleError, InvalidInputError
from replication.machine import GAIN, PREDICTOR, SMOOTHER
from replication.verify.algebra.linear import block, identity, submatrix, zeros
from replication.verify.multirate.levels import matrix_30
from replication.verify.multirate.sensing import Sensing, advanced, read_sensing, schedule, steady
from replication.verify.reading import matrices, matrix, rational

ROOM = range(12, 61, 4)
"""Exponents tried for the room 2^-k that is left in the matrix of Theorem 2."""
MORE_BITS = 24
"""By which a factor is finer than the room."""
LONGEST_WAY = 50
"""Most periods that the way from rest to a steady state may take."""


def storage(system: Sensing, P: Sequence[fmpq_mat], gains: Sequence[fmpq_mat], level: fmpq) -> dict[str, str]:
    """What shows that the matrices (30) for gains L_k of the sensors of the system are positive definite.

    F_k F_k' + room I is below each, with the F_k as `factors`; and above * I is above each P_k. Raises InfeasibleError
    where there is no room.
    """
    wholes = [matrix_30(system, P, k, P[k] * step, level) for k, step in enumerate(system.error_system(gains))]
    above = max(sum((abs(entry) for entry in row), fmpq(0)) for matrix in P for row in matrix.tolist())
    for exponent in ROOM:
        room = fmpq(1, 2**exponent)
        factors = [factor(whole - identity(whole.nrows()) * (2 * room), exponent + MORE_BITS) for whole in wholes]
        if all(F is not None for F in factors):
            tables = _tables([F for F in factors if F is not None])
            return {"storage": _tables(P), "factors": tables, "room": _quotient(room), "above": _quotient(above)}
    raise InfeasibleError("the matrix of Theorem 2 is not positive definite with room for rounding")


def factor(M: fmpq_mat, bits: int) -> fmpq_mat | None:
    """A lower triangular F in multiples of 2^-bits with F F' about M; None if M is not clearly positive definite."""
    size, unit = M.nrows(), 1 << bits
    F = [[0] * size for _ in range(size)]
    for i in range(size):
        for j in range(i + 1):
            scaled = M[i, j] * unit * unit
            left = int(scaled.p // scaled.q) - sum(F[i][k] * F[j][k] for k in range(j))
            if i == j and left <= 0:
                return None
            F[i][j] = isqrt(left) if i == j else left // F[j][j]
    return fmpq_mat(size, size, [fmpq(entry, unit) for row in F for entry in row])


def stacked(system: Sensing, x: fmpq_mat, v: fmpq_mat, phase: int, *, hidden: bool) -> fmpq_mat:
    """Error above disturbance; with the sensor noise that hides the state if it is to be hidden."""
    return block([[x], [v], [system.concealing(phase, x)]] if hidden else [[x], [v]])


def driven_by(system: Sensing, *, hidden: bool) -> list[fmpq_mat]:
    """The steps that a disturbance drives: of the plant if noise hides it, else of the error system of the gains."""
    return [block([[system.A, system.B_d]])] * system.phases if hidden else system.error_system(system.gains)


def cycle(system: Sensing, turn: fmpq_mat, v: Sequence[fmpq_mat], *, hidden: bool) -> tuple[list[fmpq_mat], ...]:
    """One period of the steady state under v_k, turned by `turn` in each; and a way to it from rest."""
    steps, n, m = driven_by(system, hidden=hidden), system.order, v[0].nrows()
    first = x = steady(steps, turn, v)
    period = []
    for k, (step, v_k) in enumerate(zip(steps, v, strict=True)):
        period.append(stacked(system, x, v_k, k, hidden=hidden))
        x = advanced(step, x, v_k)
    inputs: list[fmpq_mat] = []
    reach = zeros(n, 0)
    while len(inputs) < LONGEST_WAY * system.phases:
        for step in steps:
            A, B = submatrix(step, range(n), range(n)), submatrix(step, range(n), range(n, n + m))
            reach = block([[A * reach, B]])
            inputs.append(step)
        gram = reach * reach.transpose()
        if gram.rank() == n:
            u = reach.transpose() * gram.solve(first)
            chosen = [submatrix(u, range(m * t, m * t + m), range(turn.nrows())) for t in range(len(inputs))]
            return from_rest(system, steps, chosen, 0, hidden=hidden)[:-1], period
    raise InfeasibleError(f"no disturbance leads from rest to the steady state within {LONGEST_WAY} periods")


def from_rest(
    system: Sensing, steps: Sequence[fmpq_mat], v: Sequence[fmpq_mat], start: int, *, hidden: bool
) -> list[fmpq_mat]:
    """Error above disturbance at each instant from 0 on if v_k acts from `start` on; undisturbed at the last one."""
    width = v[0].ncols()
    x = zeros(system.order, width)
    errors = [zeros(system.order + system.noises, width)] * start
    for t, v_t in enumerate(v, start):
        errors.append(stacked(system, x, v_t, t % system.phases, hidden=hidden))
        x = advanced(steps[t % system.phases], x, v_t)
    return [*errors, block([[x], [zeros(system.noises, width)]])]


def common_denominator(matrices: Sequence[fmpq_mat]) -> int:
    """The least common denominator of all entries."""
    return lcm(1, *(int(fmpz(matrix.numer_denom()[1])) for matrix in matrices))


GAIN_BITS = 48
"""Of the gains P_k^-1 Y_k of an optimum, rounded."""
HEAD = """From mathcomp Require Import all_ssreflect all_algebra.
From Coq Require Import QArith_base.
From Multirate Require Import Statement Checker.
From {paper} Require Import Decimals.

"""
Certificate = Mapping[str, Any]


def identifier(name: str) -> str:
    """The name of a plant or theorem as Coq writes it."""
    word = re.sub(r"[^A-Za-z0-9]", "_", name)
    if not re.match(r"[A-Za-z]", word):
        raise InvalidInputError(f"{name!r} cannot be the name of a Coq module; start it with a letter")
    return word


def stated(wanted: Certificate, bound: Mapping[str, str]) -> tuple[dict[str, str], dict[str, str]]:
    """The definitions that a wanted theorem (statement, plant, parameters) is stated in: its subject, its numbers."""
    fields, plant = wanted["parameters"], identifier(wanted["plant"])
    if len(set(fields["sensors"])) < len(fields["sensors"]):
        raise InvalidInputError(f"sensors {fields['sensors']} name one twice; give each sensor one period")
    N = len(schedule(fields["periods"], fields["offsets"]))
    entries = zip(fields["sensors"], fields["periods"], (theta % N for theta in fields["offsets"]), strict=True)
    times = "; ".join(f"({sensor}, {period}, {theta})" for sensor, period, theta in entries)
    numbers = {"lower": bound["lower"], "upper": bound["upper"], "relative": fields["relative"]}
    return (
        {"plant": f"{plant}{'_plant' if wanted['statement'] == GAIN else ''}", "times : schedule": f"[:: {times}]%nat"},
        {name: _quotient(rational(text, "a bound")) for name, text in numbers.items()},
    )


def proposition(wanted: Certificate, bound: Mapping[str, str]) -> str:
    """What Coq is to prove of a wanted theorem with these bounds."""
    subject, numbers = stated(wanted, bound)
    on = f"under R {' '.join(subject.values())}"
    bounds = " ".join(f"(number R ({number}))" for number in numbers.values())
    if wanted["statement"] == GAIN:
        return f"forall R, gain_between ({on})\n  (cyclic R _ _ {identifier(wanted['plant'])}) {bounds}"
    sees = "everything" if wanted["statement"] == SMOOTHER else "the_past"
    return f"forall R, optimum_between ({on})\n  {sees} {bounds}"


def source(certificate: Certificate) -> str:
    """The file for Coq."""
    kind, parameters = certificate["statement"], SimpleNamespace(**certificate["parameters"])
    system = read_sensing(certificate["plant"], "plant", parameters, *(["L"] if kind == GAIN else []))
    witness, upper = certificate["witness"], rational(certificate["bound"]["upper"], "bound.upper")
    P = [matrix(entry, "witness.P") for entry in witness["P"]]
    gains = system.gains if kind == GAIN else _rounded_gains(system, P, witness["Y"])
    loops = [*system.error_system(gains), *(part for k in range(system.phases) for part in system.open_loop(k))]
    claim = {"statement": kind, "plant": certificate["plant"]["name"], "parameters": certificate["parameters"]}
    subject, numbers = stated(claim, certificate["bound"])
    conclusion = proposition(claim, certificate["bound"])
    sensors = len(certificate["plant"]["C"])
    widened = [_widened(L, parameters.sensors, sensors) for L in gains]
    way, steady, turn = _below(system, kind, witness)
    turned = f"{turn.nrows()} turn way cycle"
    check, theorem = {
        GAIN: (f"check_cycle plant times den false gains {turned} lower", "gain_proved"),
        SMOOTHER: (f"check_cycle plant times den true (nseq (period times) [::]) {turned} lower", "smoother_proved"),
        PREDICTOR: ("check_finite plant times den 1 way lower", "predictor_proved"),
    }[kind]
    parts = {
        **subject,
        "den": f"{common_denominator(loops)}%positive",
        "gains": identifier(certificate["plant"]["name"]) if kind == GAIN else _tables(widened),
        **storage(system, P, gains, upper),
        "way": _tables(way),
        "cycle": _tables(steady),
        "turn": _table(turn),
        **numbers,
    }
    lines = [f"Definition {name} := {value}." for name, value in parts.items()]
    checks = {
        "width_holds": "check_width lower upper relative",
        "upper_holds": "check_above plant times den gains storage factors upper room above",
        "lower_holds": check,
    }
    lines += [f"Lemma {name} : {what}.\nProof. vm_cast_no_check (erefl true). Qed." for name, what in checks.items()]
    lines += [f"\nTheorem proved : {conclusion}.\nProof. move=> R; exact: ({theorem} R {' '.join(checks)}). Qed.\n"]
    return HEAD.format(paper=certificate["paper"]) + "\n".join(lines)


def _below(system: Sensing, kind: str, witness: Certificate) -> tuple[list[fmpq_mat], list[fmpq_mat], fmpq_mat]:
    """The way from rest, the cycle, and how it is turned from period to period; without cycle for a predictor."""
    if kind == PREDICTOR:
        d = [matrix(entry, "witness.d") for entry in witness["d"]]
        start = int(witness["start"]) % system.phases
        return from_rest(system, driven_by(system, hidden=True), d, start, hidden=True), [], fmpq_mat(0, 0)
    turn, hidden = matrix(witness["turn"], "witness.turn"), kind == SMOOTHER
    v = [matrix(entry, "witness.v") for entry in witness["d" if hidden else "v"]]
    way, steady = cycle(system, turn, v, hidden=hidden)
    return way, steady, turn


def _rounded_gains(system: Sensing, P: Sequence[fmpq_mat], Y: Any) -> list[fmpq_mat]:
    """P_k^-1 Y_k in multiples of 2^-GAIN_BITS; zero for sensors that are not measured."""
    gains, unit = [], 1 << GAIN_BITS
    for k, Y_k in enumerate(matrices(Y, "witness.Y", system.order, system.sensors, system.phases)):
        used = [fmpq(int(i in system.measured[k])) for i in range(system.sensors)]
        L = P[k].solve(Y_k).tolist()
        gains.append(
            fmpq_mat([[fmpq(round(x * use * unit), unit) for x, use in zip(row, used, strict=True)] for row in L])
        )
    return gains


def _widened(L: fmpq_mat, sensors: Sequence[int], count: int) -> fmpq_mat:
    """Gains of all sensors of the plant, from those of the sensors in use."""
    rows = L.tolist()
    return fmpq_mat([[row[sensors.index(i)] if i in sensors else fmpq(0) for i in range(count)] for row in rows])


def _quotient(number: fmpq) -> str:
    return f"Qmake {number.p} {number.q}" if number >= 0 else f"Qmake ({number.p}) {number.q}"


def _rows(M: fmpq_mat, denominator: int) -> str:
    """Integers over a denominator: in hexadecimal, which Coq reads faster, once they are long."""
    integers = (M * denominator).numer_denom()[0] if M.nrows() else fmpz_mat(0, 0)
    texts = ([str(x) if abs(x) < 1 << 64 else hex(x) for x in map(int, row)] for row in integers.tolist())
    return "; ".join(f"[:: {'; '.join(row)}]" for row in texts)


def _table(M: fmpq_mat) -> str:
    """A table over the least common denominator."""
    denominator = common_denominator([M])
    rows = _rows(M, denominator)
    return f"over {denominator} [:: {rows}]%Z" if rows else "[::] : table"


def _tables(parts: Sequence[fmpq_mat]) -> str:
    """Tables of these matrices, all over one denominator."""
    denominator = common_denominator(parts)
    texts = ";\n  ".join(f"[:: {_rows(part, denominator)}]" for part in parts)
    return f"map (over {denominator}) [:: {texts}]%Z" if texts else "[::] : seq table"

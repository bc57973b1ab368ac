"""A plant under a sensing schedule, its error system, and the disturbances that no sensor shows.

x(k+1) = A x(k) + B_d d(k), measured C_k x(k) + D_k w(k) with the rows C_k, D_k of the sensors measured at k, z = W x.
With gains L_k: e(k+1) = A_k e(k) + B_k v(k), [A_k B_k] = [A B_d 0] - L_k [C_k 0 D_k], v = (d, w).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import lcm
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, identity, product, solved, submatrix, take_rows, zeros
from replication.verify.kernel import at_most, decide, definite, equal, less, within
from replication.verify.reading import MAX_ENTRIES, fields, integer, matrices, matrix, positive, sequence, sized, square
from replication.verify.statement import Depends, Table
from replication.verify.theorem import require

LONGEST_PERIOD = 1000
Schedule = list[list[int]]
"""The sensors that are measured at each phase."""


@dataclass(frozen=True)
class Sensing:
    """The plant seen by sensors, the rows of C and D; which of them are measured at each phase; L_k (n, q) if given."""

    A: fmpq_mat
    B_d: fmpq_mat
    W: fmpq_mat
    C: fmpq_mat
    D: fmpq_mat
    measured: Schedule
    gains: Sequence[fmpq_mat] = ()

    @property
    def phases(self) -> int:
        """N, the number of instants after which the schedule repeats."""
        return len(self.measured)

    @property
    def sensors(self) -> int:
        """q, the number of sensors."""
        return int(self.C.nrows())

    @property
    def order(self) -> int:
        """n, the number of states."""
        return int(self.A.nrows())

    @property
    def noises(self) -> int:
        """The number of disturbances d and sensor noises w together."""
        return int(self.B_d.ncols() + self.D.ncols())

    def rows(self, phase: int) -> tuple[fmpq_mat, fmpq_mat]:
        """C_k and D_k of a phase: the rows of the sensors that are measured."""
        return take_rows(self.C, self.measured[phase]), take_rows(self.D, self.measured[phase])

    def error_system(self, gains: Sequence[fmpq_mat]) -> list[fmpq_mat]:
        """[A_k B_k] of each phase for gains L_k (n, q), that is [A B_d 0] - L_k [C_k 0 D_k] over the measured rows.

        Columns of L_k of sensors that are not measured have no effect.
        """
        steps = []
        for k, L in enumerate(gains):
            driven, output = self.open_loop(k)
            steps.append(driven - self.acting(k, L) * output)
        return steps

    def open_loop(self, phase: int) -> tuple[fmpq_mat, fmpq_mat]:
        """[A B_d 0] and [C_k 0 D_k]: what becomes of (x, d, w), and what is measured of it."""
        C, D = self.rows(phase)
        driven = block([[self.A, self.B_d, zeros(self.order, D.ncols())]])
        return driven, block([[C, zeros(D.nrows(), self.B_d.ncols()), D]])

    def acting(self, phase: int, gain: fmpq_mat) -> fmpq_mat:
        """The columns of a gain (n, q) that belong to the sensors measured at a phase."""
        return take_rows(gain.transpose(), self.measured[phase]).transpose()

    def concealing(self, phase: int, x: fmpq_mat) -> fmpq_mat:
        """The smallest sensor noise for which the sensors measured at `phase` show zero: w = -D_k'(D_k D_k')^-1 C_k x.

        x (n, r) holds r states, one per column.
        """
        C, D = self.rows(phase)
        if not D.nrows():
            return zeros(D.ncols(), x.ncols())
        without = f"a sensor measured at phase {phase} has no noise of its own"
        hidden: fmpq_mat = -D.transpose() * solved(D * D.transpose(), C * x, without)
        return hidden


PERIOD = sized(integer, 1)
TIMES: Table = {
    "periods": sized(sequence, PERIOD),
    "offsets": Depends(lambda values: sized(sequence, integer, len(values.periods))),
}
"""Of the sensors, in their order: sampled where (k - offset) mod period == 0."""
CHOSEN: Table = {
    "sensors": sized(sequence, integer),
    "periods": Depends(lambda values: sized(sequence, PERIOD, len(values.sensors))),
    "offsets": TIMES["offsets"],
    "relative": positive,
}
"""Which rows of C and D are the sensors, when they measure, and how near the bounds must be to each other."""


def schedule(periods: Sequence[int], offsets: Sequence[int]) -> Schedule:
    """Which of the sensors have (k - offset) mod period == 0, by their place in the list, at each phase k."""
    require(len(periods) > 0, "parameters.periods names no sensor, and nothing is ever measured")
    common = 1
    for N in periods:
        common = lcm(common, N)
        require(common <= LONGEST_PERIOD, f"the schedule repeats after more than {LONGEST_PERIOD} instants")
    require(
        common * len(periods) <= MAX_ENTRIES,
        f"the schedule has {common} instants x {len(periods)} sensors, more than {MAX_ENTRIES}",
    )
    entries = list(zip(periods, offsets, strict=True))
    return [[i for i, (N, theta) in enumerate(entries) if (k - theta) % N == 0] for k in range(common)]


def read_sensing(value: Any, path: str, chosen: Any, *gains: str) -> Sensing:
    """A plant seen by the sensors `chosen` (parameters `CHOSEN`), with the gains of this name if there is one."""
    measured, sensors = schedule(chosen.periods, chosen.offsets), chosen.sensors
    _, *parts = fields(value, path, "name", "A", "B_d", "C", "D", "W", *gains)
    A = square(parts[0], f"{path}.A")
    n = A.nrows()
    C = matrix(parts[2], f"{path}.C", columns=n)
    D = matrix(parts[3], f"{path}.D", rows=C.nrows())
    require(all(i < C.nrows() for i in sensors), f"parameters.sensors names a sensor that is not there: {sensors}")
    require(len({*sensors}) == len(sensors), f"parameters.sensors names a sensor twice: {sensors}")
    B_d, W = matrix(parts[1], f"{path}.B_d", rows=n), matrix(parts[4], f"{path}.W", columns=n)
    L = matrices(parts[5], f"{path}.L", n, len(sensors), len(measured)) if gains else ()
    return Sensing(A, B_d, W, take_rows(C, sensors), take_rows(D, sensors), measured, L)


def without_noise(A: fmpq_mat, C: fmpq_mat, measured: Schedule) -> Sensing:
    """A plant as far as stability goes: nothing disturbs it, and nothing is weighted."""
    nothing = take_rows(A, [])
    return Sensing(A, nothing.transpose(), nothing, C, take_rows(C.transpose(), []).transpose(), measured)


# Bounds of gains in exact arithmetic: Theorem 1 from above; disturbances, seen and unseen, from below.
# All functions of bounds return or take squares of ratios of l2 norms, which are rational where the ratios are not.


Steps = Sequence[fmpq_mat]
"""[A_k B_k] of each phase, (n, n + m): x(k+1) = A_k x(k) + B_k v(k)."""
Hiding = Callable[[int, fmpq_mat], fmpq_mat]
"""The sensor noise at a phase that hides the states (n, r) there."""


def require_theorem_1(steps: Steps, W: fmpq_mat, P: list[fmpq_mat], level: fmpq) -> None:
    """Refuse unless P_k > 0 and diag(P_(k-1) - W'W, g^2 I) - [A_k B_k]' P_k [A_k B_k] > 0 at every phase.

    P_k weighs the error after the step at k, P_(k-1) the one before it. The second inequality says that the weighted
    square, which is never negative, falls by more than |We|^2 - g^2 |v|^2 in the step; summed from e(0) = 0 that is
    ||We|| <= g ||v||. Without disturbance it falls, so that the error system is stable.
    """
    for k, step in enumerate(steps):
        decide(definite(P[k], f"P_{k}"))
        require_fall(step, W, (P[k - 1], P[k]), level, f"phase {k}")


def require_fall(step: fmpq_mat, W: fmpq_mat, P: tuple[fmpq_mat, fmpq_mat], level: fmpq, where: str) -> None:
    """Refuse unless diag(P - W'W, g^2 I) - [A B]' P+ [A B] > 0 for P before and P+ after the step."""
    before, after = P
    room = supplied(W, before, step.ncols(), level) - product(step.transpose(), product(after, step))
    decide(definite(room, f"the matrix of Theorem 1 at {where}"))


def supplied(W: fmpq_mat, P: fmpq_mat, columns: int, level: fmpq) -> fmpq_mat:
    """diag(P - W'W, g^2 I) for states and inputs, so many columns together."""
    n, m = W.ncols(), columns - W.ncols()
    return block([[P - W.transpose() * W, zeros(n, m)], [zeros(m, n), identity(m) * level**2]])


def monodromy(steps: Steps) -> fmpq_mat:
    """The transition over one period from phase 0, A_(N-1) .. A_0."""
    total, *others = (submatrix(step, range(step.nrows()), range(step.nrows())) for step in steps)
    for A in others:
        total = product(A, total)
    return total


def advanced(step: fmpq_mat, x: fmpq_mat, v: fmpq_mat) -> fmpq_mat:
    """The next state, A x + B v."""
    return product(step, block([[x], [v]]))


def squares(M: fmpq_mat) -> fmpq:
    """The sum of the squares of all entries."""
    return sum((entry**2 for entry in M.entries()), fmpq(0))


def require_turn(turn: fmpq_mat) -> None:
    """Refuse unless R is an orthogonal matrix of order 1 or 2: how a signal changes from one period to the next."""
    decide(at_most(turn.nrows(), 2, "witness.turn must be of order 1 or 2"))
    decide(equal(turn * turn.transpose(), identity(turn.nrows()), "witness.turn is not orthogonal"))


def recurrent(transition: fmpq_mat, driven: fmpq_mat, turn: fmpq_mat) -> fmpq_mat:
    """The X (n, r) with transition X + driven = X turn: states that after one period are themselves, turned."""
    n, r = driven.nrows(), driven.ncols()
    # Column j of X turn is the sum over i of turn[i, j] X_i; all columns stacked make one linear system.
    eye = identity(n)
    rows = [[eye * turn[i, j] - (transition if i == j else zeros(n, n)) for i in range(r)] for j in range(r)]
    stacked = fmpq_mat(n * r, 1, [driven[i, j] for j in range(r) for i in range(n)])
    X = solved(block(rows), stacked, "the disturbance is in resonance with the system")
    return fmpq_mat(n, r, [X[j * n + i, 0] for i in range(n) for j in range(r)])


def steady(steps: Steps, turn: fmpq_mat, v: Sequence[fmpq_mat]) -> fmpq_mat:
    """The states at phase 0 that after one period under v_k are themselves, turned."""
    driven = zeros(steps[0].nrows(), turn.nrows())
    for step, v_k in zip(steps, v, strict=True):
        driven = advanced(step, driven, v_k)
    return recurrent(monodromy(steps), driven, turn)


def attained(
    steps: Steps,
    W: fmpq_mat,
    turn: fmpq_mat,
    v: list[fmpq_mat],
    hiding: Hiding | None = None,
    what: str = "error system",
) -> fmpq:
    """The square of a ratio that the gain of a stable system is not below.

    The input v_k R^j u at phase k of period j has, with a unit vector u, the steady state x_k R^j u. Averaged over the
    periods (R turns by an angle, or changes the sign at most) its squares are those of v_k and x_k; ended after many
    periods, it has finite energy, and start and end no longer count in the ratio. hiding: further noise at (k, x_k).
    """
    decide(within(monodromy(steps), f"the poles of the {what}"))
    require_turn(turn)
    x, output, noise = steady(steps, turn, v), fmpq(0), fmpq(0)
    for k, (step, v_k) in enumerate(zip(steps, v, strict=True)):
        output += squares(W * x)
        noise += squares(v_k) + (squares(hiding(k, x)) if hiding else 0)
        x = advanced(step, x, v_k)
    return ratio(output, noise)


def unseen_forever(system: Sensing, turn: fmpq_mat, d: list[fmpq_mat]) -> fmpq:
    """The square of a ratio below which no estimator gets, not even a smoother; for a stable plant.

    d_k R^j u disturbs the plant as in `attained`, and the sensor noise makes all measurements zero. Whatever the
    estimator says then, it says the same to the opposite disturbance, and in one of the two it errs by ||Wx|| or more.
    """
    step = block([[system.A, system.B_d]])
    return attained([step for _ in system.measured], system.W, turn, d, system.concealing, "plant")


def unseen_for_long(system: Sensing, start: int, d: list[fmpq_mat]) -> fmpq:
    """The square of a ratio below which no causal estimator gets: of z(1) .. z(T) to the noise at 0 .. T - 1.

    From x = 0 at phase `start` on, d_k disturbs the plant, and until T - 1 the sensor noise makes all measurements
    zero. An estimate of z(k) that uses the measurements up to k - 1 is the same for the opposite disturbance until T.
    """
    step = block([[system.A, system.B_d]])
    x, output, noise = zeros(system.order, 1), fmpq(0), fmpq(0)
    for k, d_k in enumerate(d):
        noise += squares(d_k) + squares(system.concealing((start + k) % system.phases, x))
        x = advanced(step, x, d_k)
        output += squares(system.W * x)
    return ratio(output, noise)


def ratio(output: fmpq, noise: fmpq) -> fmpq:
    """Output to noise; refused without noise."""
    decide(less(0, noise, "the disturbance is zero"))
    return output / noise

"""A continuous-time plant as a Kalman filter with time stamps sees it: its transition over any period, the recursion.

Phi(h) = e^{Ah}, Gamma(h) = int_0^h e^{As} ds B and Q(h) = int_0^h e^{As} Q e^{A's} ds are power series in h whose
coefficients are known beforehand, so that the same few lines give them in Python and in C. They are summed at h / 2^j,
where they converge fast, and doubled j times: Q(2h) = Q(h) + Phi(h) Q(h) Phi(h)'. No exponential of -A is formed, so
stiff plants do no harm (cf. C. F. Van Loan, IEEE TAC 23 (1978), who takes all three from one exponential).

Where the process noise is held, what a sample tells of it is kept until the next one: the state of the filter is then
[x; w]. Sources: B. D. O. Anderson and J. B. Moore, Optimal Filtering (1979), ch. 5; G. J. Bierman, Automatica 9 (1973),
for the smoother, which inverts no covariance of the state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt
import scipy

from replication.errors import InvalidInputError
from replication.estimation.api.export import c_file, source
from replication.estimation.api.plants import NOT_GIVEN, LinearPlant, numbered, parts_of
from replication.estimation.linear.riccati import symmetric
from replication.estimation.validation import Array, StateSpace, as_matrix, covariance, noise_factors, undetectable_mode

DEGREE = 18
"""With norm(A) h at most SHORT the first term left out is below 1e-16 of the sum."""
SHORT = 0.5


@dataclass(frozen=True, eq=False)
class Transition:
    """The power series of one plant.

    table (DEGREE + 1, n, 2n + m): coefficients of h^k in Phi, Gamma and Q; order, inputs: n and m; rate: norm of A in
    balanced units, 1/s.
    """

    table: Array
    order: int
    inputs: int
    rate: float

    @classmethod
    def of(cls, A: Array, B: Array, Q: Array) -> Self:
        """For A (n, n) in 1/s, inputs B (n, m) that are held, and white noise of intensity Q (n, n)."""
        n, m = B.shape
        balanced = scipy.linalg.matrix_balance(A, permute=False)[0]
        table = np.zeros((DEGREE + 1, n, 2 * n + m))
        power, held, spread = np.eye(n), np.array(B), np.array(Q)
        table[0, :, :n] = power
        for k in range(1, DEGREE + 1):
            # The integrals of the terms before are the terms of degree k.
            table[k, :, n:] = np.hstack([held, spread]) / k
            power, held = A @ power / k, A @ held / k
            spread = (A @ spread + spread @ A.T) / k
            table[k, :, :n] = power
        return cls(table, n, m, float(np.linalg.norm(balanced, 1)))

    def at(self, h: float) -> tuple[Array, Array, Array]:
        """Phi (n, n), Gamma (n, m) and Q (n, n) over h >= 0, s."""
        Phi, Gamma, Q = self.over(np.array([h]))
        return Phi[0], Gamma[0], Q[0]

    def over(self, h: Array) -> tuple[Array, Array, Array]:
        """The same over each of several times (U,): Phi (U, n, n), Gamma (U, n, m) and Q (U, n, n)."""
        n, m = self.order, self.inputs
        doublings = np.ceil(np.log2(np.maximum(self.rate * h / SHORT, 1.0)))
        powers = (h / 2.0**doublings)[:, None] ** np.arange(DEGREE + 1)
        whole = (powers @ self.table.reshape(DEGREE + 1, -1)).reshape(len(h), n, -1)
        Phi, Gamma, Q = whole[..., :n], whole[..., n : n + m], whole[..., n + m :]
        for left in range(int(doublings.max(initial=0.0)), 0, -1):
            on = (doublings >= left)[:, None, None]
            Q = np.where(on, Q + Phi @ Q @ Phi.mT, Q)
            Gamma, Phi = np.where(on, Gamma + Phi @ Gamma, Gamma), np.where(on, Phi @ Phi, Phi)
        return Phi, Gamma, symmetric(Q)


USAGE = """\
obs_init(&s, NULL) or, with a start of OBS_ESTIMATES numbers, obs_init(&s, start); then for each sample
   obs_step(&s, t, u, y, estimate): t is its time stamp in seconds, u holds OBS_INPUTS known inputs from t on (NULL:
   as before), y holds OBS_MEASUREMENTS measurements (all of them or, of a Kalman filter, NAN where a sensor did not
   measure; NULL: there is no sample, only the input changes), and estimate receives the estimate of the OBS_ESTIMATES
   states at t. obs_predict(&s, t, estimate) gives that at a later time. Both return 0, or 1 and change nothing if a
   number is not finite, t is not later than the sample before, or it is before the newest input."""


def c_form(
    name: str, comment: str, transition: Transition, output: Array, inputs: int, own: Mapping[str, Array]
) -> str:
    """The C99 source; `name` begins every name in it, `comment` stands at the top.

    output: C; inputs: how many of those of `transition` are known. own: "gain" and "edges", G of a filter by the
    period before; or "noise" and "start", R and P0 of a Kalman filter. Raises InvalidInputError if `name` is no C
    identifier.
    """
    n, drives, fixed = transition.order, transition.inputs, "gain" in own
    phi, gamma, q = np.split(transition.table, [n, n + drives], axis=2)
    tables = {"phi": phi, "gamma": gamma, "q": q, "rate": np.array([transition.rate, SHORT]), "output": output}
    tables |= {"start": np.zeros(1), "origin": np.zeros(n), **own}
    sizes = {"estimates": n, "inputs": inputs, "held": drives - inputs, "drives": drives, "mean": n + drives - inputs}
    sizes |= {"measurements": len(output), "degree": DEGREE, "gaps": int(not fixed)}
    # A filter of fixed gains keeps no covariance.
    sizes |= {"cells": len(own["gain"]) if fixed else 1, "spread": 1 if fixed else n * n}
    body = source("stamped.c", "series.c", *(["fixed.c"] if fixed else ["weighed.c", "linear.c"]))
    return c_file(name, comment, USAGE, body, sizes, tables)


@dataclass(frozen=True, eq=False)
class NoisyPlant(LinearPlant):
    """x' = Ax + B_u u + w between the samples y = Cx + v, whose instants are known; u is held from sample to sample.

    Without S the noise w is white with intensity Q. With S it is held: w keeps one value, of covariance Q, from each
    sample to the next, and S is its covariance with the noise v of the sample at which it starts. The plant may be
    unstable or integrate.

    Parameters
    ----------
    A : array (n, n)
        Dynamics, in 1/s.
    C : array (q, n)
        One row for each sensor.
    Q : array (n, n)
        Intensity of the white process noise, in squared units of the states per second; covariance if it is held.
    R : array (q, q) or (q,)
        Covariance of the sensors' noise, positive definite; a vector holds the variances of independent sensors.
    B_u : array (n, m), optional
        Effect of known inputs.
    S : array (n, q), optional
        Covariance of the held process noise with the sensors' noise.
    P0 : array (n, n), optional
        Covariance of x^(0) - x(0); the identity unless given.
    sensors : sequence of str, optional
        Names of the q sensors; y[0], y[1] and so on unless given.

    Raises
    ------
    InvalidInputError
        A shape does not fit, Q, R or P0 is no covariance, S does not fit to Q and R, a name stands twice, or an
        unstable mode is not seen by any sensor.

    Examples
    --------
    >>> cart = NoisyPlant([[0, 1], [0, 0]], [[1, 0]], Q=[[0, 0], [0, 0.1]], R=[0.01], sensors=["camera"])
    >>> cart.sensors
    ('camera',)
    """

    SHAPES: ClassVar[Mapping[str, str]] = {"A": "nn", "C": "qn", "B_u": "nu"}

    A: Array
    C: Array
    Q: Array
    R: Array
    B_u: Array = NOT_GIVEN
    S: Array | None = None
    P0: Array = NOT_GIVEN
    sensors: Sequence[str] = NOT_GIVEN

    def __post_init__(self) -> None:
        sizes = self.check()
        settle_noise(self, self.Q, sizes["n"], sizes["q"], "row of C")
        object.__setattr__(self, "Q", covariance("Q", self.Q, sizes["n"]))
        if self.S is not None:
            object.__setattr__(self, "S", as_matrix("S", self.S))
        if (mode := undetectable_mode(self.A, self.C, discrete=False)) is not None:
            raise InvalidInputError(
                f"no sensor sees the mode {mode:.6g}, which does not decay: its error would grow for ever; measure it, "
                "or leave it out of the plant"
            )

    @property
    def inputs(self) -> int:
        """m, the number of known inputs."""
        return len(self.B_u.T)

    @classmethod
    def from_statespace(cls, system: StateSpace, Q: Any, R: Any, *, S: Any | None = None, P0: Any = None) -> Self:
        """From a continuous-time `control.StateSpace` with known inputs u and outputs y, whose labels name the sensors.

        Parameters
        ----------
        system : control.StateSpace
            Continuous-time, without feedthrough.
        Q, R, S, P0 : see there
            As in `NoisyPlant`.

        Returns
        -------
        NoisyPlant
            The same matrices.

        Raises
        ------
        InvalidInputError
            The system is not continuous-time or has feedthrough; or as `NoisyPlant`.
        """
        parts = parts_of(system, continuous=True, disturbances=())
        if np.any(parts.D_u):
            raise InvalidInputError("the plant must have no feedthrough from u to y: set D to zero, and take y - D u")
        return cls(parts.A, parts.C, Q, R, parts.B_u, S, P0, parts.signals.measurements)


def settle_noise(plant: Any, Q: Any, n: int, q: int, what: str) -> None:
    """Check and freeze R, P0 (the identity unless given) and the names of the sensors, one for each `what`."""
    noise_factors(Q, plant.R, plant.S, disturbances=n, sensors=q)  # refuses what is no covariance
    labels = plant.sensors
    names = numbered("y", q) if labels is None else () if isinstance(labels, str) else tuple(labels)
    if len(names) != q or len(set(names)) < q or not all(isinstance(name, str) for name in names):
        raise InvalidInputError(f"sensors must be {q} different names, one for each {what}, got {labels!r}")
    P0 = np.eye(n) if plant.P0 is None else plant.P0
    fields = {"R": covariance("R", plant.R, q), "P0": covariance("P0", P0, n), "sensors": names}
    for name, value in fields.items():
        object.__setattr__(plant, name, value)


@dataclass(frozen=True, eq=False)
class Estimate:
    """An estimate x (n,) of the state at time t (s), and the covariance P (n, n) of its error."""

    t: float
    x: Array
    P: Array


@dataclass(frozen=True, eq=False)
class Instant:
    """What the filter knows at the time t of a sample.

    y (q,): the sample, NaN where a sensor did not measure; u (m,): the input from t on; prior: x^(k|k-1); mean and
    covariance: those after the sample, of x or [x; w]; used (q,): the sensors that measured, within the gate;
    innovation and spread: of these.
    """

    t: float
    y: Array
    u: Array
    prior: Estimate
    mean: Array
    covariance: Array
    innovation: Array
    spread: Array
    used: npt.NDArray[np.bool_]

    @property
    def gated(self) -> int:
        """How many of the numbers were beyond the gate."""
        return int(np.sum(~np.isnan(self.y) & ~self.used))


@dataclass(frozen=True, eq=False)
class Recursion:
    """The plant, its transitions with [B_u, I] as inputs, the known ones and held noise, and the gate (0 for none)."""

    plant: NoisyPlant
    transition: Transition
    gate: float = 0.0

    @classmethod
    def of(cls, plant: NoisyPlant, gate: float = 0.0) -> Self:
        """The recursion of a plant."""
        n = plant.order
        white = np.zeros((n, n)) if plant.S is not None else plant.Q
        return cls(plant, Transition.of(plant.A, np.hstack([plant.B_u, np.eye(n)]), white), gate)

    def output(self, x: Array) -> tuple[Array, Array]:
        """What the sensors are expected to measure at x (q,), and by how much it changes with x (q, n)."""
        return self.plant.C @ x, self.plant.C

    def update(self, prior: Estimate, y: Array, u: Array) -> Instant:
        """Take the entries of y (q,) that are numbers within the gate; with held noise all must be."""
        plant, n = self.plant, self.plant.order
        used, (expected, C) = ~np.isnan(y), self.output(prior.x)
        if self.gate and np.any(used):
            variances = np.einsum("qa,ab,qb->q", C, prior.P, C) + np.diag(plant.R)
            used &= np.abs(np.where(used, y - expected, 0.0)) <= self.gate * np.sqrt(variances)
        C, R = C[used], plant.R[np.ix_(used, used)]
        mean, covariance = prior.x, prior.P
        output, crossed = C, np.zeros((n, len(C)))
        if plant.S is not None:
            mean, covariance = np.concatenate([mean, np.zeros(n)]), scipy.linalg.block_diag(covariance, plant.Q)
            output, crossed = np.hstack([C, np.zeros_like(C)]), np.vstack([crossed, plant.S[:, used]])
        innovation = y[used] - expected[used]
        spread = symmetric(C @ prior.P @ C.T + R)
        if len(C):
            gain = np.linalg.solve(spread, (covariance @ output.T + crossed).T).T
            rest = np.eye(len(mean)) - gain @ output
            # Joseph's form: a sum of squares, as long as the noise is one.
            covariance = symmetric(
                rest @ covariance @ rest.T + gain @ R @ gain.T - rest @ crossed @ gain.T - gain @ crossed.T @ rest.T
            )
            mean = mean + gain @ innovation
        return Instant(prior.t, y, u, prior, mean, covariance, innovation, spread, used)

    def predict(self, known: Instant, t: float) -> Estimate:
        """x^ and its covariance at t, not before `known.t`, under the input that is held."""
        m = len(known.u)
        Phi, Gamma, spread = self.transition.at(t - known.t)
        whole = np.hstack([Phi, Gamma[:, m:]])[:, : len(known.mean)]
        x = whole @ known.mean + Gamma[:, :m] @ known.u
        return Estimate(t, x, symmetric(whole @ known.covariance @ whole.T) + spread)

    def smooth(self, instants: Sequence[Instant]) -> list[Estimate]:
        """The estimate at each instant from all samples of all of them, for white noise."""
        n = self.plant.order
        pull, weight = np.zeros(n), np.zeros((n, n))
        estimates: list[Estimate] = []
        following: Instant | None = None
        for instant in reversed(instants):
            if following is not None:
                Phi = self.transition.at(following.t - instant.t)[0]
                pull, weight = Phi.T @ pull, Phi.T @ weight @ Phi
            x, P = instant.mean[:n], instant.covariance[:n, :n]
            estimates.append(Estimate(instant.t, x + P @ pull, symmetric(P - P @ weight @ P)))
            C = self.plant.C[instant.used]
            scaled = np.linalg.solve(instant.spread, np.column_stack([instant.innovation, C]))
            rest = np.eye(n) - instant.prior.P @ C.T @ scaled[:, 1:]
            pull = C.T @ scaled[:, 0] + rest.T @ pull
            weight = symmetric(C.T @ scaled[:, 1:] + rest.T @ weight @ rest)
            following = instant
        return estimates[::-1]

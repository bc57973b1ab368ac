"""Plants with delays, noise and known inputs, as validated frozen data.

x'(t) = A_0 x(t) + sum_i (A_i x(t - tau_i) + B_i w(t - tau_i) + B_ui u(t - tau_i) + mean_i[A_s x]) + B w(t) + B_u u(t),
z(t) = C_10 x(t) + sum_i (C_1i x(t - tau_i) + mean_i[C_1s x]) + D_11 w(t),
y(t) = C_2 x(t) + sum_i (C_2i x(t - tau_i) + D_21i w(t - tau_i) + mean_i[C_2s x]) + D_21 w(t),

where mean_i[M x] = (1/tau_i) * integral over 0 <= s <= tau_i of sum_k M_ik (s/tau_i)^k x(t - s): an average over the
delay, whose weight is a polynomial of the age s.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any, Self

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.plants import Signals
from replication.estimation.validation import Array, as_matrix, noise_factors, positive_scalar

Matrices = tuple[Array, ...]
HIGHEST_POWER = 5
"""Of the age in the weight of an average; a higher one asks for a degree whose program is too large."""
ONCE = {"a0": "nn", "b": "nr", "c10": "pn", "c2": "qn", "d11": "pr", "d21": "qr", "b_u": "nm"}
PER_DELAY = {"a": "nn", "c1": "pn", "b_delayed": "nr", "c2_delayed": "qn", "d21_delayed": "qr", "b_u_delayed": "nm"}
SPREAD = {"a_spread": "nn", "c1_spread": "pn", "c2_spread": "qn"}
KINDS = ONCE | PER_DELAY | SPREAD
"""Rows and columns of each field: n states, p outputs to estimate, q measurements, r disturbances, m known inputs."""


@dataclass(frozen=True)
class DelayPlant:
    """Plant with n states, r disturbances w, m known inputs u, p outputs z to estimate, q measurements y, K delays.

    What is not given is zero; without the terms from `b_delayed` on this is the plant of `delay_system`.

    Attributes
    ----------
    a0 : array (n, n)
        A_0, in 1/s.
    delays : sequence of K floats
        tau_1 < ... < tau_K, s.
    b : array (n, r)
        B.
    c10 : array (p, n)
        C_10.
    c2 : array (q, n)
        C_2.
    a : sequence of K arrays (n, n)
        A_1 ... A_K, in 1/s.
    c1 : sequence of K arrays (p, n)
        C_11 ... C_1K.
    b_delayed : sequence of K arrays (n, r)
        B_1 ... B_K.
    c2_delayed : sequence of K arrays (q, n)
        C_21 ... C_2K.
    d11 : array (p, r)
        D_11.
    d21 : array (q, r)
        D_21, the sensor noise.
    d21_delayed : sequence of K arrays (q, r)
        D_211 ... D_21K.
    b_u : array (n, m)
        B_u.
    b_u_delayed : sequence of K arrays (n, m)
        B_u1 ... B_uK.
    a_spread : sequence of K arrays (k, n, n)
        A_s, in 1/s, which acts on a mean and no integral: for each delay the coefficients of the powers 0, 1, .. of
        age / delay in the weight of the mean over the delay, (1/tau_i) int_0^tau_i sum_k A_sk (s/tau_i)^k x(t - s) ds.
    c1_spread : sequence of K arrays (k, p, n)
        C_1s, of the same means.
    c2_spread : sequence of K arrays (k, q, n)
        C_2s, of the same means: [[C]] for a sensor that gives the average of C x over the delay.
    ranges : sequence of K pairs of floats
        Shortest and longest delay where a delay is known only within a range, s; (tau_i, tau_i) unless given.

    Raises
    ------
    InvalidInputError
        Wrong shapes, delays that are not positive and increasing, a range that does not hold its delay, or averages of
        too high a power.

    Examples
    --------
    >>> heater = DelayPlant([[-1.0]], [0.5], [[1.0, 0.0]], [[1.0]], [[0.0]], c2_delayed=[[[1.0]]], d21=[[0.0, 0.1]])
    >>> heater.noiseless
    False
    """

    a0: Array
    delays: tuple[float, ...]
    b: Array
    c10: Array
    c2: Array
    a: Matrices = ()
    c1: Matrices = ()
    b_delayed: Matrices = ()
    c2_delayed: Matrices = ()
    d11: Array = None  # type: ignore[assignment]
    d21: Array = None  # type: ignore[assignment]
    d21_delayed: Matrices = ()
    b_u: Array = None  # type: ignore[assignment]
    b_u_delayed: Matrices = ()
    a_spread: Matrices = ()
    c1_spread: Matrices = ()
    c2_spread: Matrices = ()
    ranges: tuple[tuple[float, float], ...] = ()

    def __new__(cls, *_: Any, **named: Any) -> Self:
        """Tell the name of a field that is written as in a plant file."""
        known = {field.name for field in fields(cls)}
        for name in named:
            if name not in known and name.lower() in known:
                raise InvalidInputError(f"{name} is the name in a plant file; in Python write {name.lower()}=")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        """Check every field and fill in what was not given."""
        for name, value in _checked(self).items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_covariances(cls, *, Q: Any, R: Any, S: Any = None, b: Any = None, **terms: Any) -> Self:
        """The plant whose white noise has given intensities: d drives the states by `b`, n disturbs the sensors.

        Parameters
        ----------
        Q : array (m, m)
            Intensity of d, positive semidefinite.
        R : array (q, q) or (q,)
            Intensity of n, positive definite; a vector holds those of independent sensors.
        S : array (m, q), optional
            Intensity of d and n together; zero unless given.
        b : array (n, m), optional
            Effect of d; the identity unless given: each state has its own.
        terms : array
            The other fields, `b_delayed` (n, m) among them; not d11, d21 or d21_delayed.

        Returns
        -------
        DelayPlant
            With noise w of unit intensity, m + q of it.

        Raises
        ------
        InvalidInputError
            A matrix is no intensity, S does not fit, or a field is wrong or not one of these.

        Examples
        --------
        >>> late = DelayPlant.from_covariances(Q=[[4]], R=[[9]], a0=[[0]], delays=[1], c10=[[1]], c2=[[1]])
        >>> late.b.tolist(), late.d21.tolist()
        ([[2.0, 0.0]], [[0.0, 3.0]])
        """
        known = {field.name for field in fields(cls)} - {"b", "d11", "d21", "d21_delayed"}
        if unknown := sorted(terms.keys() - known):
            raise InvalidInputError(f"{unknown[0]} does not go with Q and R; there are: {', '.join(sorted(known))}")
        if missing := [name for name in ("a0", "delays", "c10", "c2") if terms.get(name) is None]:
            raise InvalidInputError(f"{missing[0]} is missing; give a0, delays, c10 and c2")
        sensors = as_matrix("c2", terms["c2"]).shape[0]
        B = np.eye(len(as_matrix("a0", terms["a0"]))) if b is None else as_matrix("b", b)
        noise = noise_factors(Q, R, S, disturbances=B.shape[1], sensors=sensors)
        drive = np.hstack([noise.F, noise.E])
        if terms.get("b_delayed"):
            late = listed("b_delayed", terms["b_delayed"])
            terms["b_delayed"] = [
                as_matrix(f"b_delayed[{i}]", part, columns=B.shape[1]) @ drive for i, part in enumerate(late)
            ]
        return cls(b=B @ drive, d21=np.hstack([np.zeros((sensors, noise.F.shape[1])), noise.D]), **terms)

    @property
    def states(self) -> int:
        """Number of states n."""
        return int(self.a0.shape[0])

    @property
    def delay_count(self) -> int:
        """Number of delays K."""
        return len(self.delays)

    @property
    def inputs(self) -> int:
        """Number of disturbances r."""
        return int(self.b.shape[1])

    @property
    def outputs(self) -> int:
        """Number of outputs to estimate p."""
        return int(self.c10.shape[0])

    @property
    def measurements(self) -> int:
        """Number of measurements q."""
        return int(self.c2.shape[0])

    @property
    def known_inputs(self) -> int:
        """Number of known inputs m."""
        return int(self.b_u.shape[1])

    @property
    def signals(self) -> Signals:
        """x[0], u[0], y[0], z[0] and so on."""
        return Signals.numbered(self.states, self.known_inputs, self.measurements, self.outputs)

    @property
    def noiseless(self) -> bool:
        """Whether it is a plant of `delay_system`: y = C_2 x, no other delayed or known term."""
        more = (self.d11, self.d21, self.b_u, *self.b_delayed, *self.c2_delayed, *self.d21_delayed)
        spread = (*self.b_u_delayed, *self.a_spread, *self.c1_spread, *self.c2_spread)
        return not any(np.any(part) for part in (*more, *spread))


def delay_system(
    a0: Any, a: Sequence[Any], delays: Sequence[float], b: Any, c10: Any, c2: Any, c1: Sequence[Any] | None = None
) -> DelayPlant:
    """The plant of eq. (1), checked.

    Parameters
    ----------
    a0, a, delays, b, c10, c2, c1 : see there
        As in `DelayPlant`; the measurements are of full row rank.

    Returns
    -------
    DelayPlant
        The matrices as read-only arrays.

    Raises
    ------
    InvalidInputError
        Non-positive, equal or unordered delays, wrong shapes, no disturbance or output, entries that are not finite, or
        dependent rows of C_2 (then a measurement is redundant or zero).
    """
    delays = checked_delays(delays)
    late = {"a": listed("a", a)} | ({} if c1 is None else {"c1": listed("c1", c1)})
    for name, matrices in late.items():
        if not matrices:
            raise InvalidInputError(f"{name} must hold one matrix per delay, got none; for none use zeros")
    plant = DelayPlant(a0, delays, b, c10, c2, **late)  # type: ignore[arg-type]
    require_independent(plant.c2)
    return plant


def require_independent(c2: Array) -> None:
    """Raise InvalidInputError unless the measurements, free of noise, have full row rank."""
    rank = int(np.linalg.matrix_rank(c2))
    if rank < len(c2):
        raise InvalidInputError(
            f"c2 must have full row rank, got {len(c2)} rows of rank {rank}; drop redundant measurements"
        )


def checked_delays(delays: Any) -> tuple[float, ...]:
    """At least one, positive and increasing (s); raises InvalidInputError otherwise."""
    times = tuple(positive_scalar(f"delays[{i}]", value, unit="s") for i, value in enumerate(listed("delays", delays)))
    if not times:
        raise InvalidInputError("delays must hold at least one delay; for none use a zero matrix and any delay")
    if any(later <= earlier for earlier, later in pairwise(times)):
        raise InvalidInputError(f"delays must increase strictly, got {times}; sort them together with their matrices")
    return times


def listed(name: str, value: Any) -> list[Any]:
    """The entries of what is given for each delay; raises InvalidInputError if it has none to list."""
    try:
        return list(value)
    except TypeError as error:
        raise InvalidInputError(f"{name} must be a list with one entry per delay, got {value!r}") from error


def _checked(plant: DelayPlant) -> dict[str, Any]:
    """The fields by name as read-only arrays and tuples of them."""
    values = {field.name: getattr(plant, field.name) for field in fields(plant)}
    n = as_matrix("a0", values["a0"]).shape[0]
    if n < 1:
        raise InvalidInputError("a0 must have at least one state, got shape (0, 0)")
    r, p, q, m = (
        as_matrix(name, values[name]).shape[axis] if values[name] is not None else 0
        for name, axis in (("b", 1), ("c10", 0), ("c2", 0), ("b_u", 1))
    )
    if values["b_u"] is None and len(listed("b_u_delayed", values["b_u_delayed"])):
        m = as_matrix("b_u_delayed[0]", values["b_u_delayed"][0]).shape[1]
    if min(r, p, q) < 1:
        raise InvalidInputError(
            f"b must have a column, c10 and c2 a row, got {r} columns and {p} and {q} rows; for none use zeros"
        )
    delays = checked_delays(values["delays"])
    sizes = {"n": n, "p": p, "q": q, "r": r, "m": m}
    checked: dict[str, Any] = {"delays": delays, "ranges": _ranges(values["ranges"], delays)}
    for name, kinds in KINDS.items():
        shape, value = (sizes[kinds[0]], sizes[kinds[1]]), values[name]
        if name in ONCE:
            checked[name] = _matrix(name, np.zeros(shape) if value is None else value, shape)
        else:
            checked[name] = _per_delay(name, value, len(delays), shape, _matrix if name in PER_DELAY else _weights)
    return checked


def _ranges(value: Any, delays: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
    """Ends of the ranges, each around its delay."""
    pairs = listed("ranges", value) or [(delay, delay) for delay in delays]
    if len(pairs) != len(delays):
        raise InvalidInputError(f"ranges must hold one pair per delay: {len(delays)} delays, {len(pairs)} pairs")
    checked = []
    for i, (pair, delay) in enumerate(zip(pairs, delays, strict=True)):
        ends = listed(f"ranges[{i}]", pair)
        if len(ends) != 2:
            raise InvalidInputError(f"ranges[{i}] must be a pair (shortest, longest) in s, got {pair!r}")
        low, high = (positive_scalar(f"ranges[{i}][{j}]", end, unit="s") for j, end in enumerate(ends))
        if not low <= delay <= high:
            raise InvalidInputError(
                f"ranges[{i}] must be (shortest, longest) around delays[{i}] = {delay:g} s, got ({low:g}, {high:g})"
            )
        checked.append((low, high))
    return tuple(checked)


def _per_delay(
    name: str, values: Any, count: int, shape: tuple[int, int], read: Callable[[str, Any, tuple[int, int]], Array]
) -> Matrices:
    """One value per delay, each as `read` takes it; zeros if there are none."""
    each = listed(name, values) or [np.zeros(shape)] * count
    if len(each) != count:
        raise InvalidInputError(f"{name} must hold one matrix per delay: {count} delays, {len(each)} matrices")
    return tuple(read(f"{name}[{i}]", value, shape) for i, value in enumerate(each))


def _matrix(name: str, value: Any, shape: tuple[int, int]) -> Array:
    return as_matrix(name, value, rows=shape[0], columns=shape[1])


def _weights(name: str, value: Any, shape: tuple[int, int]) -> Array:
    """Coefficients (k, rows, columns) of the powers of the age; one matrix is a constant weight."""
    powers = listed(name, value)
    matrices = [powers] if np.ndim(powers) == 2 else powers
    if not 1 <= len(matrices) <= HIGHEST_POWER + 1:
        raise InvalidInputError(
            f"{name} must hold the coefficients of 1 to {HIGHEST_POWER + 1} powers of the age, got {len(matrices)}; "
            f"fit a weight of degree {HIGHEST_POWER} at most"
        )
    weights = np.stack([_matrix(f"{name}[{k}]", matrix, shape) for k, matrix in enumerate(matrices)])
    weights.flags.writeable = False
    return weights

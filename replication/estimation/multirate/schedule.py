"""Sensing schedules: which sensor measures at which instant, the matrices S_k of eq. (4)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import lcm, prod
from typing import Any

import numpy as np
import numpy.typing as npt

from replication.errors import InvalidInputError
from replication.estimation.validation import Array, positive_integer

MAX_PERIOD = 100_000
"""Instants after which a schedule must repeat: all methods keep matrices for each of them."""
MAX_OFFSETS = 100_000
"""Sets of offsets that are listed; to compute the optimum of more would take days."""


@dataclass(frozen=True)
class SensingSchedule:
    """Sensor i measures at the instants k with (k - offsets[i]) mod periods[i] == 0.

    periods: N_i >= 1, in base periods. offsets: 0 <= theta_i < N_i, zeros unless given. Raises InvalidInputError for a
    period that is not a whole positive number, an offset out of range, lengths that do not match, or periods whose
    least common multiple exceeds MAX_PERIOD.
    """

    periods: tuple[int, ...]
    offsets: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Check the periods and offsets."""
        given = _as_tuple("periods", self.periods)
        periods = tuple(positive_integer(f"periods[{i}]", N) for i, N in enumerate(given))
        if not periods:
            raise InvalidInputError("periods must name at least one sensor")
        if lcm(*periods) > MAX_PERIOD:
            raise InvalidInputError(
                f"periods {periods} repeat together only every {lcm(*periods)} instants, more than {MAX_PERIOD}; "
                "choose periods with common factors, or a longer base period"
            )
        offsets = _as_tuple("offsets", self.offsets) or (0,) * len(periods)
        if len(offsets) != len(periods):
            raise InvalidInputError(f"offsets must have one entry per sensor ({len(periods)}), got {len(offsets)}")
        for i, (N, theta) in enumerate(zip(periods, offsets, strict=True)):
            if isinstance(theta, bool) or not isinstance(theta, (int, np.integer)) or not 0 <= theta < N:
                raise InvalidInputError(f"offsets[{i}] must be a whole number from 0 to {N - 1}, got {theta!r}")
        object.__setattr__(self, "periods", periods)
        object.__setattr__(self, "offsets", tuple(int(theta) for theta in offsets))

    @property
    def sensors(self) -> int:
        """q, the number of sensors."""
        return len(self.periods)

    @property
    def period(self) -> int:
        """N, the least common multiple of the sensing periods."""
        return lcm(*self.periods)

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Shape (N, q): whether sensor i measures at instant k."""
        instants = np.arange(self.period)[:, None]
        mask: npt.NDArray[np.bool_] = (instants - np.array(self.offsets)) % np.array(self.periods) == 0
        mask.flags.writeable = False
        return mask

    def measured(self, k: int) -> tuple[int, ...]:
        """The sensors that measure at instant k, in order."""
        return self._rows[k % self.period]

    @cached_property
    def _rows(self) -> tuple[tuple[int, ...], ...]:
        return tuple(tuple(np.flatnonzero(row).tolist()) for row in self.mask)

    def selection(self, k: int) -> Array:
        """S_k of eq. (4), shape (q, q)."""
        return np.diag(self.mask[k % self.period].astype(float))


def _as_tuple(name: str, value: Any) -> tuple[Any, ...]:
    if not isinstance(value, (Sequence, np.ndarray)) or isinstance(value, str) or np.ndim(value) != 1:
        raise InvalidInputError(f"{name} must be a sequence with one entry per sensor, got {value!r}")
    return tuple(value)


def distinct_offsets(periods: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """Offsets with theta_1 = 0, one for each schedule that differs by more than a shift of the origin.

    For two sensors these are theta_2 = 0 ... gcd(N_1, N_2) - 1. Raises InvalidInputError for a period not whole, or
    periods with more than MAX_OFFSETS sets of offsets.
    """
    reference = SensingSchedule(_as_tuple("periods", periods))
    count = prod(reference.periods[1:])
    if count > MAX_OFFSETS:
        raise InvalidInputError(
            f"periods {reference.periods} leave {count} sets of offsets, more than {MAX_OFFSETS}; fix some of the "
            "offsets yourself and compare the optima of the others"
        )
    seen: set[tuple[int, ...]] = set()
    for tail in product(*(range(N) for N in reference.periods[1:])):
        offsets = (0, *tail)
        # A shift of the origin by a multiple of N_1 keeps theta_1 = 0; the least of the shifted offsets stands for all.
        shifted = (
            tuple((theta + s) % N for theta, N in zip(offsets, reference.periods, strict=True))
            for s in range(0, reference.period, reference.periods[0])
        )
        representative = min(shifted)
        if representative not in seen:
            seen.add(representative)
            yield representative

"""Plants for the tests of nonuniform sampling: the two of the source paper's kind, and generated stable ones."""

import numpy as np
from hypothesis import strategies as st

from replication.estimation.nonuniform.filters import Filter, deadbeat_filter, riccati_filter, riccati_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant

OSCILLATOR = SampledPlant([[0, 1], [-16, -4.8]], [[0], [16]], [[1, 0]], [[0.1]], [[1, 0]])
OSCILLATOR_RANGE = PeriodRange(0.01, np.pi / 25)
MOTOR = SampledPlant([[-10, 1], [-0.02, -2]], [[2], [2]], [[1, 0]], [[0]], [[0, 1]])
MOTOR_RANGE = PeriodRange(0.001, 0.099)


def oscillator_filter() -> Filter:
    return riccati_level(OSCILLATOR, OSCILLATOR_RANGE.middle, tolerance=1e-7).filter


def motor_filter() -> Filter:
    return deadbeat_filter(MOTOR, MOTOR_RANGE.middle)


def random_plant(rng: np.random.Generator, n: int, m: int = 2, r: int = 1, s: int = 1) -> SampledPlant:
    A = rng.standard_normal((n, n))
    A = A - (np.max(np.linalg.eigvals(A).real) + 0.3) * np.eye(n)
    return SampledPlant(
        A,
        rng.standard_normal((n, m)),
        rng.standard_normal((r, n)),
        rng.standard_normal((r, m)),
        rng.standard_normal((s, n)),
    )


@st.composite
def stable_plants(draw: st.DrawFn) -> SampledPlant:
    """Random stable plants of order 1 to 3 with noisy measurements."""
    seed = draw(st.integers(0, 2**32 - 1))
    return random_plant(np.random.default_rng(seed), draw(st.integers(1, 3)))


def some_filter(plant: SampledPlant, h: float) -> Filter:
    """A stable filter near the optimum at period h, not at it."""
    level = riccati_level(plant, h, tolerance=1e-3).level * 1.2
    design = riccati_filter(plant, h, level)
    assert design is not None
    return design.filter

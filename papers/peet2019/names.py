"""Names of the experiments, and which of them are run: one place for claims, errata and figures to refer to."""

from __future__ import annotations

from papers.peet2019.data import DELAY_COUNTS, EXAMPLES, KEY, STATES

DEGREES = (1, 2, 3)
FIGURE_DEGREE = 4
"""The text gives degree 4 for the level 2.327 of Example 2."""

LARGEST_DEFAULT = 15
"""Cells of Table I up to this product n·K are run by default with the full cone of degree 1."""

LARGEST_SMALL_CONE = 30
"""Cells from there to this product are run with the small cone; `benchmarks/bench_delay.py --full` runs all."""


def reference(example: str) -> str:
    """Roots, Padé, collocation and exact gain of an example."""
    return f"{KEY}.reference.ex{example}"


def sensitivity(example: str) -> str:
    """The level by Padé while printed parameters move within their rounding."""
    return f"{KEY}.sensitivity.ex{example}"


def sos(example: str, degree: int) -> str:
    """Theorem 3 for an example at one degree."""
    return f"{KEY}.sos.ex{example}.d{degree}"


def small(example: str) -> str:
    """One disturbance on all states of an example."""
    return f"{KEY}.small.ex{example}"


def loop(name: str) -> str:
    """A closed loop of returned gains."""
    return f"{KEY}.loop.{name}"


def cell(states: int, delays: int) -> str:
    """A cell of Table I."""
    return f"{KEY}.ex4.n{states}k{delays}"


def default_cells() -> tuple[tuple[int, int], ...]:
    """Cells (n, K) of the default run."""
    return tuple((n, k) for k in DELAY_COUNTS for n in STATES if n * k <= LARGEST_DEFAULT)


def small_cone_cells() -> tuple[tuple[int, int], ...]:
    """Larger cells (n, K) of the default run, by the small cone."""
    return tuple((n, k) for k in DELAY_COUNTS for n in STATES if LARGEST_DEFAULT < n * k <= LARGEST_SMALL_CONE)


IDENTITIES = f"{KEY}.identities"
INVERSION = f"{KEY}.inversion"
PRINTED_SIGNS = f"{KEY}.printed-signs"
LUMPED = f"{KEY}.lumped"
GAINS = f"{KEY}.gains"
FIG_1 = f"{KEY}.fig1"
SIZES = f"{KEY}.sizes"
MEASURED = f"{KEY}.measured"
ROOTS = f"{KEY}.roots"
TAU = f"{KEY}.tau"
READINGS = f"{KEY}.readings"
EXAMPLE_NAMES = tuple(EXAMPLES)
OFF_THE_PRINT = ("2", "3")
"""Examples whose gain of degree 1 no degree rule gives."""


def convergence(example: str) -> str:
    """γ of the approximate models against their order."""
    return f"{KEY}.convergence.ex{example}"

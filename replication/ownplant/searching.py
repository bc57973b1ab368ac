"""Many computations of the same kind for a plant of one's own: on every core, with a bar that says what is left."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")
U = TypeVar("U")
FEW = 8
"""Up to so many the processes would take longer to start than to compute."""


def every_core(function: Callable[[T], U], items: Sequence[T]) -> Iterator[U]:
    """The values of `function` in the order of `items`, as `map` gives them, by one process per core.

    On a terminal a bar on standard error shows how many are done, and an estimate of the time left.
    """
    from rich.console import Console
    from rich.progress import track

    values = map(function, items) if len(items) <= FEW else _in_processes(function, items)
    yield from track(
        values,
        "timings",
        total=len(items),
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
    )


def _in_processes(function: Callable[[T], U], items: Sequence[T]) -> Iterator[U]:
    import joblib

    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        yield from joblib.Parallel(-1, return_as="generator")(joblib.delayed(function)(item) for item in items)

"""Many computations of the same kind for a plant of one's own: on every core, with a bar that says what is left."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

from replication import __version__

T = TypeVar("T")
U = TypeVar("U")
KEPT = "kept"
"""The folder of a store that holds the values; what else lies in the store is not ours."""
FEW = 8
"""Up to so many the processes would take longer to start than to compute."""


def every_core(function: Callable[[T], U], items: Sequence[T], *, store: Path | None = None) -> Iterator[U]:
    """The values of `function` in the order of `items`, as `map` gives them, by one process per core.

    store: a directory in which each value is kept as soon as it is there; what an earlier run with the same version of
    this package left there is not computed again. On a terminal a bar on standard error shows how many are done, and
    an estimate of the time left.
    """
    import joblib
    from rich.console import Console
    from rich.progress import track

    value = _value if store is None else joblib.Memory(store / KEPT, verbose=0).cache(_value)
    calls = [joblib.delayed(value)(function, item, __version__) for item in items]
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        yield from track(
            joblib.Parallel(-1 if len(items) > FEW else 1, return_as="generator")(calls),
            "timings",
            total=len(items),
            console=Console(stderr=True),
            transient=True,
            disable=not sys.stderr.isatty(),
        )


def forget(store: Path) -> None:
    """Remove what `every_core` kept in a store, and the directory if nothing else lies there."""
    shutil.rmtree(store / KEPT, ignore_errors=True)
    if store.is_dir() and not any(store.iterdir()):
        store.rmdir()


def _value(function: Callable[[T], U], item: T, release: str) -> U:
    """What is kept of a call: its key is made of the function with what is bound to it, the item and the release."""
    return function(item)

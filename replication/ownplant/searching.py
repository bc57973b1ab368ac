"""Many computations of the same kind for a plant of one's own: on every core, with a bar that says what is left."""

import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from replication import __version__
from replication.files import write_atomically

T = TypeVar("T")
U = TypeVar("U")
KEPT = "kept"
"""The folder of a store that holds the values; what else lies in the store is not ours."""
FEW = 8
"""Up to so many the processes would take longer to start than to compute."""


def every_core(function: Callable[[T], U], items: Sequence[T], *, store: Path | None = None) -> Iterator[U]:
    """The values of `function` in the order of `items`, as `map` gives them, by one process per core.

    store: a directory in which each value is kept as soon as it is there; what an earlier run with the same version of
    this package left there is not computed again. Those of a partial function are kept, whose return type is declared.
    On a terminal a bar on standard error shows how many are done, and an estimate of the time left.
    """
    import joblib
    from rich.console import Console
    from rich.progress import track

    value: Callable[[T], U] = function
    if store is not None and isinstance(function, partial):
        value = partial(_kept, store / KEPT, function)
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        yield from track(
            joblib.Parallel(-1 if len(items) > FEW else 1, return_as="generator")(
                joblib.delayed(value)(item) for item in items
            ),
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


def _kept(folder: Path, function: partial[U], item: Any) -> U:
    """The value from its file, else computed and written there.

    The folder may be a stranger's: its files are read as JSON of the type that the function returns, never as objects
    that bring code along, and one that is not whole is computed again.
    """
    import msgspec

    called = [__version__, function.func.__module__, function.func.__qualname__, function.args, item]
    key = sha256(msgspec.json.encode(called, enc_hook=_plain, order="deterministic")).hexdigest()
    path = folder / f"{key}.json"
    try:
        checksum, _, text = path.read_bytes().partition(b"\n")
        if checksum == _checksum(key, text):
            result: U = msgspec.json.decode(text, type=get_type_hints(function.func)["return"])
            return result
    except (OSError, msgspec.DecodeError):
        pass
    value = function(item)
    text = msgspec.json.encode(value)
    write_atomically(path, _checksum(key, text) + b"\n" + text)
    return value


def _checksum(key: str, text: bytes) -> bytes:
    return sha256(key.encode() + text).hexdigest().encode()


def _plain(argument: Any) -> Any:
    """An array or a path among the arguments as JSON can hold it."""
    return argument.tolist() if hasattr(argument, "tolist") else str(argument)

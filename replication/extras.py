"""Packages that only some papers need, by the extra of this distribution that installs them."""

from __future__ import annotations

EXTRAS = {
    "flint": "proofs",
    "scipy": "estimation",
    "cvxpy": "estimation",
    "clarabel": "estimation",
    "control": "estimation",
    "sdpap": "estimation",
}
"""The extra of each module that may be absent."""


def told(error: BaseException) -> str:
    """The message of an error on one line; of a module that an extra would install, with how to install it."""
    said = " ".join(str(error).split())
    extra = EXTRAS.get((error.name or "").partition(".")[0]) if isinstance(error, ModuleNotFoundError) else None
    return f'{said}; install it with `pip install "slow-sensor-replication[{extra}]"`' if extra else said

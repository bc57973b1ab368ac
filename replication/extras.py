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


def missing(error: BaseException) -> str:
    """The extra that installs what an import did not find; empty for any other error."""
    if not isinstance(error, ModuleNotFoundError):
        return ""
    return EXTRAS.get((error.name or "").partition(".")[0], "")


def told(error: BaseException) -> str:
    """The message of an error on one line; of a module that an extra installs, with how to install it."""
    said = " ".join(str(error).split())
    extra = missing(error)
    return f'{said}; install it with `pip install "slow-sensor-replication[{extra}]"`' if extra else said

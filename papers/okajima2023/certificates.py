"""Makes the certificates of the wanted theorems of this paper."""

from __future__ import annotations

from typing import Any

from replication.estimation.certificates import multirate
from replication.verify.subjects import subject

KEY = "okajima2023"
MAKERS = {
    "multirate.gain": multirate.gain,
    "multirate.optimum-noncausal": multirate.optimum_noncausal,
    "multirate.optimum-causal": multirate.optimum_causal,
}


def make(name: str) -> dict[str, Any]:
    """The certificate of one entry of theorems.json."""
    theorem = subject(KEY, name)
    return {**theorem, **MAKERS[theorem["statement"]](theorem)}

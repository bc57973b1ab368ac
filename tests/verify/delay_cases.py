"""The committed certificates of the delay paper, and why a tampered one is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from replication.verify.run import check
from replication.verify.theorem import Refused

FOLDER = Path(__file__).parents[2] / "certificates" / "peet2019"
Json = dict[str, Any]


def certificate(name: str) -> Json:
    found: Json = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return found


def refusal(given: Json, statement: Callable[[Json], object] = check) -> str:
    """Why a certificate is refused."""
    with pytest.raises(Refused) as caught:
        statement(given)
    return str(caught.value)

"""Theorems checked by Coq: statement and theory in `multirate/*.v`, files generated from certificates, and the run.

Here is what Coq reads beside certificates, and a sum of it all, without python-flint: the report asks whether what was
checked is what lies there.
"""

import hashlib
import json
from pathlib import Path

from replication.files import sum_of

THEORY = Path(__file__).parent / "multirate"
GAIN, SMOOTHER, PREDICTOR = "multirate.gain", "multirate.optimum-noncausal", "multirate.optimum-causal"
STATEMENTS = (GAIN, SMOOTHER, PREDICTOR)
"""The statements of the verifier that Coq checks too."""


def sum_for(folder: Path) -> str:
    """Of the theory, and of a paper's decimals and theorems that Coq states; `folder` is that of the paper."""
    path = folder / "theorems.json"
    listed = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []
    stated = json.dumps([entry for entry in listed if entry.get("statement") in STATEMENTS], sort_keys=True)
    files = sum_of([*sorted(THEORY.glob("*.v")), folder / "coq" / "Decimals.v"])
    return hashlib.sha256(f"{files} {stated}".encode()).hexdigest()

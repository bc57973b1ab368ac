"""Verifying one committed certificate as a task of a run; imports the verifier only, so that little renews it."""

from dataclasses import asdict
from pathlib import Path
from typing import Any


def prove(path: str, root: str, subject: dict[str, str]) -> dict[str, Any]:
    """What the certificate at `path` below `root` proves: sentence, bounds as rationals, or the reason why nothing.

    subject: checksums of what it depends on beside the verifier, which make it a new task when they change.
    """
    # Here, so that a run without certificates needs no python-flint.
    from replication.verify.reading import written
    from replication.verify.run import verify

    outcome = verify(Path(root) / path, Path(root))
    theorem = outcome.theorem
    if theorem is None:
        none: dict[str, Any] = {"lower": None, "upper": None, "holds": None, "items": [], "says": []}
        return {"sentence": "", "reason": outcome.reason, **none}
    return {
        "sentence": theorem.sentence,
        "reason": "",
        "lower": written(theorem.lower),
        "upper": written(theorem.upper),
        "holds": theorem.holds,
        "items": written(theorem.items),
        "says": [asdict(term) for term in theorem.says],
    }

"""Which programs beside the verifier have checked a certificate: what their last runs left beside the papers.

They take too long for every run, so that each records the checksums of the certificates that it accepted. A certificate
that has changed since does not count.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from replication.errors import AuditError


def machine_checked(folder: Path) -> tuple[str, dict[str, str]]:
    """What Coq left beside a paper: the file of its statement, and the checksum of each certificate, by name."""
    found = _left(folder / "machine-checked.json", "make coq", "statement", "certificates")
    return (found["statement"], found["certificates"]) if found else ("", {})


def checked_twice(folder: Path) -> dict[str, str]:
    """What the second verifier left: the checksum of each certificate of which both prove the same, by name."""
    found = _left(folder / "checked-twice.json", "make verify-both", "certificates")
    return dict(found.get("certificates", {}))


def _left(path: Path, command: str, *keys: str) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        return {key: record[key] for key in keys}
    except (ValueError, KeyError, TypeError) as error:
        raise AuditError(
            f"{path} is not what `{command}` writes ({error!r}); run it again, or remove the file"
        ) from None

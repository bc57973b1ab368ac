"""By what else a certificate is checked, a second arithmetic or Coq: what their last runs left beside the papers.

They take too long for every run, so that each records the checksums of the certificates that it accepted, and of all
that it read beside them. What has changed since does not count.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from replication.errors import AuditError
from replication.machine.generate import sum_for
from replication.twice import RECORD, second


def machine_checked(folder: Path, stated: Collection[str]) -> tuple[str, dict[str, str]]:
    """What Coq left beside a paper: the file of its statement, and the checksum of each certificate, by name.

    Nothing where the theory, the decimals or the list of theorems have changed since.
    stated: the theorems that Coq has a statement of. Raises AuditError if the record names another one.
    """
    found = _left(folder / "machine-checked.json", "make coq", "statement", "theory", "certificates")
    others = sorted(found.get("certificates", {}).keys() - set(stated))
    if others:
        raise AuditError(
            f"{folder / 'machine-checked.json'} names {', '.join(others)}, of which Coq has no statement; run "
            "`make coq` again, or remove the file"
        )
    fresh = found and found["theory"] == sum_for(folder)
    return (found["statement"], found["certificates"]) if fresh else ("", {})


def checked_twice(folder: Path, listed: Collection[str]) -> dict[str, str]:
    """What the second arithmetic left: the checksum of each certificate of which both prove the same, by name.

    Nothing where the second arithmetic has changed since. listed: the theorems that the paper wants. Raises AuditError
    if the record names another one.
    """
    found = _left(folder / RECORD, "make verify-both", "arithmetic", "certificates")
    others = sorted(found.get("certificates", {}).keys() - set(listed))
    if others:
        raise AuditError(
            f"{folder / RECORD} names {', '.join(others)}, which theorems.json does not; run `make verify-both` again"
        )
    return dict(found["certificates"]) if found and found["arithmetic"] == second() else {}


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

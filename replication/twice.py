"""Both verifiers on the same certificates: they share no code, and must say the same of each.

`python verify.py --both`. The first one needs python-flint, the second one the standard library alone.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from replication.files import write_atomically
from replication.recheck import run as second
from replication.recheck.reading import NoCheck, Proof, Unproved
from replication.verify.theorem import Refused
from replication.verify.workers import add_jobs, in_order

if TYPE_CHECKING:
    from replication.verify.run import Outcome

ROOT = Path(__file__).resolve().parents[1]
RECORD = "checked-twice.json"
"""Beside a paper: the checksums of the certificates of which both verifiers prove the same."""


@dataclass(frozen=True)
class Pair:
    """What both verifiers say of one certificate.

    checked: whether the second one has a check of the statement, and of its size. conflict: in what they differ; empty
    if they agree.
    """

    checked: bool
    conflict: str


def compared(outcome: Outcome, found: Proof | Unproved) -> Pair:
    """Whether both prove the same numbers, or both refuse."""
    if isinstance(found, NoCheck):
        return Pair(False, "")
    theorem = outcome.theorem
    if theorem is None or isinstance(found, Unproved):
        if theorem is None and isinstance(found, Unproved):
            return Pair(True, "")
        return Pair(True, f"the second refuses: {found}" if theorem else "the second proves what the first refuses")
    for side in ("lower", "upper"):
        one, other = _exact(getattr(theorem, side)), getattr(found, side)
        if one != other:
            return Pair(True, f"the {side} bound is {one} for the first, {other} for the second")
    if theorem.holds != found.holds:
        return Pair(True, f"whether it holds is {theorem.holds} for the first, {found.holds} for the second")
    # Each encloses the same numbers by itself, so that their ends differ.
    exported = tuple(item for said in theorem.says for item in said.items) if found.items else ()
    items = theorem.items or exported
    if len(items) != len(found.items) or not all(map(_meet, items, found.items)):
        return Pair(True, "the enclosures of the listed numbers do not meet")
    return Pair(True, "")


def _exact(value: object) -> Fraction | None:
    return None if value is None else Fraction(str(value))


def _meet(one: Sequence[object], other: tuple[Fraction, Fraction]) -> bool:
    low, high = (_exact(end) for end in one)
    return low is not None and high is not None and low <= other[1] and other[0] <= high


def _both(path: Path, root: Path) -> tuple[Outcome, Pair]:
    from replication.verify.run import verify

    outcome = verify(path, root)
    return outcome, compared(outcome, second.check(path, root))


def _lost(path: Path) -> tuple[Outcome, Pair]:
    from replication.verify.run import lost

    return lost(path), Pair(False, "")


def report(paths: Sequence[Path], root: Path = ROOT, jobs: int | None = 1) -> int:
    """Print a line for each certificate, and one for each on which the verifiers differ; 1 on any failure.

    Without `paths`, all certificates are checked, and what both prove is recorded.
    """
    from replication.verify.run import listed, say

    try:
        files = listed(paths, root)
    except Refused as refusal:
        say(f"NOT PROVED: {refusal}")
        return 1
    failed, conflicts, unchecked = 0, 0, []
    proved: list[Path] = []
    for path, (outcome, pair) in zip(files, in_order(partial(_both, root=root), files, jobs, _lost), strict=True):
        say(outcome.line())
        if pair.conflict:
            say(f"THE VERIFIERS DIFFER on {path}: {pair.conflict}")
        if not pair.checked:
            unchecked.append(path.stem)
        failed += outcome.theorem is None
        conflicts += bool(pair.conflict)
        if outcome.theorem is not None and pair.checked and not pair.conflict:
            proved.append(path)
    say(f"{len(files) - failed} of {len(files)} certificates proved; {len(proved)} of them by both verifiers")
    if unchecked:
        say(f"not rechecked: {', '.join(unchecked)}")
    if not paths:
        record(proved, root)
    return 1 if failed or conflicts or not files else 0


def record(proved: Sequence[Path], root: Path) -> None:
    """Write beside each paper, for the report, which certificates both verifiers prove, with their checksums."""
    sums: dict[str, dict[str, str]] = {}
    for path in proved:
        sums.setdefault(path.parent.name, {})[path.stem] = hashlib.sha256(path.read_bytes()).hexdigest()
    for paper, certificates in sums.items():
        text = json.dumps({"certificates": certificates}, indent=2) + "\n"
        write_atomically(root / "papers" / paper / RECORD, text.encode())


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line of `verify.py`."""
    parser = argparse.ArgumentParser(
        prog="verify.py", description="Check certificates in exact and ball arithmetic, and say what each proves."
    )
    parser.add_argument("paths", nargs="*", type=Path, metavar="PATH", help="files or folders (default: all)")
    parser.add_argument("--both", action="store_true", help="by the second verifier too; they must agree")
    add_jobs(parser)
    chosen = parser.parse_args(arguments)
    try:
        if chosen.both:
            return report(chosen.paths, jobs=chosen.jobs)
        from replication.verify import run as first

        return first.report(chosen.paths, jobs=chosen.jobs)
    except KeyboardInterrupt:
        print("interrupted: not all certificates were checked", file=sys.stderr)
        return 130

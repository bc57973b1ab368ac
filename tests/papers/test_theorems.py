"""The theorems that the papers want: every claim that could be one is one, or says why not; and the files are there."""

from pathlib import Path

import papers
from replication.audit.judge.validate import validate_theorems
from replication.audit.model import Kind
from replication.verify.run import STATEMENTS, committed
from replication.verify.subjects import theorems

ROOT = Path(__file__).parents[2]
PROVABLE = (Kind.VALUE, Kind.BOUND, Kind.FEASIBLE)
LEAST_SHARE = 0.9
"""Of the claims of these kinds, those with a theorem."""
PAPERS = papers.load()


def test_every_claim_is_wanted_as_a_theorem_or_says_why_not() -> None:
    total, supported = 0, 0
    for paper in PAPERS:
        wanted, unproved = theorems(paper.key)
        named = {claim for entry in wanted.values() for claim in entry.claims}
        excused = {claim for entry in unproved for claim in entry.claims}
        assert named | excused <= {claim.id for claim in paper.claims}
        assert not named & excused
        validate_theorems([paper], named, excused)
        provable = {claim.id for claim in paper.claims if claim.kind in PROVABLE}
        total += len(provable)
        supported += len(provable & named)
    assert supported >= LEAST_SHARE * total


def test_every_wanted_theorem_has_a_file_and_a_statement() -> None:
    wanted = [entry for paper in PAPERS for entry in theorems(paper.key)[0].values()]
    assert {entry.statement for entry in wanted} <= set(STATEMENTS)
    files = committed(ROOT)
    assert [path for path in files if not path.is_file()] == []
    assert len(files) == len(wanted)
    sizes = [path.stat().st_size for path in files]
    assert max(sizes) < 300_000 and sum(sizes) < 8_000_000

"""The theorems that the papers want: every claim that could be one is one, or says why not; and the files are there."""

from pathlib import Path

import papers
from replication.audit.judge.validate import validate_theorems
from replication.audit.model import Kind
from replication.verify.run import STATEMENTS, committed
from replication.verify.subjects import theorems

ROOT = Path(__file__).parents[2]
PROVABLE = (Kind.VALUE, Kind.BOUND, Kind.FEASIBLE)
OPEN = {
    "mustafa": {"performance-12"},
    "okajima2023": {
        *("simulation.truncation", "theory.summation"),
        *(f"unstable.{name}" for name in ("error-poles", "gains-optimal", "is-unstable", "poles")),
    },
    "peet2019": {"ex4.unstable", "theory.no-gains"},
    "shao": {"theory.prediction-rate"},
}
"""The claims of these kinds that have no theorem."""
PAPERS = papers.load()


def test_every_claim_is_wanted_as_a_theorem_or_says_why_not() -> None:
    for paper in PAPERS:
        wanted, unproved = theorems(paper.key)
        named = {claim for entry in wanted.values() for claim in entry.claims}
        excused = {claim for entry in unproved for claim in entry.claims}
        claims = {claim.id for claim in paper.claims}
        assert named | excused <= claims and not named & excused
        assert named | excused == claims or paper.key == "okajima2023"
        validate_theorems([paper], named, excused)
        provable = {claim.id for claim in paper.claims if claim.kind in PROVABLE}
        assert provable - named == {f"{paper.key}.{name}" for name in OPEN[paper.key]}


def test_every_wanted_theorem_has_a_file_and_a_statement() -> None:
    wanted = [entry for paper in PAPERS for entry in theorems(paper.key)[0].values()]
    assert {entry.statement for entry in wanted} <= set(STATEMENTS)
    files = committed(ROOT)
    assert [path for path in files if not path.is_file()] == []
    assert len(files) == len(wanted)
    sizes = [path.stat().st_size for path in files]
    assert max(sizes) < 300_000 and sum(sizes) < 8_000_000

"""What shows that a claim can fail: faults in the results of experiments, and the verdict on a claim with them."""

from collections.abc import Callable
from typing import Any

from replication.audit.judge.verdict import make_record
from replication.audit.model import NO_READING, Claim, Proof, Verdict
from replication.audit.parts import Paper
from replication.audit.store.records import ErratumRecord

Results = dict[str, Any]
"""By name, without that of the paper."""
Fault = Callable[[Results], None]


def put(path: str, new: Any) -> Fault:
    """Another value in one place, whose steps are divided by strokes; or what a function makes of the one there."""

    def alter(results: Results) -> None:
        place: Any = results
        *way, last = path.split("/")
        for step in way:
            place = place[step if isinstance(place, dict) else int(step)]
        key = last if isinstance(place, dict) else int(last)
        value = new(place[key]) if callable(new) else new
        assert place[key] != value
        place[key] = value

    return alter


def all_of(*faults: Fault) -> Fault:
    def alter(results: Results) -> None:
        for fault in faults:
            fault(results)

    return alter


def times(factor: float) -> Callable[[Any], Any]:
    """Multiply a number, or each of a list."""
    return lambda value: [factor * entry for entry in value] if isinstance(value, list) else factor * value


def verdict(paper: Paper, claim: Claim, results: Results, proof: bool | None = None) -> Verdict:
    """The verdict with these results; proof: whether that of the claim's erratum holds, else it is computed."""
    evidence = claim.answer(results)
    assert {one.reading for one in evidence.outcomes} <= {NO_READING, *(reading.name for reading in paper.readings)}
    erratum = next((one for one in paper.errata if one.id == claim.erratum), None)
    if erratum is None:
        return make_record(claim, evidence, readings=paper.readings).verdict
    proved = erratum.prove(results) if proof is None else Proof(holds=proof, text="taken for granted here")
    return make_record(claim, evidence, ErratumRecord.of(paper.key, erratum, proved), readings=paper.readings).verdict

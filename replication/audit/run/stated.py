"""What a results file repeats from the code of the papers: each record's fields that no computation decides."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from replication.audit.model import Experiment, Paper
from replication.audit.run.worker import function_name
from replication.audit.store.jsonvalues import encode
from replication.audit.store.records import (
    ErratumRecord,
    FigureRecord,
    PaperRecord,
    ResultsFile,
    StatedClaim,
    shared,
)

Name = tuple[str, str]
"""The sort of a record (`claim`, `erratum`, …) and its id, key or name."""


def stated(papers: Sequence[Paper]) -> dict[Name, dict[str, Any]]:
    """The fields that the code states, by record; the errors of `encode` and `function_name` are those of a run."""
    made: dict[Name, dict[str, Any]] = {}
    for paper in papers:
        key = {"paper": paper.key}
        made["paper", paper.key] = shared(PaperRecord, paper)
        made |= {("claim", claim.id): shared(StatedClaim, claim) for claim in paper.claims}
        made |= {("erratum", erratum.id): shared(ErratumRecord, erratum) | key for erratum in paper.errata}
        made |= {("figure", figure.name): shared(FigureRecord, figure) | key for figure in paper.figures}
        made |= {("experiment", experiment.name): _experiment(experiment) | key for experiment in paper.experiments}
    return made


def stored(results: ResultsFile) -> Mapping[Name, Any]:
    """The records of a results file under the same names; the last one of those that share a name."""
    return {
        **{("paper", record.key): record for record in results.papers},
        **{("claim", record.id): record.claim for record in results.claims},
        **{("erratum", record.id): record for record in results.errata},
        **{("figure", record.name): record for record in results.figures},
        **{("experiment", record.name): record for record in results.experiments},
    }


def _experiment(experiment: Experiment) -> dict[str, Any]:
    inputs = encode(f"the inputs of {experiment.name}", dict(experiment.inputs), sort=True)
    return {"function": function_name(experiment), "inputs": json.loads(inputs)}

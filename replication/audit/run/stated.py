"""What a results file repeats from the code of the papers: each record's fields that no computation decides."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from replication.audit.model import Claim, Erratum, Experiment, Figure, Paper
from replication.audit.run.worker import function_name
from replication.audit.store.jsonvalues import encode
from replication.audit.store.records import ResultsFile, TableRecord

Name = tuple[str, str]
"""The sort of a record (`claim`, `erratum`, …) and its id, key or name."""


def stated(papers: Sequence[Paper]) -> dict[Name, dict[str, object]]:
    """The fields that the code states, by record; the errors of `encode` and `function_name` are those of a run."""
    made: dict[Name, dict[str, object]] = {}
    for paper in papers:
        made["paper", paper.key] = paper_fields(paper)
        made |= {("claim", claim.id): _claim(paper, claim) for claim in paper.claims}
        made |= {("erratum", erratum.id): _erratum(paper, erratum) for erratum in paper.errata}
        made |= {("figure", figure.name): _figure(paper, figure) for figure in paper.figures}
        made |= {("experiment", experiment.name): _experiment(paper, experiment) for experiment in paper.experiments}
    return made


def stored(results: ResultsFile) -> Mapping[Name, Any]:
    """The records of a results file under the same names; the last one of those that share a name."""
    return {
        **{("paper", record.key): record for record in results.papers},
        **{("claim", record.id): record for record in results.claims},
        **{("erratum", record.id): record for record in results.errata},
        **{("figure", record.name): record for record in results.figures},
        **{("experiment", record.name): record for record in results.experiments},
    }


def paper_fields(paper: Paper) -> dict[str, Any]:
    """All fields of a `PaperRecord` but its findings."""
    return {
        "key": paper.key,
        "title": paper.title,
        "authors": paper.authors,
        "year": paper.year,
        "venue": paper.venue,
        "doi": paper.doi,
        "summary": paper.summary,
        "bibtex": paper.bibtex,
        "notebook": paper.notebook,
        "formulas": tuple((formula.text, formula.latex) for formula in paper.formulas),
        "tables": tuple(
            TableRecord(place=table.place, caption=table.caption, header=table.header, rows=table.rows)
            for table in paper.tables
        ),
        "scope": paper.scope,
    }


def _claim(paper: Paper, claim: Claim) -> dict[str, object]:
    return {
        "paper": paper.key,
        "place": claim.place,
        "kind": claim.kind,
        "statement": claim.statement,
        "printed": claim.printed,
        "expected_verdict": claim.expected,
        "tolerance": claim.tolerance,
        "tolerance_reason": claim.tolerance_reason,
        "erratum": claim.erratum,
        "experiments": claim.uses,
    }


def _erratum(paper: Paper, erratum: Erratum) -> dict[str, object]:
    return {
        "paper": paper.key,
        "place": erratum.place,
        "printed": erratum.printed,
        "meant": erratum.meant,
        "inference": erratum.inference,
    }


def _figure(paper: Paper, figure: Figure) -> dict[str, object]:
    return {
        "paper": paper.key,
        "place": figure.place,
        "title": figure.title,
        "caption": figure.caption,
        "published": figure.published,
    }


def _experiment(paper: Paper, experiment: Experiment) -> dict[str, object]:
    inputs = encode(f"the inputs of {experiment.name}", dict(experiment.inputs), sort=True)
    return {"paper": paper.key, "function": function_name(experiment), "inputs": json.loads(inputs)}

"""Results files of the schema before this one, in which a claim was one flat record, for comparisons with them."""

from __future__ import annotations

from typing import Any

import msgspec

from replication.audit.model import NO_READING
from replication.audit.project import Settings

VERSION = 2
_CLAIM = ("id", "place", "kind", "statement", "printed", "tolerance", "tolerance_reason", "erratum")
_EVIDENCE = (
    "lower", "upper", "method", "cross_check", "code", "seconds", "holds", "margin", "threshold", "threshold_reason",
    "probability", "quantities", "solvers", "note", "not_checkable", "certificates",
)  # fmt: skip
_JUDGEMENT = ("verdict", "reason", "deviation_ulp", "proved", "unproved")
_UNKNOWN: dict[str, Any] = {
    "method": "", "cross_check": "", "quantities": {}, "solvers": [], "note": "", "not_checkable": "",
    "draws": None, "outcomes": [], "over_inputs": None, "as_printed": None, "code": "", "seconds": 0.0,
    "certificates": [],
}  # fmt: skip
"""What that schema did not keep of the evidence for the text as printed."""


def converted(content: dict[str, Any]) -> dict[str, Any]:
    """A decoded file of schema `VERSION` in the form of the present one; raises ValidationError for a missing field.

    That schema knew no readings and no predicates. It holds no rounding intervals; those follow from the prints.
    """
    try:
        inferred = {erratum["id"] for erratum in content["errata"] if erratum["inference"]}
        claims = [_claim(record, inferred) for record in content["claims"]]
        papers = [
            {"notebook": "", "sensitivity": [], "common": [], "readings": [], "brief": None, **_paper(paper)}
            for paper in content["papers"]
        ]
    except (KeyError, TypeError, ValueError) as error:
        raise msgspec.ValidationError(f"a field of schema {VERSION} is missing or malformed: {error!r}") from None
    certificates = [{**record, "says": [], "second": False} for record in content["certificates"]]
    figures = [{**record, "code": ""} for record in content["figures"]]
    return {
        **content,
        "project": msgspec.to_builtins(Settings()),
        "claims": claims,
        "papers": papers,
        "certificates": certificates,
        "figures": figures,
    }


def _paper(paper: dict[str, Any]) -> dict[str, Any]:
    return {**paper, "coverage": [], "formulas": [{"text": text, "latex": latex} for text, latex in paper["formulas"]]}


def _verdict(verdict: str, record: dict[str, Any], inferred: set[str]) -> str:
    """The verdict that the present rules give for one of that schema."""
    kind, drawn = record["kind"], record["probability"] is not None
    if verdict == "differs" and (kind in ("order", "feasible") or (kind == "statistical" and not drawn)):
        return "refuted"
    if verdict == "consistent" and drawn:
        return "compatible"
    if verdict == "reproduced after erratum" and (drawn or record["erratum"] in inferred):
        return "compatible"
    return "undetermined" if verdict == "not checkable" else verdict


def _claim(record: dict[str, Any], inferred: set[str]) -> dict[str, Any]:
    printed = record["as_printed"]
    return {
        "claim": {
            **{name: record[name] for name in _CLAIM},
            "expected": _verdict(record["expected_verdict"], record, inferred),
            "uses": record["experiments"],
            "reading": NO_READING,
            "optimum": False,
            "repeats": "",
            "consequence": None,
            "says": [],
            "meant": "",
            "unit": "",
            "remark": "",
        },
        "evidence": {
            **{name: record[name] for name in _EVIDENCE},
            "value": record["computed"],
            "draws": None,
            "outcomes": [],
            "over_inputs": None,
            "as_printed": None if printed is None else {**_UNKNOWN, **printed},
        },
        "judgement": {
            **{name: record[name] for name in _JUDGEMENT},
            "verdict": _verdict(record["verdict"], record, inferred),
            "intervals": [],
            "supported": "",
        },
    }

"""The evidence of all claims as one packed text, which the page unpacks and draws where a reader opens a claim."""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Mapping
from typing import Any

from jinja2 import Environment

from replication.audit.report.claim import anchor

_SPACE = re.compile(r">\s+<")


def drawings(environment: Environment, shown: Mapping[str, Any]) -> dict[str, str]:
    """HTML by the id of the element that it belongs into: the evidence of each claim, the inputs of each experiment."""
    made = environment.get_template("evidence.html.j2").make_module(dict(shown))
    claims = {
        anchor("claim", view.record.id): str(made.evidence(view, paper))  # type: ignore[attr-defined]
        for paper in shown["papers"]
        for view in paper.claims
    }
    inputs = {
        anchor("experiment", record.name): str(made.inputs(record))  # type: ignore[attr-defined]
        for record in shown["results"].experiments
        if record.inputs or record.solvers
    }
    return {name: _SPACE.sub("> <", html).strip() for name, html in (claims | inputs).items()}


def packed(parts: Mapping[str, Any]) -> str:
    """`parts` as JSON, deflated, in base64: what no HTML parser can take for anything else."""
    return base64.b64encode(zlib.compress(json.dumps(parts, ensure_ascii=False).encode(), 9)).decode()


def unpacked(text: str) -> dict[str, str]:
    """What `packed` packed."""
    found: dict[str, str] = json.loads(zlib.decompress(base64.b64decode(text)))
    return found

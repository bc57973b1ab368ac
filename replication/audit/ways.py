"""Where a number stands in a result: a way of steps into what an experiment returned, or a file holds.

Of JSON a step is a key, or a place in a list from 0 on. Of a table the first step is a row: what its first column
holds, `column=value` (several with commas), or `#3`, the third; then a column. `*` takes all rows, `low,high` two.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from replication.audit.model import Results
from replication.errors import AuditError


def value_at(where: str, steps: Sequence[str], name: str, results: Results) -> Any:
    """What stands there in the results, lists as tuples; AuditError says where the way ends, and what is there.

    where: in words, for messages. steps: what the way begins with, then its steps. name: of the experiment with it.
    """
    first, *rest = steps
    if name not in results:
        there = ", ".join(list(results)[:8])
        raise AuditError(f"{where}: {':'.join(steps)!r} leads nowhere: among the results there is {there}")
    value = results[name]
    if first.endswith(".csv"):
        header, columns = list(value), value.values()
        value = [dict(zip(header, cells, strict=True)) for cells in zip(*columns, strict=True)]
        if rest and not re.search(r"^[#*]|=", rest[0]):
            rest[0] = f"{header[0]}={rest[0]}"
    return _at(f"{where}: {':'.join(steps)!r}", first, value, rest)


def _at(where: str, so_far: str, value: Any, steps: Sequence[str]) -> Any:
    """What a way leads to inside a value."""
    if not steps:
        return _tupled(f"{where}: at {so_far!r}", value)
    step, *rest = steps
    if step == "*" and isinstance(value, list):
        return tuple(_at(where, f"{so_far}:{number}", entry, rest) for number, entry in enumerate(value))
    inside = value if isinstance(value, Mapping) else dict(enumerate(value)) if isinstance(value, list) else {}
    several = step.split(",")
    if isinstance(value, list):
        if "=" in step:
            rows = [entry for entry in value if isinstance(entry, Mapping) and entry]
            found = [row for row in rows if _fits(row, several)]
            if len(found) > 1:
                raise AuditError(f"{where}: {len(found)} rows of {so_far} have {step}; add ,column=value, or write #1")
            inside = {step: found[0]} if found else {next(iter(row.values())): row for row in rows}
        elif step.startswith("#"):
            inside = {f"#{number}": entry for number, entry in enumerate(value, 1)}
    elif step not in inside and len(several) > 1 and all(one in inside for one in several):
        inside = {step: [inside[one] for one in several]}
    key: Any = int(step) if isinstance(value, list) and step.isdecimal() else step
    if key not in inside:
        there = ", ".join(map(str, list(inside)[:8])) or f"only {value!r:.40}"
        raise AuditError(f"{where} leads nowhere: in {so_far} there is {there}, and no {step}")
    return _at(where, f"{so_far}:{step}", inside[key], rest)


def _fits(row: Mapping[str, Any], conditions: Sequence[str]) -> bool:
    """Whether each `column=value` holds, as text or as a number."""
    pairs = [(row.get(column), wanted) for column, _, wanted in (one.partition("=") for one in conditions)]
    return all(cell is not None and (str(cell) == wanted or _number(cell) == _number(wanted)) for cell, wanted in pairs)


def _number(cell: Any) -> Any:
    """The number that a cell holds; else an object that equals no other."""
    try:
        return float(cell)
    except (TypeError, ValueError):
        return object()


def _tupled(where: str, value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_tupled(where, entry) for entry in value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        cure = (
            "write it with a point and without unit or sign of thousands"
            if re.search(r"\d", str(value)) and isinstance(value, str)
            else "name a place where one stands"
        )
        raise AuditError(f"{where} there is {value!r:.60}, which is no number; {cure}")
    return float(value)

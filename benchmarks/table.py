"""Turn the JSON of pytest-benchmark into a table: `python benchmarks/table.py RUN.json RESULTS.md`.

Benchmarks whose `extra_info` names a row and a column are set side by side, with the ratio to the fastest column and,
where `size` is given, the exponent of growth; the others are listed with what they noted. All from one run.
"""

from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

SOLVED = ("Solved", "optimal", "noncausal limit", "causal limit")
"""Words of a solver that need no mention in the table."""
PLACED = ("row", "column", "size", "unit", "status", "excess")


def seconds(value: float) -> str:
    """Three digits with a unit that fits."""
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if value * factor >= 1 or unit == "µs":
            return f"{value * factor:.3g} {unit}"
    raise ValueError(value)


def median(benchmark: dict[str, Any]) -> float:
    return float(benchmark["stats"]["median"])


def noted(benchmark: dict[str, Any], names: tuple[str, ...] | None = None) -> str:
    """What a benchmark noted, all but its place in a table unless `names` are asked for."""
    info = benchmark["extra_info"]
    wanted = (
        [name for name in info if name not in PLACED] if names is None else [name for name in names if name in info]
    )
    return ", ".join(
        f"{name.replace('_', ' ')} {info[name]:.3g}"
        if isinstance(info[name], float)
        else f"{name.replace('_', ' ')} {info[name]}"
        for name in wanted
    )


def cell(benchmark: dict[str, Any] | None, base: float) -> str:
    """Time, ratio to the base, and how the solver ended unless it solved the problem."""
    if benchmark is None:
        return "–"
    info = benchmark["extra_info"]
    text = f"{seconds(median(benchmark))} (×{median(benchmark) / base:.3g})"
    if info.get("status") not in (None, *SOLVED):
        text += f" *{info['status']}*"
    if info.get("excess") is not None:
        text += f" {info['excess']:+.0e}"
    return text


def exponent(benchmarks: list[dict[str, Any]]) -> str:
    """Slope of log time over log size by least squares."""
    points = [(b["extra_info"]["size"], median(b)) for b in benchmarks if "size" in b["extra_info"]]
    if len({size for size, _ in points}) < 3:
        return ""
    slope = np.polyfit([math.log(size) for size, _ in points], [math.log(time) for _, time in points], 1)[0]
    return f"{slope:.2f}"


def side_by_side(benchmarks: list[dict[str, Any]]) -> list[str]:
    """A table of rows and columns; the ratio in each row is to its last column."""
    rows = list(dict.fromkeys(b["extra_info"]["row"] for b in benchmarks))
    columns = list(dict.fromkeys(b["extra_info"]["column"] for b in benchmarks))
    at = {(b["extra_info"]["row"], b["extra_info"]["column"]): b for b in benchmarks}
    lines = ["| | " + " | ".join(columns) + " |", "|---|" + "---|" * len(columns)]
    for row in rows:
        base = median(at[row, columns[-1]])
        lines.append(f"| {row} | " + " | ".join(cell(at.get((row, column)), base) for column in columns) + " |")
    growth = [exponent([b for b in benchmarks if b["extra_info"]["column"] == column]) for column in columns]
    if any(growth):
        unit = benchmarks[0]["extra_info"].get("unit", "size")
        lines.append(f"| growth: time ∝ ({unit})^p, p = | " + " | ".join(growth) + " |")
    return lines


def listed(benchmarks: list[dict[str, Any]]) -> list[str]:
    """A list of names, times and notes."""
    lines = ["| benchmark | median | rounds | noted |", "|---|---|---|---|"]
    for b in benchmarks:
        name = b["name"].removeprefix("test_").replace("_", " ")
        notes = ", ".join(part for part in (noted(b, ("status",)), noted(b)) if part)
        lines.append(f"| {name} | {seconds(median(b))} | {b['stats']['rounds']} | {notes} |")
    return lines


def document(run: dict[str, Any]) -> str:
    """The whole of results.md."""
    machine = run["machine_info"]
    lines = [
        "# Benchmarks",
        "",
        f"Written by `make bench`; {machine['cpu'].get('brand_raw', machine['machine'])}, {os.cpu_count()} cores, "
        f"Python {machine['python_version']}, one BLAS thread per process. Times are medians; ratios hold within this "
        "run, other work on the machine included.",
        "",
        "Where designs stand side by side: time, in brackets the ratio to the last column, the solver's word unless it "
        "solved the problem, and the relative distance of its level from the optimum.",
    ]
    groups: dict[str, list[dict[str, Any]]] = {}
    for b in run["benchmarks"]:
        title = b["group"] or Path(b["fullname"].split("::")[0]).stem.removeprefix("bench_").capitalize()
        groups.setdefault(title, []).append(b)
    for title, benchmarks in groups.items():
        placed = all("row" in b["extra_info"] for b in benchmarks)
        lines += ["", f"## {title}", "", *(side_by_side(benchmarks) if placed else listed(benchmarks))]
    return "\n".join(lines) + "\n"


def main(source: str, target: str) -> None:
    """Read the run and write the table."""
    Path(target).write_text(document(json.loads(Path(source).read_text(encoding="utf-8"))), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:3])

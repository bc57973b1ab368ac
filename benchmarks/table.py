"""The page of a run of pytest-benchmark, and what got slower: `python -m benchmarks.table RUN.json OLD.md NEW.md`.

Benchmarks whose `extra_info` names a row and a column are set side by side, with the ratio to the last column; the
others are listed with what they noted. How the time of each column grows with its `sizes` comes first; all from one
run.

Compared with the old page are ratios, each of ours to a peer in the same run, and never seconds, which are those of the
machine and of its other work: those to the last column, which is ours, and the notes `times slower` (a peer), `times
faster` (we are), `of` a peer, `starts` of Python. Exit code 1 if some ratio grew by more than `NOTABLE`, or stands on
one page only.
"""

import json
import math
import os
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.clock import markdown

SOLVED = ("Solved", "optimal", "noncausal limit", "causal limit")
"""Words of a solver that need no mention in the table."""
PLACED = ("row", "column", "sizes", "status", "excess")


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
    wanted = [name for name in info if (name not in PLACED if names is None else name in names)]
    shown = ((name.replace("_", " "), info[name]) for name in wanted)
    return ", ".join(f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}" for name, value in shown)


def cell(benchmark: dict[str, Any] | None, base: float) -> str:
    """Time, ratio to the base, how the solver ended unless it solved the problem, and what else was noted."""
    if benchmark is None:
        return "–"
    info = benchmark["extra_info"]
    text = f"{seconds(median(benchmark))} (×{median(benchmark) / base:.3g})"
    if info.get("status") not in (None, *SOLVED):
        text += f" *{info['status']}*"
    if info.get("excess") is not None:
        text += f" {info['excess']:+.0e}"
    return f"{text}, {noted(benchmark)}" if noted(benchmark) else text


def growth(benchmarks: list[dict[str, Any]]) -> str:
    """time ∝ n^p N^q: p, q, … by least squares on the logarithms; empty unless the sizes determine them, and one more.

    The exponent of a size is that of the range measured, all fixed costs included.
    """
    sized = [(b["extra_info"]["sizes"], median(b)) for b in benchmarks if b["extra_info"].get("sizes")]
    if not sized:
        return ""
    names = list(sized[0][0])
    logarithms = np.log([[sizes[name] for name in names] + [math.e] for sizes, _ in sized])
    if len({tuple(row) for row in logarithms.tolist()}) <= len(names) + 1:
        return ""
    if np.linalg.matrix_rank(logarithms) <= len(names):
        return ""
    powers = np.linalg.lstsq(logarithms, np.log([time for _, time in sized]), rcond=None)[0]
    return " ".join(f"{name}^{power:.2f}" for name, power in zip(names, powers[:-1], strict=True))


def measured(benchmarks: list[dict[str, Any]]) -> str:
    """Over which sizes a growth was measured."""
    sizes = [b["extra_info"]["sizes"] for b in benchmarks]
    ranges = ((name, min(s[name] for s in sizes), max(s[name] for s in sizes)) for name in sizes[0])
    return ", ".join(f"{name} = {low} … {high}" for name, low, high in ranges)


def growths(groups: dict[str, list[dict[str, Any]]]) -> list[str]:
    """A table of the growth of each column of each group."""
    rows = []
    for title, benchmarks in groups.items():
        for column in dict.fromkeys(b["extra_info"].get("column", "") for b in benchmarks):
            own = [b for b in benchmarks if b["extra_info"].get("column", "") == column]
            if law := growth(own):
                rows.append((title, column, measured(own), law))
    return markdown(("benchmark", "by", "sizes", "time ∝"), rows, "---")


def side_by_side(benchmarks: list[dict[str, Any]]) -> list[str]:
    """A table of rows and columns; the ratio in each row is to its last column."""
    at = {(b["extra_info"]["row"], b["extra_info"]["column"]): b for b in benchmarks}
    columns = list(dict.fromkeys(column for _, column in at))
    rows = [
        (row, *(cell(at.get((row, column)), median(at[row, columns[-1]])) for column in columns))
        for row in dict.fromkeys(row for row, _ in at)
    ]
    return markdown(("", *columns), rows, "---")


def listed(benchmarks: list[dict[str, Any]]) -> list[str]:
    """A list of names, times and notes."""
    rows = [
        (
            b["name"].removeprefix("test_").replace("_", " "),
            seconds(median(b)),
            str(b["stats"]["rounds"]),
            ", ".join(part for part in (noted(b, ("status",)), noted(b)) if part),
        )
        for b in benchmarks
    ]
    return markdown(("benchmark", "median", "rounds", "noted"), rows, "---")


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
    lines += ["", "## Growth", "", *growths(groups)]
    for title, benchmarks in groups.items():
        placed = all("row" in b["extra_info"] for b in benchmarks)
        lines += ["", f"## {title}", "", *(side_by_side(benchmarks) if placed else listed(benchmarks))]
    return "\n".join(lines) + "\n"


NOTABLE = 1.5
"""Factor below which a change is noise: ratios of single runs differ by a third on a machine with other work."""
RATIO = re.compile(r"\(×([\d.e+-]+)\)")
NOTE = re.compile(r"(?:^|, )(times slower|times faster|of|starts)((?: [A-Za-z]+)*) ([\d.e+-]+)(?=,|$)")


def costs(page: str) -> dict[str, float]:
    """Our time over that of a peer, by section, row and peer."""
    found: dict[str, float] = {}
    title, columns = "", []
    for line in page.splitlines():
        if line.startswith("## "):
            title, columns = line[3:], []
        elif line.startswith("| ") and not columns:
            columns = [cell.strip() for cell in line.strip("|").split("|")]
        elif line.startswith("| "):
            row, *cells = (cell.strip() for cell in line.strip("|").split("|"))
            found |= {f"{title}, {row}: {name}": cost for name, cost in _of_row(columns[1:], cells)}
    return found


def _of_row(columns: list[str], cells: list[str]) -> Iterator[tuple[str, float]]:
    # The last column is the unit of the others, and has notes in a list.
    for name, cell in zip(columns[:-1], cells[:-1], strict=True):
        if ratio := RATIO.search(cell):
            yield name, 1 / float(ratio[1])
    for kind, peer, number in NOTE.findall(cells[-1]):
        yield f"{kind}{peer}", 1 / float(number) if kind.startswith("times") else float(number)


def changes(old: Mapping[str, float], new: Mapping[str, float]) -> list[str]:
    """What got slower, the worst first, and what stands on one of the pages only."""
    grown = {name: new[name] / old[name] for name in old.keys() & new.keys()}
    worse = sorted((name for name, factor in grown.items() if factor > NOTABLE), key=lambda name: -grown[name])
    told = [f"{name}: {old[name]:.3g} times the peer before, {new[name]:.3g} now" for name in worse]
    told += [f"{name}: not measured any more" for name in sorted(old.keys() - new.keys())]
    return told + [f"{name}: new" for name in sorted(new.keys() - old.keys())]


def main(run: str, old: str, new: str) -> int:
    """Write the page of a run, and print what changed since the old one."""
    text = document(json.loads(Path(run).read_text(encoding="utf-8")))
    Path(new).write_text(text, encoding="utf-8")
    before, after = costs(Path(old).read_text(encoding="utf-8")), costs(text)
    told = changes(before, after)
    print(*told, f"{len(told)} changes in {len(before | after)} ratios", sep="\n")
    return int(bool(told))


if __name__ == "__main__":
    raise SystemExit(main(*sys.argv[1:4]))

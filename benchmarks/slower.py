"""What got slower between two pages of benchmarks: `python benchmarks/slower.py OLD.md NEW.md`.

Compared are ratios, each of ours to a peer in the same run, and never seconds, which are those of the machine and of
its other work. A page holds them as `table.py` writes them: a time with its ratio to the last column, which is ours,
and notes: `times slower` (a peer), `times faster` (we are), `of` a peer, `starts` of Python. Exit code 1 if some ratio
grew by more than `NOTABLE`, or stands on one page only.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

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


def main(old: str, new: str) -> int:
    """Print the changes."""
    before, after = (costs(Path(path).read_text(encoding="utf-8")) for path in (old, new))
    told = changes(before, after)
    print(*told, f"{len(told)} changes in {len(before | after)} ratios", sep="\n")
    return int(bool(told))


if __name__ == "__main__":
    raise SystemExit(main(*sys.argv[1:3]))

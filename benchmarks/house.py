"""How large the house is: `python benchmarks/house.py [COMMIT]` counts the working tree, or a commit beside it.

Production is all Python in replication/ and papers/ and verify.py, tests are all Python in tests/; every line counts,
comments and blank lines included. Also told: files of less than 60 lines, and folders of more than ten names.
"""

import subprocess
import sys
from collections import Counter
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from statistics import median

SHORT, NAMES = 60, 10
ROOMS = {"production": ("replication", "papers", "verify.py"), "tests": ("tests",)}


def files(commit: str | None) -> dict[PurePosixPath, int]:
    """The lines of every Python file that git knows, by path."""
    if commit is None:
        listed = subprocess.check_output(["git", "ls-files", "-co", "--exclude-standard", "*.py"], text=True).split(
            "\n"
        )
        there = [path for path in map(Path, listed) if path.is_file()]
        return {PurePosixPath(path): len(path.read_text("utf-8").splitlines()) for path in there}
    listed = subprocess.check_output(["git", "ls-tree", "-r", "--name-only", commit], text=True).split("\n")
    wanted = [path for path in listed if path.endswith(".py")]
    texts = {p: subprocess.check_output(["git", "show", f"{commit}:{p}"], text=True) for p in wanted}
    return {PurePosixPath(path): len(text.splitlines()) for path, text in texts.items()}


def table(lines: Mapping[PurePosixPath, int]) -> list[str]:
    """One line a room, then the folders that hold more than ten names."""
    told = []
    for room, heads in ROOMS.items():
        own = {path: count for path, count in lines.items() if path.parts[0] in heads}
        short = sum(count < SHORT for path, count in own.items() if path.name != "__init__.py")
        told.append(
            f"{room}: {sum(own.values())} lines in {len(own)} files, median {median(own.values()):.0f}, "
            f"{short} below {SHORT} lines"
        )
    inside: Counter[str] = Counter()
    for folder in {parent for path in lines for parent in path.parents if path.parts[0] in ROOMS["production"]}:
        held = {path.relative_to(folder).parts[0] for path in lines if path.is_relative_to(folder)}
        inside[str(folder)] = len(held - {"__init__.py"})
    wide = [f"{folder} ({count})" for folder, count in inside.most_common() if count > NAMES and folder != "."]
    return [*told, f"folders of more than {NAMES} names: {', '.join(wide) or 'none'}"]


if __name__ == "__main__":
    for commit in (*sys.argv[1:], None):
        print(commit or "working tree")
        print(*(f"  {line}" for line in table(files(commit))), sep="\n")

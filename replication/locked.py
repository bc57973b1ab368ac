"""A part of requirements.lock: what chosen extras need and no more, `python -m replication.locked estimation proofs`.

The lock has every package once, with its hashes and with the names of those that want it. So the part follows from the
lock alone: the packages that pyproject.toml names for the extras, and whatever these want, at any depth. The standard
library does it, since nothing is installed when it is asked.
"""

import re
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parents[1]


def part(lock: str, wanted: Iterable[str]) -> str:
    """The entries of a lock that these packages need, themselves included, as text for pip.

    Raises KeyError with the name of a package that the lock does not have.
    """
    entries = {_name(text): text for text in re.split(r"^(?=[a-z0-9])", lock, flags=re.MULTILINE)[1:]}
    wants: dict[str, set[str]] = {name: set() for name in entries}
    for name, text in entries.items():
        # The comment behind the hashes: `# via one`, or a line each.
        for parent in re.findall(r"^ +#(?: +via)? +([a-z0-9._-]+)$", text, flags=re.MULTILINE):
            wants.setdefault(parent, set()).add(name)
    needed: set[str] = set()
    waiting = [_name(text) for text in wanted]
    while waiting:
        name = waiting.pop()
        entries[name]  # a KeyError names what is missing
        if name not in needed:
            needed.add(name)
            waiting += wants[name]
    return "".join(entries[name] for name in sorted(needed))


def declared(project: str, extras: Iterable[str]) -> list[str]:
    """The packages that pyproject.toml names for the project itself, for these extras, and to build it."""
    settings = tomllib.loads(project)
    optional = settings["project"]["optional-dependencies"]
    named = [*settings["project"]["dependencies"], *settings["build-system"]["requires"]]
    return [*named, *(text for extra in extras for text in optional[extra])]


def _name(requirement: str) -> str:
    return re.split(r"[^A-Za-z0-9._-]", requirement, maxsplit=1)[0].lower().replace("_", "-")


if __name__ == "__main__":
    names = declared((ROOT / "pyproject.toml").read_text(encoding="utf-8"), sys.argv[1:])
    print(part((ROOT / "requirements.lock").read_text(encoding="utf-8"), names), end="")

"""Packages that only some papers need: how to install what an import did not find, and their part of the lock.

`python -m replication.extras estimation proofs` prints what of requirements.lock these extras need and no more. The
lock has every package once, with its hashes and with the names of those that want it. So the part follows from the lock
alone: the packages that pyproject.toml names for the extras, and whatever these want, at any depth. The standard
library does it, since nothing is installed when it is asked.
"""

import re
import sys
import tomllib
import traceback
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

EXTRAS = {
    "flint": "proofs",
    "scipy": "estimation",
    "cvxpy": "estimation",
    "clarabel": "estimation",
    "control": "estimation",
    "sdpap": "estimation",
}
"""The extra of each module that may be absent."""
NAMES = {
    **{"flint": "python-flint", "sdpap": "sdpa-python", "sklearn": "scikit-learn", "skimage": "scikit-image"},
    **{"yaml": "pyyaml", "PIL": "pillow", "cv2": "opencv-python", "Bio": "biopython", "bs4": "beautifulsoup4"},
}
"""The name in the index of packages, of modules that are called otherwise there."""
DISTRIBUTION = "slow-sensor-replication"


def missing(error: BaseException) -> str:
    """The top-level module that an import did not find, if it is known which package has it; empty for any other error.

    Of a name that nobody knows it is not said that it should be installed: it may be misspelt.
    """
    top = (error.name or "").partition(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    return top if top in {**EXTRAS, **NAMES} else ""


def told(error: BaseException) -> str:
    """The message of an error on one line; of a module that is not there, with how to install it."""
    message = " ".join(str(error).split())
    top = missing(error)
    return f"{message}; install it with `python -m pip install {_wanted(error, top)}`" if top else message


def required() -> list[str]:
    """What the installed distribution of this package requires; nothing where it runs from its sources alone."""
    try:
        return metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        return []


def _wanted(error: BaseException, top: str) -> str:
    """What to install: all of the extra where this program itself asks for the module, else the package alone."""
    places = [frame.f_code.co_filename for frame, _ in traceback.walk_tb(error.__traceback__)]
    asking = [Path(place) for place in places if "importlib" not in place][-1:]
    internal = any(place.is_relative_to(Path(__file__).parent) for place in asking)
    if internal and top in EXTRAS:
        mark = f'extra == "{EXTRAS[top]}"'
        if requirements := [line.partition(";")[0].strip() for line in required() if mark in line.replace("'", '"')]:
            return " ".join(f'"{line}"' for line in requirements)
    return NAMES.get(top, top)


def part(lock: str, wanted: Iterable[str]) -> str:
    """The entries of a lock that these packages need, themselves included, as text for pip.

    Raises KeyError with the name of a package that the lock does not have.
    """
    entries = {canonical(name_of(text)): text for text in re.split(r"^(?=[a-z0-9])", lock, flags=re.MULTILINE)[1:]}
    wants: dict[str, set[str]] = {name: set() for name in entries}
    for name, text in entries.items():
        # The comment behind the hashes: `# via one`, or a line each.
        for parent in re.findall(r"^ +#(?: +via)? +([a-z0-9._-]+)$", text, flags=re.MULTILINE):
            wants.setdefault(canonical(parent), set()).add(name)
    needed: set[str] = set()
    waiting = [canonical(name_of(text)) for text in wanted]
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


def name_of(requirement: str) -> str:
    """The name of the distribution that a requirement asks for."""
    return re.split(r"[^A-Za-z0-9._-]", requirement, maxsplit=1)[0]


def canonical(name: str) -> str:
    """The name of a distribution in the form in which two spellings are one."""
    return re.sub(r"[-_.]+", "-", name).lower()


if __name__ == "__main__":
    root = Path(__file__).parents[1]
    names = declared((root / "pyproject.toml").read_text(encoding="utf-8"), sys.argv[1:])
    print(part((root / "requirements.lock").read_text(encoding="utf-8"), names), end="")

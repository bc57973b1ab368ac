"""Packages that only some papers need, and how to install what an import did not find."""

from __future__ import annotations

import sys
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
"""The name in the index of packages, of modules that are called otherwise."""
DISTRIBUTION = "slow-sensor-replication"


def missing(error: BaseException) -> str:
    """The top-level module that an import did not find and that can be installed; empty for any other error.

    A module of the project itself, or of the standard library, is none.
    """
    if not isinstance(error, ModuleNotFoundError) or not error.name:
        return ""
    top = error.name.partition(".")[0]
    return "" if top in {"replication", *sys.stdlib_module_names} or _beside(top) else top


def told(error: BaseException) -> str:
    """The message of an error on one line; of a module that is not there, with how to install it."""
    said = " ".join(str(error).split())
    top = missing(error)
    return f"{said}; install it with `python -m pip install {_wanted(error, top)}`" if top else said


def _beside(top: str) -> bool:
    """Whether the name is that of a module or folder here, whose part is misspelt."""
    return (
        any((Path(place) / f"{top}{end}").exists() for place in sys.path for end in (".py", "")) or top in sys.modules
    )


def _wanted(error: BaseException, top: str) -> str:
    """What to install: all of the extra where this program itself asks for the module, else the package alone."""
    last = error.__traceback__
    own = False
    while last is not None:
        place = Path(last.tb_frame.f_code.co_filename)
        if "importlib" not in str(place):
            own = place.is_relative_to(Path(__file__).parent)
        last = last.tb_next
    if own and top in EXTRAS:
        try:
            lines = metadata.requires(DISTRIBUTION) or []
        except metadata.PackageNotFoundError:
            lines = []
        mark = f'extra == "{EXTRAS[top]}"'
        if wanted := [line.partition(";")[0].strip() for line in lines if mark in line.replace("'", '"')]:
            return " ".join(f'"{line}"' for line in wanted)
    return NAMES.get(top, top)

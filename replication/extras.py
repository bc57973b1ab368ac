"""Packages that only some papers need, and how to install what an import did not find."""

import traceback
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

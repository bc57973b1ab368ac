"""A running observer from its file; `Portable.to_json` writes one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from replication.errors import InvalidInputError
from replication.estimation.api.forms.portable import Portable
from replication.estimation.api.forms.stored import FORMAT, VERSION, class_named, decoded
from replication.estimation.api.signals import Signals


def load(path: str | Path) -> Portable:
    """Read a running observer from a file.

    Parameters
    ----------
    path : path
        What the `to_json` of an observer gave.

    Returns
    -------
    RunningObserver
        At instant 0, of the class that was written, with the same names; it takes the same steps.

    Raises
    ------
    InvalidInputError
        The file cannot be read, is no file of an observer, or has a version that is not known.
    """
    try:
        held = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidInputError(f"{path} cannot be read as JSON: {error}") from None
    if not isinstance(held, dict) or held.get("format") != FORMAT:
        raise InvalidInputError(f"{path} is no file of a running observer; observer().to_json() writes one")
    if held.get("version") != VERSION:
        raise InvalidInputError(f"{path} has version {held.get('version')!r}; known is version {VERSION}")
    try:
        kind = class_named(held["observer"])
        if not issubclass(kind, Portable):
            raise InvalidInputError(f"{held['observer']} is no running observer")
        made = kind(**{name: decoded(value) for name, value in held["made_with"].items()})
        return made.named(_signals(held["signals"]))
    except InvalidInputError as error:
        raise InvalidInputError(f"{path}: {error}") from None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InvalidInputError(f"{path} is not whole: {type(error).__name__} {error}") from None


def _signals(names: Any) -> Signals | None:
    if names is None:
        return None
    given: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in names.items()}
    return Signals(**given)

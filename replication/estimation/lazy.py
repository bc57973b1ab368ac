"""Names of a package that are imported when first asked for (PEP 562), so that importing the package costs nothing."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any


def lazy(package: str, modules: Mapping[str, str]) -> Callable[[str], Any]:
    """The `__getattr__` of `package`: the names of each module, given as {"module": "name name"} relative to it.

    `dir` and `help` then show these names, and not what the package needs for itself.
    """
    held = vars(sys.modules[package])
    homes = {name: module for module, taken in modules.items() for name in taken.split()}

    def attribute(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        held[name] = getattr(importlib.import_module(f".{homes[name]}", package), name)
        return held[name]

    held["__dir__"] = lambda: sorted({*homes, *(name for name in held if name.startswith("__"))})
    return attribute

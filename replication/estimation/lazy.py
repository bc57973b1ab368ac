"""Names of a package that are imported when first asked for (PEP 562), so that importing the package costs nothing."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any


def lazy(package: str, **names: str) -> Callable[[str], Any]:
    """The `__getattr__` of `package`: the names of each submodule, given as submodule="name name"."""
    homes = {name: module for module, taken in names.items() for name in taken.split()}

    def attribute(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(f"{package}.{homes[name]}"), name)

    return attribute

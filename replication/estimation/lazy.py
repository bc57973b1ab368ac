"""Names of a package that are imported when first asked for (PEP 562), so that importing the package costs nothing."""

import ast
import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any


def lazy(package: str) -> Callable[[str], Any]:
    """The `__getattr__` of `package`: the names that it imports for type checkers, under its first `if`.

    `dir` and `help` then show these names, and not what the package needs for itself.
    """
    held = vars(sys.modules[package])
    source = ast.parse(Path(held["__file__"]).read_text(encoding="utf-8"))
    checked = next(node for node in source.body if isinstance(node, ast.If)).body
    homes = {name.name: node.module for node in checked if isinstance(node, ast.ImportFrom) for name in node.names}

    def attribute(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        held[name] = getattr(importlib.import_module(str(homes[name])), name)
        return held[name]

    held["__dir__"] = lambda: sorted({*homes, *(name for name in held if name.startswith("__"))})
    return attribute

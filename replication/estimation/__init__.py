"""The theory: plants, designs, norms. Knows no paper and no plot; `load` reads the file of a running observer."""

import ast
import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any


def lazy(package: str) -> Callable[[str], Any]:
    """The `__getattr__` of `package` (PEP 562), so that importing it costs nothing.

    The names that it imports for type checkers, under its first `if`, are imported when first asked for; `dir` and
    `help` show these, and not what the package needs for itself.
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


if TYPE_CHECKING:
    from replication.estimation.api.portable import load
else:
    __getattr__ = lazy(__name__)

__all__ = ["load"]

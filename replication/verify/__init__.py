"""The verifier of certificates: exact and ball arithmetic; imports the standard library and python-flint, nothing else.

It shares no code with what makes certificates, so that it can be read, and trusted, by itself. Where python-flint is
not installed, or REPLICATION_ARITHMETIC is `stdlib`, `stdlib` does its part: all that follows finds it as `flint`.
"""

import os
import sys
from importlib import import_module
from importlib.util import find_spec

CHOICE = os.environ.get("REPLICATION_ARITHMETIC") or ("flint" if find_spec("flint") else "stdlib")
ARITHMETIC = "flint" if "flint" in sys.modules else CHOICE
"""Which one proves; what was imported before stays."""
if CHOICE not in ("flint", "stdlib"):
    raise SystemExit(f"REPLICATION_ARITHMETIC is {CHOICE!r:.40}: it must be flint or stdlib")
if ARITHMETIC == "stdlib":
    sys.modules["flint"] = import_module("replication.verify.stdlib")

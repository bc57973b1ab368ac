"""The verifier of certificates: exact and ball arithmetic; imports the standard library and python-flint, nothing else.

It shares no code with what makes certificates, so that it can be read, and trusted, by itself. Where python-flint is
not installed, or REPLICATION_ARITHMETIC is `stdlib`, `stdlib` does its part: all that follows finds it as `flint`.
"""

import os
import sys
from importlib import import_module
from importlib.util import find_spec

ARITHMETIC = "stdlib" if "flint" not in sys.modules and find_spec("flint") is None else os.environ.get(
    "REPLICATION_ARITHMETIC", "flint"
)
if ARITHMETIC == "stdlib":
    sys.modules["flint"] = import_module("replication.verify.stdlib")

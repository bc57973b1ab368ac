"""Statements on filters under nonuniform sampling: levels, and what the method rests on."""

from replication.verify.nonuniform import levels, output, smallgain, stamped, sufficiency, theory, validity

__all__ = ["levels", "output", "smallgain", "stamped", "sufficiency", "theory", "validity"]

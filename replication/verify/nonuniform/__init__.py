"""Statements on filters under nonuniform sampling: levels, and what the method rests on."""

from replication.verify.nonuniform import levels, smallgain, theory, validity

__all__ = ["levels", "smallgain", "theory", "validity"]

"""Statements on filters under nonuniform sampling: levels, and what the method rests on."""

from replication.verify.nonuniform import grid, identities, levels, smallgain

__all__ = ["grid", "identities", "levels", "smallgain"]

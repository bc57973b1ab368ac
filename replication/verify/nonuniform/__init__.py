"""Statements on filters under nonuniform sampling: levels, and what the method rests on."""

from replication.verify.nonuniform import identities, levels, smallgain, theory

__all__ = ["identities", "levels", "smallgain", "theory"]

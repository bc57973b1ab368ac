"""Statements on observers of systems with delays: levels from both sides, approximations, and identities."""

from replication.verify.delay import identity, levels, plant

__all__ = ["identity", "levels", "plant"]

"""Statements on observers of systems with delays: levels from both sides, approximations, and identities."""

from replication.verify.delay import dual, identity, levels, pade

__all__ = ["dual", "identity", "levels", "pade"]

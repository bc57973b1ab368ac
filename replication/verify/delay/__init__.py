"""Statements on observers of systems with delays: levels from both sides, approximations, and identities."""

from replication.verify.delay import identity, levels, pade

__all__ = ["identity", "levels", "pade"]

"""Statements on multi-rate observers: levels, counts, poles and identities."""

from replication.verify.multirate import counts, identities, levels, losses, recovered

__all__ = ["counts", "identities", "levels", "losses", "recovered"]

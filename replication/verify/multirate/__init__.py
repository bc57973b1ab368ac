"""Statements on multi-rate observers: levels, counts, poles and identities."""

from replication.verify.multirate import counts, levels, recovered

__all__ = ["counts", "levels", "recovered"]

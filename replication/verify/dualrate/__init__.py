"""Statements on dual-rate loops: stability and errors, comparisons, the stability result, and the motor."""

from replication.verify.dualrate import errors, loops, theory

__all__ = ["errors", "loops", "theory"]

"""Statements on dual-rate loops: stability and errors, comparisons, the stability theorem, and the motor."""

from replication.verify.dualrate import loops, motor, orders, theory

__all__ = ["loops", "motor", "orders", "theory"]

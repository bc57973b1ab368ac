"""Statements on dual-rate loops: stability and errors, comparisons, the stability result, and the motor."""

from replication.verify.dualrate import loops, lyapunov, response

__all__ = ["loops", "lyapunov", "response"]

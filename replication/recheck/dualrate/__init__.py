"""Dual-rate loops: stability and errors, the stability result, and the motor."""

from replication.recheck.dualrate import errors, motor, stability, steps, theory

CHECKS = stability.CHECKS | errors.CHECKS | theory.CHECKS | steps.CHECKS | motor.CHECKS

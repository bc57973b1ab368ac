"""Dual-rate loops: stability and errors, the stability theorem, and the motor."""

from replication.recheck.dualrate import errors, stability

CHECKS = stability.CHECKS | errors.CHECKS

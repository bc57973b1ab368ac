"""Filters under nonuniform sampling: levels, and what the method rests on."""

from replication.recheck.nonuniform import condition, filters, grid, levels, lower, stamped, theory

CHECKS = levels.CHECKS | lower.CHECKS | stamped.CHECKS | grid.CHECKS | condition.CHECKS | filters.CHECKS | theory.CHECKS

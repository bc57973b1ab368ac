"""Filters under nonuniform sampling: levels, and what the method rests on."""

from replication.recheck.nonuniform import condition, filters, grid, levels, lower, theory

CHECKS = levels.CHECKS | lower.CHECKS | grid.CHECKS | condition.CHECKS | filters.CHECKS | theory.CHECKS

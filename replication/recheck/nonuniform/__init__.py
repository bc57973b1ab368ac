"""Filters under nonuniform sampling: levels, and what the method rests on."""

from replication.recheck.nonuniform import grid, levels, lower, theory

CHECKS = levels.CHECKS | lower.CHECKS | grid.CHECKS | theory.CHECKS

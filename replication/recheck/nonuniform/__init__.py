"""Filters under nonuniform sampling: levels, and what the method rests on."""

from replication.recheck.nonuniform import grid, levels, theory

CHECKS = levels.CHECKS | grid.CHECKS | theory.CHECKS

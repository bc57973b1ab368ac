"""Filters under nonuniform sampling: levels, and what the method rests on."""

from replication.recheck.nonuniform import levels

CHECKS = levels.CHECKS

"""Observers of systems with delays: levels from both sides, approximations, roots, and identities."""

from replication.recheck.delay import identities, inverse, levels, squares

CHECKS = levels.CHECKS | squares.CHECKS | identities.CHECKS | inverse.CHECKS

"""Observers of systems with delays: levels from both sides, approximations, roots, and identities."""

from replication.recheck.delay import functional, identities, inverse, levels, observer, squares

CHECKS = levels.CHECKS | squares.CHECKS | functional.CHECKS | identities.CHECKS | inverse.CHECKS | observer.CHECKS

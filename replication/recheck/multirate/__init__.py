"""Multi-rate observers: levels, counts, identities, and the plant of Sec. IV-C."""

from replication.recheck.multirate import facts, levels, recovered

CHECKS = levels.CHECKS | facts.CHECKS | recovered.CHECKS

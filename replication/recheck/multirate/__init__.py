"""Multi-rate observers: levels, their order, counts, identities, and the plant of Sec. IV-C."""

from replication.recheck.multirate import facts, levels, orders, recovered

CHECKS = levels.CHECKS | orders.CHECKS | facts.CHECKS | recovered.CHECKS

"""Multi-rate observers: levels, also under losses, their order, counts, identities, and the plant of Sec. IV-C."""

from replication.recheck.multirate import facts, levels, losses, orders, recovered

CHECKS = levels.CHECKS | losses.CHECKS | orders.CHECKS | facts.CHECKS | recovered.CHECKS

"""From a printed string and its evidence to a verdict: reading, rounding, agreement, errata, proofs."""

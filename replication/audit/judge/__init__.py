"""From a printed string and evidence to a verdict: rounding, agreement, errata, proofs."""

"""Claims, printed values, verdicts, errata, runner, cache, provenance, rendering. Knows no control theory."""

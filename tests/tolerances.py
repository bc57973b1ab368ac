"""Tolerances of the tests of the estimators, each defined once."""

AGREEMENT = 1e-8
"""Two routes to the same level, relative."""
ACHIEVED = 1e-7
"""Exact norm of returned gains over the optimum, relative."""
BRACKET = 1.1e-8
"""Width of the bracket of an optimum, relative: the margin at which it is designed, and that of the norm."""
ROUNDING = 1e-10
"""The same quantity by two formulas in double precision, relative; small well-scaled matrices."""
ILL_CONDITIONED = 1e-6
"""The same, for generated plants with defective modes or states in units apart by eight powers of ten."""
GRID = 1e-6
"""Shortfall of a maximum over a fine grid of frequencies, relative."""

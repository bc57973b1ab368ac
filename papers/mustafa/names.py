"""Names of the experiments, shared by claims, errata and figures."""

KEY = "mustafa"

NOMINAL = {1: f"{KEY}.nominal.1", 2: f"{KEY}.nominal.2"}
GRIDS = {1: f"{KEY}.grids.1", 2: f"{KEY}.grids.2"}
BRACKET = {1: f"{KEY}.bracket.1", 2: f"{KEY}.bracket.2"}
DURATION = {1: f"{KEY}.bracket-duration.1", 2: f"{KEY}.bracket-duration.2"}
CURVE = {1: f"{KEY}.curve.1", 2: f"{KEY}.curve.2"}
ROBUST = {1: f"{KEY}.robust.1", 2: f"{KEY}.robust.2"}
RANGE = f"{KEY}.against-range"
DRAWS = tuple(f"{KEY}.draws-{part}" for part in range(4))
IDENTITIES = f"{KEY}.identities"

LITERAL = "printed, root, union"
WITH_SET_MINUS = "printed, root, set-minus"
CORRECT = "corrected, alpha, set-minus"
EXACT = 1e-10
"""Relative residual below which an identity counts as one."""

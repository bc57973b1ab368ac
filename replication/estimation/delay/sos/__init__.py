"""Sums of squares for systems with delays: cones, the dissipation inequality and its solution."""

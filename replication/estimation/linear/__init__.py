"""Linear systems, time-invariant and periodic: norms, Riccati equations, lifting."""

"""Kalman filters of multi-rate plants: covariances, gains, running forms, smoothing, trade-off with the level."""

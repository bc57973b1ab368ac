"""Kalman filters of multi-rate plants: covariances, gains, running form, fixed-lag smoothing, trade-off with the level."""

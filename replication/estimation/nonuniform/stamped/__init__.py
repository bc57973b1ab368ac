"""Estimators that take the time stamp of each sample: Kalman filters, and filters with a level for every sequence."""

"""Designs for white noise: the Kalman filter of a delay plant, and what lies between it and the least level."""

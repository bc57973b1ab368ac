"""The Kalman filter that takes the time stamp of each sample, of some or all sensors, in order or late."""

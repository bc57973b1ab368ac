"""Methods that serve this paper alone: the motor, readings of its simulation and their search."""

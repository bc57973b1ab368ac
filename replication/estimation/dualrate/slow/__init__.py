"""Control designed at the slow rate: linear-quadratic-Gaussian and H-infinity on the sampled plant, several rates."""

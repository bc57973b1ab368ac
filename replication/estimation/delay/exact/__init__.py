"""Delay plants without approximation of the delays: the exact optimal level, the exact gain of an observer, its run."""

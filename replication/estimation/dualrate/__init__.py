"""Dual-rate output feedback: fast input, slow sensor; observers, exact analysis and simulation, readings of a text."""

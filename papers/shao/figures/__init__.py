"""Figures on tracking, on stability and on the readings of Table I."""

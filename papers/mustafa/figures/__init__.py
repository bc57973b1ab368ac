"""Figures: the printed responses, and the gains over periods and sequences."""

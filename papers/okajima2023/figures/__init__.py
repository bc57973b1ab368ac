"""Figures: the errors under one draw, and what the paper lacks."""

"""Drawings of numbers against their prints, and of the tables of figures, for the pages of the papers."""

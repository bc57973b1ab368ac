"""Operators on states with delays: their inverse, and the gains of an observer."""

"""Mustafa, Chen and Fujioka: robust H-infinity filtering for nonuniformly sampled systems (2010 or later)."""

from papers.mustafa2010.paper import PAPER

__all__ = ["PAPER"]

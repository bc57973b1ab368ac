"""Mustafa, Chen and Fujioka: robust H-infinity filtering for nonuniformly sampled systems (undated)."""

from papers.mustafa.paper import PAPER

__all__ = ["PAPER"]

"""Peet and Gu: H∞-optimal observers for systems with multiple delays by sums of squares (2019)."""

from papers.peet2019.paper import PAPER

__all__ = ["PAPER"]

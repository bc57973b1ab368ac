"""Okajima, Hosoe and Hagiwara: multi-rate state observers and their design by the l2-induced norm (2023)."""

from papers.okajima2023.paper import PAPER

__all__ = ["PAPER"]

"""Shao, Yang, Li and Yi: the alternating predictive observer for dual-rate systems, on a motor (undated)."""

from papers.shao.paper import PAPER

__all__ = ["PAPER"]

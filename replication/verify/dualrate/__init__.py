"""Statements on dual-rate loops."""

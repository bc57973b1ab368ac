"""Statements on systems with delays."""

"""Certificates of multi-rate levels."""

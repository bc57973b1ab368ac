"""Certificates of observers for systems with delays."""

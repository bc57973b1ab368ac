"""Exact linear algebra, balls, printed decimals and symbols."""

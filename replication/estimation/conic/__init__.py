"""Semidefinite programs: one place that packs them for Clarabel and for SDPA, and their records."""

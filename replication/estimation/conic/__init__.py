"""Semidefinite programs: one form (`program`), one packing for Clarabel (`clarabel`), one call of SDPA (`sdpa`), which
`refined` repeats where it stops short; and what a solver said of itself (`solvers`)."""

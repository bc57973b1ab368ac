"""Semidefinite programs: one form for all, Clarabel, and what a solver said of itself (`program`); SDPA, called
again where it stops short (`sdpa`); one large symmetric matrix and a few scalars (`interior`)."""

"""Makers of certificates: floating-point solutions, rounded to short rationals with room to spare; never trusted.

A maker is called with a theorem, all fields of a certificate but two, and returns these: `maker(theorem) -> {"bound": ..,
"witness": ..}`. Makers of dual-rate loops take the closed loop, which the paper's reading decides. `own` makes the whole
certificate of a design for a plant of one's own.
"""

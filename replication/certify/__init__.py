"""Makers of certificates: floating-point solutions, rounded to short rationals with room to spare; never trusted.

A maker is called with a theorem, all fields of a certificate but two, and returns these two, `bound` and `witness`;
makers of dual-rate loops are called with the closed loop, which a reading of the paper decides. `own` makes the whole
certificate of a design for a plant of one's own.
"""

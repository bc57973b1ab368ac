"""Makers of certificates: floating-point solutions, rounded to short rationals with room to spare; never trusted."""

"""Delays without approximation: the exact least level of a plant, the exact gain of an observer, over ranges too."""

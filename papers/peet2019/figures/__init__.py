"""Figures: Fig. 1 and the gains of an observer, how near the methods come to the optimum, what they cost."""

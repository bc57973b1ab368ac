"""A plant of one's own from a file: read with all mistakes at once, designed for, written out as gains and a page."""

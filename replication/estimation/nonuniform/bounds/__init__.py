"""Gains over every sampling sequence: a proved level, a bad sequence, and what other estimators reach."""

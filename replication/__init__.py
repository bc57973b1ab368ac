"""Replication of four papers on state estimation from slow, irregular and delayed measurements."""

__version__ = "0.1.0"

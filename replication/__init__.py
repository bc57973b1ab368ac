"""Replication of four papers on state estimation with slow or irregular sensors or with delays."""

__version__ = "0.1.0"

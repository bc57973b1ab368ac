"""Levels guaranteed for every sampling sequence: path-dependent Lyapunov functions over the continuum of periods."""

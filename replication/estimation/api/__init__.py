"""What the four methods share towards their users: one family of results, running observers, signal names, exports."""

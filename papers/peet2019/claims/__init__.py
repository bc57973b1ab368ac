"""The claims of the delay paper, by subject."""

"""The claims of the paper, by topic."""

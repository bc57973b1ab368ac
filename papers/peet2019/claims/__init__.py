"""The claims of the delay paper, in the order of its text."""

"""The claims of the nonuniform-sampling paper, by subject."""

"""The claims of the nonuniform-sampling paper, by section, in the order of the text."""

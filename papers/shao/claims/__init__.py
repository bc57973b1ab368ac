"""Claims by section, in the order of the manuscript."""

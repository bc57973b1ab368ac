"""Templates of a new paper: the smallest package that runs, with one of everything."""

"""The observer of a general delay plant on a grid of time: the recursion, its run, its form in C."""

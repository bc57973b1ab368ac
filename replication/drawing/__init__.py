"""The house style of every figure, tidy SVG, and the panels of results; below the library and the audit."""

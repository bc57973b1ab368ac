"""The report: one HTML file made from a results file and its figures alone."""

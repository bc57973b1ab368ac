"""The report: one HTML file from the results alone."""

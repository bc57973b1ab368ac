"""The claims of the multi-rate paper, a module per section, each claim on the function that answers it."""

"""What is computed for the multi-rate paper: pure functions of JSON values."""

"""Delay plants as they are built: sensor noise, delayed outputs and inputs, averages over a delay; small programs."""

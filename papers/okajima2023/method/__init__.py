"""Methods that serve this paper alone: its matrix inequality as printed, reduced, and by its central path."""

"""Methods that serve this paper alone: its Algorithm 1, its matrix inequalities as printed and made robust."""

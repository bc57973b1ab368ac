"""Theorems checked by Coq: statement and theory in `multirate/*.v`, files generated from certificates, and the run."""

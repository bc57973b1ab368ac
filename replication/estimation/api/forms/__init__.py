"""Running observers outside their program: files that load again, MATLAB functions, state spaces, signals by name."""

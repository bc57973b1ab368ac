"""What a run gives to terminals, other programs and archives, and the tutorials as pages."""

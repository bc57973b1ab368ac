"""Results looked at again: derived anew, compared, perturbed, counted."""

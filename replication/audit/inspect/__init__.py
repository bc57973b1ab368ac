"""Results looked at again: derived anew, compared with others, altered on purpose, counted."""

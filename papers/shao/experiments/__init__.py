"""What is computed: the motor and its stability, the theorem, tracking, the search of readings of Table I."""

"""What is computed: levels, brackets, draws, the small-gain argument; `declared` lists it with its inputs."""

"""What is computed: levels and brackets, draws of the figures, identities; `declared` lists it with its inputs."""

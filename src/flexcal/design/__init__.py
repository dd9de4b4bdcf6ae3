"""Design of experiments from the model alone."""

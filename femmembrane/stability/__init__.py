"""Is an equilibrium a minimum, and against which perturbations: the second variation and its spectrum."""

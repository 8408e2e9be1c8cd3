"""How accurate an answer is and what it costs: convergence, methods that share nothing with the finite elements, work against precision."""

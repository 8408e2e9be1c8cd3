"""How accurate an answer is and what it costs: methods that share nothing with the finite elements, and work-precision studies."""

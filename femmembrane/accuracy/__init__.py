"""How accurate an answer is."""

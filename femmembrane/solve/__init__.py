"""From a potential to its equilibria: controls, IPOPT, the bordered Newton corrector and continuation."""

"""Formulas as pure functions of quadrature-point values: NumPy arrays and CasADi symbols alike (both answer NumPy's ufuncs)."""

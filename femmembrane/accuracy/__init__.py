"""How far answers are from those of the continuum, meshes that keep them near, independent methods, and what accuracy costs."""

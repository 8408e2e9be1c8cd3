"""How far answers are from those of the continuum, and meshes that keep them as near as is asked for."""

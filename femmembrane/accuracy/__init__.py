"""Errors of answers, meshes that keep them small, independent methods, and what accuracy costs."""

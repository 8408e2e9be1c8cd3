"""Cases that break codes of this kind, what must come out of each, and what does: one registry, one module a family."""

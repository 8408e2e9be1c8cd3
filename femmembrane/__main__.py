"""``python -m femmembrane``: the same as the command ``femmembrane``."""

from __future__ import annotations

from .cli import main

if __name__ == "__main__":
    raise SystemExit(main())

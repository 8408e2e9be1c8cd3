"""Checks of single values."""

from __future__ import annotations

import math
from numbers import Real


def is_number(value: object) -> bool:
    """Whether a value is a finite number, NumPy's included; truth values are none."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(float(value))
    except OverflowError:  # a whole number that no float can hold
        return False

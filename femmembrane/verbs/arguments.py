"""Checks of arguments that several verbs share."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import InputError, unknown_name

ILL_POSED = ("stop", "mark")


def check_max_steps(max_steps: Any) -> None:
    """Raise InputError unless a largest number of steps is a whole number >= 1."""
    if isinstance(max_steps, bool) or not isinstance(max_steps, (int, np.integer)) or max_steps < 1:
        raise InputError("max_steps", max_steps, "a whole number >= 1 is allowed")


def check_ill_posed(ill_posed: Any) -> None:
    """Raise InputError unless what to do in compression is known."""
    if ill_posed not in ILL_POSED:
        raise unknown_name("ill_posed", str(ill_posed), ILL_POSED)

"""What is said of values at which a trace was to end, and did not."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..quantities import QUANTITIES, readable_kind, words
from ..scene import Scene
from ..scene.run import GAS
from .arguments import kind_of

#: kinds of the special points at which quantities have an extreme value, and what they are called; over a number those of the number alone
_FOLDS = {
    "pressure": ("limit_point", "a limit point"),
    "volume": ("volume_fold", "a volume fold"),
    "center_height": ("height_fold", "a height fold"),
}
_OF_NUMBER = ("number_fold", "a limit point in the number")


def value_in_words(scene: Scene, name: str, value: float) -> str:
    """A value of a quantity, or of a number of the scene; of a scene with scales in SI units as well: "3.75 (60 kPa)"."""
    kind = kind_of(name)
    measured = f" ({readable_kind(kind, value, scene.scales)})" if kind and scene.scales is not None else ""
    return f"{value + 0.0:.6g}{measured}"


def in_words(scene: Scene, targets: Mapping[str, float]) -> str:
    """All values at which a trace was to end: "pressure 3.75 (60 kPa) or volume 5 (40 ml)"."""
    return " or ".join(f"{_words(name)} {value_in_words(scene, name, value)}" for name, value in targets.items()) or "an end"


def turned_back(scene: Scene, equilibria: Sequence[Any], points: Sequence[Any], targets: Mapping[str, float]) -> str:
    """Where a branch turned back before the values at which it was to end, in words; empty unless it goes away from all of them since.

    Parameters
    ----------
    scene : Scene
    equilibria, points : sequence
        The branch, and its special points.
    targets : mapping of str to float
    """
    said = [_turn(scene, equilibria, points, name, value) for name, value in targets.items()]
    return "; ".join(said) if all(said) else ""


def _turn(scene: Scene, equilibria: Sequence[Any], points: Sequence[Any], name: str, target: float) -> str:
    values = np.array([place_of(eq, name) for eq in equilibria])
    ahead = 1.0 if target > values[-1] else -1.0
    top = int(np.argmax(ahead * values))
    if not 0 < top < len(values) - 1 or not (ahead * np.diff(values[top:]) < 0).all() or not ahead * (target - values[top]) > 0:
        return ""
    extreme, since = ("maximum", "falls") if ahead > 0 else ("minimum", "rises")
    kind, where = _OF_NUMBER if "." in name else _FOLDS.get(name, ("", ""))
    there = [place_of(point, name) for point in points if str(point.kind) == kind]
    best = max(there, key=lambda found: ahead * found, default=math.nan)
    if ahead * (best - values[top]) >= 0 and ahead * (target - best) > 0:
        return f"the {_words(name)} has a {extreme} of {value_in_words(scene, name, best)} at {where}, and {since} since"
    at = f"V = {equilibria[top].volume:.6g}"
    return f"the {_words(name)} has a {extreme} near {value_in_words(scene, name, values[top])}, at {at}, and {since} since"


def _words(name: str) -> str:
    return words(name) if name in QUANTITIES else name


def place_of(place: Any, name: str) -> float:
    """A quantity, or a number of the scene, in an equilibrium or at a special point."""
    equilibrium = getattr(place, "equilibrium", place)
    if "." in name:
        return float(equilibrium.number(name))
    return float(getattr(equilibrium, "gas_amount", math.nan) if name == GAS else getattr(place, name))

"""In which units pictures and tables show a number of a scene.

Lengths, pressures, forces and strengths follow the scales of the scene. What electrodes with a permittivity are given stands in the scene
in SI units, and is shown so in either system.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..physics.magnetics import Dipole
from ..physics.magnets import Magnet
from ..physics.scales import SQUARED
from ..physics.sources import Loop, Solenoid, Uniform, Wire
from ..quantities import Units, key_label
from .laboratory import number_kind

if TYPE_CHECKING:
    from .value import Scene

#: what the strengths of sources say
_STRENGTHS = {
    **dict.fromkeys((Dipole, Loop, Magnet, Solenoid), "dipole_strength"),
    Wire: "wire_strength",
    Uniform: "uniform_strength",
}
_ELECTRIC = {"voltage": "V", "total_charge": "C", "frozen_charge": "C/m²"}


@dataclass(frozen=True)
class ShownNumber:
    """A number of a scene as it is shown.

    Attributes
    ----------
    label : str
        Text at an axis, with the unit.
    heading : str
        Its name with the unit.
    into : callable
        From the numbers of the scene, as an array, to those that are shown.
    """

    label: str
    heading: str
    into: Callable[[Any], NDArray[np.float64]]


def shown_number(scene: Scene, key: str, units: Units) -> ShownNumber:
    """How a number of a scene is shown in these units.

    Parameters
    ----------
    scene : Scene
    key : str
        Its name.
    units : Units
    """
    table, _, name = key.partition(".")
    if table == "electric" and scene.electric is not None and scene.electric.relative_permittivity is not None:
        return _in(_ELECTRIC.get(name, ""), key, _as_it_is)
    return shown_kind(key, _kind(scene, key), units)


def shown_kind(key: str, kind: str, units: Units) -> ShownNumber:
    """How a number of a kind is shown in these units; one without a kind as it is."""
    unit, factor = units.of_kind(kind)
    return _in(unit, key, partial(_converted, factor, kind in SQUARED) if unit else _as_it_is)


def _in(unit: str, key: str, into: Callable[[Any], NDArray[np.float64]]) -> ShownNumber:
    return ShownNumber(key_label(key, unit), f"{key} in {unit}" if unit else key, into)


def _as_it_is(values: Any) -> NDArray[np.float64]:
    return np.asarray(values, dtype=float)


def _converted(factor: float, squared: bool, values: Any) -> NDArray[np.float64]:
    found = np.asarray(values, dtype=float)
    # a curve between two strengths may swing below 0 by a little, and what is measured is a root of a strength
    return factor * (np.sqrt(np.maximum(found, 0.0)) if squared else found)


def _kind(scene: Scene, key: str) -> str:
    table, _, rest = key.partition(".")
    if table == "membrane":
        return "remanence" if rest in ("saturation", "remanence") else ""
    place, _, name = rest.partition(".")
    if table == "source" and name == "strength":
        return _STRENGTHS.get(type(scene.sources[int(place)]), "")
    return number_kind(key)

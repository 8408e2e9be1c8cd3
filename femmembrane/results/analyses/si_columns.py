"""Places, energies and electric quantities in SI units, of a scene with scales."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...quantities import ELECTRIC, PLACES, Units, electric_quantities, in_si, quantity
from .base import Cell, EquilibriumAnalysis, PrintedColumn, printed_in

if TYPE_CHECKING:
    from ...scene import Scene
    from ..equilibrium import Equilibrium
    from ..special_point import SpecialPoint


#: the quantity of each of its columns
_COLUMNS = {in_si(name): name for name in (*PLACES, "elastic_energy", "magnetic_energy", "load_energy", "electric_energy", *ELECTRIC)}


class SIColumns(EquilibriumAnalysis):
    """Volume, pressure, pole height, energies and what is electric in SI units; a scene asks for them by its table [scales]."""

    def asked(self, scene: Scene) -> bool:
        return scene.scales is not None

    def columns(self, scene: Scene) -> Sequence[str]:
        return [in_si(name) for name in _names(scene)]

    def value(self, equilibrium: Equilibrium, column: str) -> Cell:
        return _converted(equilibrium, column, equilibrium.scene)

    def point_columns(self, scene: Scene) -> Sequence[str]:
        return [in_si(name) for name in PLACES]

    def point_value(self, point: SpecialPoint, column: str) -> Cell:
        return _converted(point, column, point.equilibrium.scene)

    def printed(self, scene: Scene) -> Sequence[PrintedColumn]:
        units = Units(scene.converter)
        return [printed_in(name, units) for name in PLACES]


def _names(scene: Scene) -> list[str]:
    parts = {"magnetic_energy": scene.sources, "load_energy": scene.loads, "electric_energy": scene.electric}
    converter = scene.converter
    electric = [name for name in electric_quantities(scene) if converter is not None and converter.converts(quantity(name).si)]
    return [*PLACES, "elastic_energy", *(name for name, part in parts.items() if part), *electric]


def _converted(place: Equilibrium | SpecialPoint, column: str, scene: Scene) -> float:
    name, scales = _COLUMNS[column], scene.converter
    if scales is None or not scales.converts(quantity(name).si):
        return float("nan")
    return float(scales.to_si(quantity(name).si, float(getattr(place, name))))

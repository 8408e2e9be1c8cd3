"""Places and energies in SI units, of a scene with scales."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...quantities import PLACES, Units, heading_in, in_si, quantity, written
from .base import Cell, EquilibriumAnalysis, PrintedColumn

if TYPE_CHECKING:
    from ...scene import Scene
    from ..equilibrium import Equilibrium
    from ..special_point import SpecialPoint


class SIColumns(EquilibriumAnalysis):
    """Volume, pressure, pole height and energies in SI units; a scene asks for them by its table [scales]."""

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
        units = Units(scene.scales)
        return [_printed(name, units) for name in PLACES]


def _names(scene: Scene) -> list[str]:
    parts = {"magnetic_energy": scene.sources, "load_energy": scene.loads, "electric_energy": scene.electric}
    return [*PLACES, "elastic_energy", *(name for name, part in parts.items() if part)]


def _converted(place: Equilibrium | SpecialPoint, column: str, scene: Scene) -> float:
    name = next(name for name in (*PLACES, "elastic_energy", "magnetic_energy", "load_energy", "electric_energy") if in_si(name) == column)
    scales = scene.scales
    return float("nan") if scales is None else float(scales.to_si(quantity(name).si, float(getattr(place, name))))


def _printed(name: str, units: Units) -> PrintedColumn:
    head = heading_in(name, units)
    width = max(12, len(head))
    return PrintedColumn(
        f"{head:>{width}}", lambda equilibrium: written(in_si(name), getattr(equilibrium, name) * units.factor(name), width), width
    )

"""The pressure in Pa, of a scene with scales."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...quantities import in_si, quantity
from .base import Cell, EquilibriumAnalysis

if TYPE_CHECKING:
    from ...scene import Scene
    from ..equilibrium import Equilibrium


class Pascals(EquilibriumAnalysis):
    """The pressure in Pa; a scene asks for it by its table [scales]."""

    def asked(self, scene: Scene) -> bool:
        return scene.scales is not None

    def columns(self, scene: Scene) -> Sequence[str]:
        return (in_si("pressure"),)

    def value(self, equilibrium: Equilibrium, column: str) -> Cell:
        scales = equilibrium.scene.scales
        return float("nan") if scales is None else float(scales.to_si(quantity("pressure").si, equilibrium.pressure))

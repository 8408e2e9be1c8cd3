"""Voltage, charge, capacitance and true field, of a scene with electrodes: its table [electric] asks for them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from ...quantities import Units, electric_quantities, quantity, readable, words
from .base import Cell, Curves, EquilibriumAnalysis, PrintedColumn, Remark, Section, printed_in

if TYPE_CHECKING:
    from ...scene import Scene
    from ..branch import Branch
    from ..equilibrium import Equilibrium
    from ..special_point import SpecialPoint


class Electrics(EquilibriumAnalysis):
    """What the electrodes have. The ratio to a breakdown field is there where the scene gives one."""

    def asked(self, scene: Scene) -> bool:
        return scene.electric is not None

    def columns(self, scene: Scene) -> Sequence[str]:
        electric: Any = scene.electric
        return (*electric_quantities(scene), *([] if electric.breakdown is None else ["breakdown_ratio"]))

    def value(self, equilibrium: Equilibrium, column: str) -> Cell:
        return float(getattr(equilibrium, column))

    def point_columns(self, scene: Scene) -> Sequence[str]:
        return self.columns(scene)

    def point_value(self, point: SpecialPoint, column: str) -> Cell:
        return self.value(point.equilibrium, column)

    def printed(self, scene: Scene) -> Sequence[PrintedColumn]:
        """Voltage and charge, in the units of the scene."""
        units = Units(scene.converter)
        return [printed_in(name, units) for name in electric_quantities(scene) if name in ("voltage", "charge")]

    def remarks(self, equilibrium: Equilibrium) -> Iterator[Remark]:
        scales, scene = equilibrium.scene.converter, equilibrium.scene
        for name in electric_quantities(scene):
            value = float(getattr(equilibrium, name))
            known = scales is not None and scales.converts(quantity(name).si)
            text = readable(name, value, scales) if known and scales is not None else f"{value:.6g}"
            if name == "electric_field" and scene.electric is not None and scene.electric.breakdown is not None:
                text += f", {equilibrium.breakdown_ratio:.4g} of the breakdown field"
            yield Remark("largest electric field" if name == "electric_field" else words(name), text)

    def section(self, branch: Branch) -> Section:
        curves = {words(name): branch.column(name) for name in self.columns(branch.scene) if name != "capacitance"}
        figure = Curves("Voltage, charge and field along the branch", "in units of the package", curves)
        return Section("Voltage and charge", figure, last=tuple(self.remarks(branch[-1])))

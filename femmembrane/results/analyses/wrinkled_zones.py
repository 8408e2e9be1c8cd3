"""Taut and wrinkled zones: the key ``wrinkling`` of [analysis]."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import files
from ...quantities import heading, typed
from .. import door
from ..zones import KINDS
from .base import Cell, Drawing, EquilibriumAnalysis, PrintedColumn, Remark, Section, Table, Variable
from .verdicts import stretches

if TYPE_CHECKING:
    from ...scene import Scene
    from ..branch import Branch
    from ..equilibrium import Equilibrium

#: the columns of ``zones.csv``; variables have these names after ``zone_``
ZONE_COLUMNS = ("step", "kind", "r_start", "r_end", "rho_start", "rho_end", "area_fraction", "deformed_area_fraction")
#: most rows of the table of a report
_MOST_ROWS = 60


def zone_rows(branch: Branch) -> Iterator[list[Any]]:
    """One row for each zone of each equilibrium, from the pole to the rim, in the order of :data:`ZONE_COLUMNS`."""
    for step, equilibrium in enumerate(branch):
        for zone in equilibrium.zones():
            yield [step, zone.kind, *zone.r, *zone.rho, zone.area_fraction, zone.deformed_area_fraction]


def write_zones_csv(branch: Branch, path: str | PathLike[str]) -> None:
    """Write the zones by the criterion of the scene."""
    files.write_csv(path, list(ZONE_COLUMNS), zone_rows(branch))


class WrinkledZones(EquilibriumAnalysis):
    """The zones by the signs of the principal stresses, and their parts of the area; a loaded branch finds them again from its states."""

    tables: ClassVar = {"zones.csv": write_zones_csv}
    pictures: ClassVar = {"zones.png": door.plot_zones}

    def asked(self, scene: Scene) -> bool:
        return bool(scene.analysis.wrinkling)

    def columns(self, scene: Scene) -> Sequence[str]:
        return self.more_columns()

    def more_columns(self) -> Sequence[str]:
        return tuple(f"fraction_{kind}" for kind in KINDS)

    def value(self, equilibrium: Equilibrium, column: str) -> Cell:
        return equilibrium.zones().fraction(column.removeprefix("fraction_"))

    def variables(self, branch: Branch) -> Mapping[str, Variable]:
        """The zones one after the other, for other readers of the file."""
        table = list(zone_rows(branch))
        columns = zip(*table, strict=True) if table else ([] for _ in ZONE_COLUMNS)
        return {f"zone_{name}": (("zone",), typed(name, column)) for name, column in zip(ZONE_COLUMNS, columns, strict=True)}

    def at_nodes(self, equilibrium: Equilibrium) -> Mapping[str, NDArray[Any]]:
        return {"zone": equilibrium.zones().numbers(equilibrium.potential.space.node_parameters()).astype(np.int32)}

    def remarks(self, equilibrium: Equilibrium) -> Iterator[Remark]:
        yield Remark("zones", equilibrium.zones().summary)

    def printed(self, scene: Scene) -> Sequence[PrintedColumn]:
        return [PrintedColumn("zones", lambda equilibrium: equilibrium.zones().summary)]

    def section(self, branch: Branch) -> Section:
        runs = [steps for _, steps in stretches([", ".join(e.zones().kinds) for e in branch])]
        wrinkled = 1 - branch.column("fraction_taut")
        ends = [dict.fromkeys(sorted((steps[0], steps[int(np.argmax(wrinkled[steps]))], steps[-1]))) for steps in runs]
        shown = [step for steps in ends for step in steps][:_MOST_ROWS]
        rows = [[step, branch[step].volume, branch[step].zones().summary] for step in shown]
        caption = "First and last step with the same kinds of zones and the one with most wrinkles, and parts of the reference area"
        table = Table(["step", heading("volume"), "zones"], rows, caption)
        return Section("Zones", Drawing("Taut and wrinkled zones", door.draw_zones), table)

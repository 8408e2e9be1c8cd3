"""A branch as tables: one row an equilibrium, and only the columns that the scene asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import starmap
from os import PathLike
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from .. import files
from ..errors import unknown_name
from ..scene.variation import names
from .analyses import ANALYSES, asked, typed_column
from .analyses.base import Cell, EquilibriumAnalysis
from .zones import ZONE_CHANGES

if TYPE_CHECKING:
    import pandas

    from ..scene import Scene
    from .branch import Branch
    from .equilibrium import Equilibrium
    from .special_point import SpecialPoint

SPECIAL_POINT_COLUMNS = ("kind", "volume", "pressure", "center_height", "error")
#: what every scene has at the end of its tables
_LAST = ("residual", "iterations", "seconds")
#: the mesh of an equilibrium, where it changes along the branch
_OF_MESH = ("elements", "degree")


def columns(branch: Branch) -> list[str]:
    """Names of the columns of a branch, in the order of ``branch.csv``.

    Behind the step stands the number of the scene that changes along the branch, if one does. Between those that every branch has stand
    ``magnetic_energy`` when the scene has sources, ``load_energy`` when it has loads, ``electric_energy`` when it has
    electrodes, the columns of the analyses that the scene asks for, and ``elements`` and ``degree`` where the mesh changes.
    """
    scene = branch.scene
    return [
        "step",
        *([branch.over] if branch.over else []),
        *("volume", "pressure", "center_height", "elastic_energy"),
        *(["magnetic_energy"] if scene.sources else []),
        *(["load_energy"] if scene.loads else []),
        *(["electric_energy"] if scene.electric else []),
        *(["gas"] if scene.chamber else []),
        *(name for analysis in asked(scene) for name in analysis.columns(scene)),
        *(_OF_MESH if branch.mesh_changes else ()),
        *_LAST,
    ]


def reader(scene: Scene, column: str) -> Callable[[int, Equilibrium], Cell]:
    """Who reads the cells of a column off the equilibria and their steps, for a branch of a scene."""
    if column == "step":
        return lambda step, equilibrium: step
    if column == "status":
        return lambda step, equilibrium: equilibrium.status.value
    own = [analysis for analysis in asked(scene) if column in analysis.columns(scene)]
    own += [analysis for analysis in ANALYSES if analysis.knows(column)]
    if own:
        value = own[0].value
        return lambda step, equilibrium: value(equilibrium, column)
    if column in _OF_MESH:
        return lambda step, equilibrium: int(equilibrium.scene.mesh.elements if column == "elements" else equilibrium.scene.degree)
    if column == "gas":
        return lambda step, equilibrium: equilibrium.gas_amount
    if "." in column:
        return lambda step, equilibrium: equilibrium.number(column)
    kind = int if column == "iterations" else float
    return lambda step, equilibrium: kind(getattr(equilibrium, column))


def known_columns(branch: Branch) -> list[str]:
    """Names that :meth:`Branch.column` knows: :func:`columns`, and columns that are computed only when they are asked for.

    Verdicts against azimuthal perturbations of any number of waves are left out of the list.
    """
    more = (name for analysis in ANALYSES for name in analysis.more_columns())
    return list(dict.fromkeys([*columns(branch), *names(branch.scene), "magnetic_energy", "load_energy", "status", *_OF_MESH, *more]))


def column(branch: Branch, name: str) -> NDArray[Any]:
    """One column, of the type of its quantity.

    Raises
    ------
    InputError
        For an unknown name.
    """
    known = known_columns(branch)
    if name not in known and not (isinstance(name, str) and any(analysis.knows(name) for analysis in ANALYSES)):
        raise unknown_name("column", name, known)
    return typed_column(name, starmap(reader(branch.scene, name), enumerate(branch)))


def rows(branch: Branch) -> Iterator[list[Cell]]:
    """The rows of the table, in the order of :func:`columns`."""
    readers = [reader(branch.scene, name) for name in columns(branch)]
    for step, equilibrium in enumerate(branch):
        yield [read(step, equilibrium) for read in readers]


def write_csv(branch: Branch, path: str | PathLike[str]) -> None:
    """Write :func:`rows` under a header line, with :func:`femmembrane.files.write_csv`."""
    files.write_csv(path, columns(branch), rows(branch))


def special_point_rows(branch: Branch) -> Iterator[list[Any]]:
    """One row for each special point of the branch, in the order of :func:`special_point_columns`."""
    values = [
        *(partial(_attribute, name=name) for name in _located_by(branch)),
        *(partial(_zone_attribute, name=name) for name in _zones_changing(branch)),
        *(partial(analysis.point_value, column=name) for analysis, name in _of_points(branch)),
    ]
    for point in branch.special_points or ():
        yield [value(point) for value in values]


def _located_by(branch: Branch) -> list[str]:
    kind, *places = SPECIAL_POINT_COLUMNS
    return [kind, *([branch.over] if branch.over else []), *places]


def _attribute(point: SpecialPoint, name: str) -> Any:
    return point.equilibrium.number(name) if "." in name else getattr(point, name)


def _zones_changing(branch: Branch) -> tuple[str, ...]:
    """What is told of zones that open or close, where some do."""
    return ZONE_CHANGES if any(point.zone for point in branch.special_points or ()) else ()


def _zone_attribute(point: SpecialPoint, name: str) -> Cell:
    return "" if point.zone is None else getattr(point.zone, name)


def _of_points(branch: Branch) -> list[tuple[EquilibriumAnalysis, str]]:
    scene, points = branch.scene, branch.special_points or ()
    return [(each, name) for each in asked(scene) for name in (*each.point_columns(scene), *each.found_columns(points))]


def special_point_columns(branch: Branch) -> list[str]:
    """Columns of ``special_points.csv``: kind, a number that changes along the branch, volume, pressure, center_height, error, those of
    zones that open or close, and those of the analyses of the scene."""
    changing = (f"changing_zone_{name}" for name in _zones_changing(branch))
    return [*_located_by(branch), *changing, *(name for _, name in _of_points(branch))]


def write_special_points_csv(branch: Branch, path: str | PathLike[str]) -> None:
    """Write the special points; no rows means that the branch was searched and has none."""
    files.write_csv(path, special_point_columns(branch), special_point_rows(branch))


def to_dataframe(branch: Branch) -> pandas.DataFrame:
    """The table as a pandas data frame with the columns of ``branch.csv``."""
    import pandas

    return pandas.DataFrame(list(rows(branch)), columns=columns(branch))

"""A branch as tables: one row an equilibrium, and only the columns that the scene asks for."""

from __future__ import annotations

import re
from collections.abc import Iterator
from os import PathLike
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from .. import files
from ..errors import unknown_name
from ..quantities import in_si, quantity, typed
from .zones import KINDS

if TYPE_CHECKING:
    import pandas

    from ..scene import Scene
    from .records import Branch, Equilibrium

#: the order in which verdicts of the two controls are listed
CONTROLS = ("pressure", "volume")
SPECIAL_POINT_COLUMNS = ("kind", "volume", "pressure", "center_height", "error")
ZONE_COLUMNS = ("step", "kind", "r_start", "r_end", "rho_start", "rho_end", "area_fraction", "deformed_area_fraction")


def columns(branch: Branch) -> list[str]:
    """Names of the columns of a branch, in the order of ``branch.csv``.

    ``lambda_`` and ``verdict_`` exist for the controls in ``scene.analysis.stability``, ``lambda_n`` for the modes in
    ``scene.analysis.azimuthal_modes``, ``magnetic_energy`` when the scene has sources, ``load_energy`` when it has loads, ``pressure_pa``
    when it has scales, ``fraction_`` of the area for each kind of zone if it asks for ``wrinkling``, ``error_`` (relative, estimated) if it
    asks for ``error_estimates``.
    """
    scene = branch.scene
    controls = [c for c in CONTROLS if c in scene.analysis.stability]
    return [
        *("step", "volume", "pressure", "center_height", "elastic_energy"),
        *(["magnetic_energy"] if scene.sources else []),
        *(["load_energy"] if scene.loads else []),
        *(f"lambda_{c}" for c in controls),
        *(f"verdict_{c}" for c in controls),
        *(f"lambda_n{n}" for n in scene.analysis.azimuthal_modes),
        *([in_si("pressure")] if scene.scales else []),
        *((f"fraction_{kind}" for kind in KINDS) if scene.analysis.wrinkling else ()),
        *(f"error_{name}" for name in estimated(scene)[1]),
        *("residual", "iterations", "seconds"),
    ]


def estimated(scene: Scene) -> tuple[str, tuple[str, ...]]:
    """What is held while errors are estimated, and the quantities whose relative errors are columns; none unless asked for.

    Held is what the scene's [run] prescribes; the volume with arc length and without a run.
    """
    run = scene.run
    control = (run.quantity if run is not None else None) or "volume"
    free = tuple(name for name in ("pressure", "volume") if name != control)
    return control, (*free, "energy") if scene.analysis.error_estimates else ()


def value(equilibrium: Equilibrium, step: int, column: str, held: str = "volume") -> float | int | str:
    """One cell: what a column says about the equilibrium at a step; ``held`` while its errors are estimated."""
    if column == "step":
        return step
    kind, _, name = column.partition("_")
    if kind in ("verdict", "lambda"):
        verdict = equilibrium.verdict(azimuthal=int(name[1:])) if name[1:].isdigit() else equilibrium.verdict(name)
        return verdict.word if kind == "verdict" else float(verdict.smallest_eigenvalue)
    if column == "status":
        return equilibrium.status.value
    scales = equilibrium.scene.scales
    if column == in_si("pressure") and scales is not None:
        return scales.to_si(quantity("pressure").si, equilibrium.pressure)
    if kind == "error":
        return float(getattr(equilibrium.error_estimate(held), name).relative)
    if kind == "fraction":
        return equilibrium.zones().fraction(name)
    if column == "iterations":
        return int(equilibrium.iterations)
    return float(getattr(equilibrium, column))


def known_columns(branch: Branch) -> list[str]:
    """What :meth:`Branch.column` may be asked for: :func:`columns`, and what costs a look at the equilibria only when it is asked for.

    Verdicts against azimuthal perturbations of any number of waves are left out of the list.
    """
    more = [*("magnetic_energy", "load_energy", "status"), *(f"{k}_{c}" for k in ("lambda", "verdict") for c in CONTROLS)]
    return list(dict.fromkeys([*columns(branch), *more, *(f"fraction_{kind}" for kind in KINDS)]))


def column(branch: Branch, name: str) -> NDArray[Any]:
    """One column, of the type of its quantity.

    Raises
    ------
    InputError
        For an unknown name.
    """
    known = known_columns(branch)
    if name not in known and not (isinstance(name, str) and re.fullmatch(r"(lambda|verdict)_n[1-9]\d*", name)):
        raise unknown_name("column", name, known)
    held, _ = estimated(branch.scene)
    return typed(name, (value(equilibrium, step, name, held) for step, equilibrium in enumerate(branch)))


def rows(branch: Branch) -> Iterator[list[float | int | str]]:
    """The rows of the table, in the order of :func:`columns`."""
    names, (held, _) = columns(branch), estimated(branch.scene)
    for step, equilibrium in enumerate(branch):
        yield [value(equilibrium, step, name, held) for name in names]


def write_csv(branch: Branch, path: str | PathLike[str]) -> None:
    """Write :func:`rows` under a header line, with :func:`femmembrane.files.write_csv`."""
    files.write_csv(path, columns(branch), rows(branch))


def special_point_rows(branch: Branch) -> Iterator[list[Any]]:
    """One row for each special point of the branch, in the order of :func:`special_point_columns`."""
    for point in branch.special_points or ():
        yield [getattr(point, name) for name in special_point_columns(branch)]


def special_point_columns(branch: Branch) -> list[str]:
    """Columns of ``special_points.csv``: kind, volume, pressure, center_height, error, and azimuthal if such modes were asked for."""
    return [*SPECIAL_POINT_COLUMNS, *(["azimuthal"] if branch.scene.analysis.azimuthal_modes else [])]


def write_special_points_csv(branch: Branch, path: str | PathLike[str]) -> None:
    """Write the special points; no rows means that the branch was searched and has none."""
    files.write_csv(path, special_point_columns(branch), special_point_rows(branch))


def zone_rows(branch: Branch) -> Iterator[list[Any]]:
    """One row for each zone of each equilibrium, from the pole to the rim, in the order of :data:`ZONE_COLUMNS`."""
    for step, equilibrium in enumerate(branch):
        for zone in equilibrium.zones():
            yield [step, zone.kind, *zone.r, *zone.rho, zone.area_fraction, zone.deformed_area_fraction]


def write_zones_csv(branch: Branch, path: str | PathLike[str]) -> None:
    """Write the zones by the criterion of the scene."""
    files.write_csv(path, list(ZONE_COLUMNS), zone_rows(branch))


def to_dataframe(branch: Branch) -> pandas.DataFrame:
    """The table as a pandas data frame with the columns of ``branch.csv``."""
    import pandas

    return pandas.DataFrame(list(rows(branch)), columns=columns(branch))

"""Every quantity that is shown or stored: what it is, its unit, and how it is written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Quantity:
    """A quantity of tables, files and pictures.

    Attributes
    ----------
    meaning : str
        What it is, in words: ``long_name`` in files.
    unit : str
        1 for a non-dimensional one.
    symbol : str
        Heading of its column where a person reads the table; empty where its name, with blanks, is the heading.
    label : str
        Text at an axis; empty for what no axis shows.
    type : {float, int, str}
        What its values are in files and columns.
    """

    meaning: str
    unit: str = "1"
    symbol: str = ""
    label: str = ""
    type: type[float] | type[int] | type[str] = float


_STRESSES = {
    "mechanical_stress_1": "meridional mechanical stress",
    "mechanical_stress_2": "circumferential mechanical stress",
    "total_stress_1": "meridional total stress",
    "total_stress_2": "circumferential total stress",
}
#: every quantity that is shown or stored, by the name that it has in tables and files
QUANTITIES: Mapping[str, Quantity] = {
    "step": Quantity("number of the equilibrium along the branch", type=int),
    "volume": Quantity("enclosed volume V/R0^3, signed", symbol="V", label="volume V/R₀³"),
    "pressure": Quantity("pressure P = p R0/(mu T)", symbol="P", label="pressure P = pR₀/(μT)"),
    "pressure_pa": Quantity("pressure p", "Pa"),
    "center_height": Quantity(
        "height of the pole, or the first point of the meridian, over R0",
        symbol="pole height",
        label="pole height η(0)/R₀",
    ),
    "elastic_energy": Quantity("elastic energy over mu T R0^2"),
    "magnetic_energy": Quantity("magnetic energy over mu T R0^2"),
    "load_energy": Quantity("energy of the loads over mu T R0^2"),
    "electric_energy": Quantity("energy of voltage or charge over mu T R0^2"),
    "voltage": Quantity("voltage (Phi/T) sqrt(eps/mu)", symbol="phi", label="voltage φ"),
    "charge": Quantity("charge over R0^2 sqrt(eps mu)", label="charge"),
    "capacitance": Quantity("capacitance over eps R0^2/T"),
    "electric_field": Quantity("true electric field over sqrt(mu/eps)", label="electric field"),
    "breakdown_ratio": Quantity("largest true electric field over the breakdown field"),
    "residual": Quantity("out-of-balance force relative to the forces in balance"),
    "iterations": Quantity("solver iterations, rejected attempts included", type=int),
    "seconds": Quantity("wall time spent on the equilibrium", "s"),
    "status": Quantity("how the solve ended", type=str),
    "state": Quantity("displacement coefficients over R0 on the free degrees of freedom"),
    "r": Quantity("reference radius of the node over R0"),
    "s": Quantity("arc length of the reference meridian from its first end to the node, over R0"),
    "rho": Quantity("deformed radius over R0", label="radius ρ/R₀"),  # noqa: RUF001
    "eta": Quantity("deformed height over R0"),
    "stretch_1": Quantity("meridional stretch"),
    "stretch_2": Quantity("circumferential stretch"),
    **{name: Quantity(f"{stress} over mu") for name, stress in _STRESSES.items()},
    **{f"{name}_pa": Quantity(stress, "Pa") for name, stress in _STRESSES.items()},
    "kind": Quantity("kind of the special point", type=str),
    "error": Quantity("uncertainty of the special point's location"),
    "tangent": Quantity("direction of the branch on which it was found, in the unknowns and the pressure"),
    "azimuthal": Quantity("number of waves around the axis of the instability that sets in", type=int),
    "trace_sigma": Quantity("arc length, or load, at the last points of the path"),
    "trace_point": Quantity("state and pressure at the last points of the path"),
    "trace_slope": Quantity("their derivatives with respect to arc length or load"),
    "jump_index": Quantity("number of the equilibrium that a snap of the membrane landed on", type=int),
    "jump_limit": Quantity("whether the fold before the snap was located", type=int),
    "fraction_taut": Quantity("part of the reference area that is taut"),
    "fraction_radial": Quantity("part of the reference area with radial wrinkles (only s22 < 0)"),
    "fraction_circumferential": Quantity("part of the reference area with circumferential wrinkles (only s11 < 0)"),
    "fraction_double": Quantity("part of the reference area with wrinkles both ways (s11 < 0 and s22 < 0)"),
    "error_pressure": Quantity("estimated error of the pressure, relative"),
    "error_volume": Quantity("estimated error of the volume, relative"),
    "error_energy": Quantity("estimated error of elastic plus magnetic energy, over the sum of their sizes"),
    "estimated": Quantity("quantity whose error is estimated"),
    "error_value": Quantity("quantity at the equilibrium whose error is estimated"),
    "error_estimate": Quantity("its estimated error, signed"),
    "error_control": Quantity("what is held while the error is estimated"),
    "error_method": Quantity("how the error is estimated"),
    "error_reason": Quantity("why there is no estimate of the error"),
    "zone_step": Quantity("number of the equilibrium that the zone belongs to"),
    "zone_kind": Quantity("kind of the zone"),
    "zone_r_start": Quantity("reference radius over R0 at which the zone starts"),
    "zone_r_end": Quantity("reference radius over R0 at which the zone ends"),
    "zone_rho_start": Quantity("deformed radius over R0 at which the zone starts"),
    "zone_rho_end": Quantity("deformed radius over R0 at which the zone ends"),
    "zone_area_fraction": Quantity("part of the reference area in the zone"),
    "zone_deformed_area_fraction": Quantity("part of the deformed area in the zone"),
}
#: the quantities that locate an equilibrium on a branch
PLACES = ("volume", "pressure", "center_height")
#: beginnings of the names of the quantities of a verdict, which go on with a control or the number of waves
_OF_VERDICTS: Mapping[str, type[int] | type[str]] = {"verdict": str, "reason": str, "negative": int}


def heading(name: str) -> str:
    """The heading of a column where a person reads the table."""
    known = QUANTITIES.get(name)
    return known.symbol if known is not None and known.symbol else name.replace("_", " ")


def typed(name: str, values: Iterable[Any]) -> NDArray[Any]:
    """Values of a quantity as an array of its type, whatever their number."""
    known = QUANTITIES.get(name)
    kind = _OF_VERDICTS.get(name.partition("_")[0], float) if known is None else known.type
    return np.array(list(values), dtype={float: np.float64, int: np.int64, str: np.str_}[kind])

"""Every quantity that is shown or stored: what it is, its unit, and how it is written.

Tables, CSV and NetCDF files, pictures, pages and sweeps ask here. A new quantity is one line of :data:`QUANTITIES`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .errors import InputError, unknown_name

#: SI unit of every kind of quantity that :class:`~femmembrane.Scales` converts
SI_UNITS: Mapping[str, str] = {
    "length": "m",
    "volume": "m^3",
    "pressure": "Pa",
    "stress": "Pa",
    "energy": "J",
    "force": "N",
    "area": "m^2",
    "field": "A/m",
    "weight": "kg/m^3",
    "gamma": "kg/m^3",
    "dipole_strength": "A m^2",
    "remanence": "T",
    "magnetization": "A/m",
    "wire_strength": "A",
    "uniform_strength": "T",
}
#: the same of those that need the permittivity as well, which the electrodes of a scene know (:attr:`~femmembrane.Scene.converter`)
ELECTRIC_UNITS: Mapping[str, str] = {"voltage": "V", "charge": "C", "capacitance": "F", "electric_field": "V/m"}


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
        Heading of its column where that is narrow; empty where its words are the heading.
    words : str
        What sentences and wide tables call it; empty where that is its name, with blanks.
    label : str
        Text at an axis, with what it is divided by; empty where its words are the text.
    form : str
        Format of its values in tables of text.
    si : str
        Its kind among :data:`SI_UNITS` and :data:`ELECTRIC_UNITS`; empty for what has no value in SI units.
    type : {float, int, str}
        What its values are in files and columns.
    """

    meaning: str
    unit: str = "1"
    symbol: str = ""
    words: str = ""
    label: str = ""
    form: str = ".6g"
    si: str = ""
    type: type[float] | type[int] | type[str] = float


@dataclass(frozen=True)
class Units:
    """The units in which a picture or a page shows quantities.

    Attributes
    ----------
    scales : Scales or None
        None: those of the package. Else SI units with the prefix that suits the size of these scales, whatever is shown: branches of one
        membrane have the same units.
    """

    scales: Converter | None = None

    @classmethod
    def of(cls, units: str, scales: Converter | None) -> Units:
        """The units that a word stands for, of a scene with or without scales.

        Raises
        ------
        InputError
            For an unknown word, and for "si" without scales.
        """
        if units not in SYSTEMS:
            raise unknown_name("units", units, SYSTEMS)
        if units == "si" and scales is None:
            raise InputError("units", units, "the scene has no [scales] from which SI units would follow; 'scaled' is allowed")
        return cls(scales if units == "si" else None)

    def unit(self, name: str) -> str:
        """The SI unit of a quantity; empty where it is shown in units of the package."""
        return self._chosen(name)[0]

    def factor(self, name: str) -> float:
        """By what a quantity in units of the package is multiplied."""
        return self._chosen(name)[1]

    def _chosen(self, name: str) -> tuple[str, float]:
        return self.of_kind(quantity(name).si)

    def of_kind(self, kind: str) -> tuple[str, float]:
        """The SI unit of a kind of quantity, and by what such a number is multiplied; empty and 1 where it is shown as it is."""
        if self.scales is None or not kind or not self.scales.converts(kind):
            return "", 1.0
        scale = float(self.scales.to_si(kind, 1.0))
        unit, size = _fitting(kind, scale) if kind in _READ else (SI_UNITS[kind].replace("^2", "²").replace("^3", "³"), 1.0)
        return unit, scale / size


#: those of the package
SCALED = Units()


def _fitting(kind: str, value: float) -> tuple[str, float]:
    """The unit in which a person reads a value in SI units, and what it is."""
    return ([pair for pair in _READ[kind] if pair[1] <= abs(value)] or [_READ[kind][0]])[-1]


def readable(name: str, value: float, scales: Converter) -> str:
    """A value of a quantity in the SI unit that suits it, such as "6.8 MPa"."""
    return readable_kind(quantity(name).si, value, scales)


def readable_kind(kind: str, value: float, scales: Converter) -> str:
    """A value of a kind of quantity, one of :data:`SI_UNITS` or :data:`ELECTRIC_UNITS`, in the SI unit that suits it."""
    found = float(scales.to_si(kind, value))
    unit, size = _fitting(kind, found) if kind in _READ else (SI_UNITS[kind], 1.0)
    return f"{found / size + 0.0:.4g} {unit}"


class Converter(Protocol):
    """What turns non-dimensional values into SI units: :class:`~femmembrane.Scales`, with the permittivity of electrodes or without."""

    def to_si(self, quantity: str, value: Any, /) -> Any: ...

    def converts(self, quantity: str, /) -> bool: ...


_STRESSES = {
    "mechanical_stress_1": "meridional mechanical stress",
    "mechanical_stress_2": "circumferential mechanical stress",
    "total_stress_1": "meridional total stress",
    "total_stress_2": "circumferential total stress",
}
#: every quantity that is shown or stored, by the name that it has in tables and files
QUANTITIES: Mapping[str, Quantity] = {
    "step": Quantity("number of the equilibrium along the branch", type=int),
    "volume": Quantity("enclosed volume V/R0^3, signed", symbol="V", label="volume V/R₀³", si="volume"),
    "volume_m3": Quantity("enclosed volume, signed", "m^3", symbol="V in m³", words="volume V"),
    "pressure": Quantity("pressure P = p R0/(mu T)", symbol="P", label="pressure P = pR₀/(μT)", form=".8g", si="pressure"),
    "pressure_pa": Quantity("pressure p", "Pa", symbol="p in Pa", words="pressure p"),
    "center_height": Quantity(
        "height of the pole, or the first point of the meridian, over R0", words="pole height", label="pole height η(0)/R₀", si="length"
    ),
    "center_height_m": Quantity(
        "height of the pole, or the first point of the meridian", "m", symbol="pole height in m", words="pole height"
    ),
    "energy": Quantity(
        "elastic, magnetic, load and electric energy over mu T R0^2", symbol="E total", words="total energy", form=".8g", si="energy"
    ),
    "elastic_energy": Quantity("elastic energy over mu T R0^2", symbol="E elastic", si="energy"),
    "magnetic_energy": Quantity("magnetic energy over mu T R0^2", symbol="E magnetic", si="energy"),
    "load_energy": Quantity("energy of the loads over mu T R0^2", symbol="E loads", si="energy"),
    "energy_j": Quantity("elastic, magnetic, load and electric energy", "J", symbol="E total in J", words="total energy"),
    "elastic_energy_j": Quantity("elastic energy", "J", symbol="E elastic in J", words="elastic energy"),
    "magnetic_energy_j": Quantity("magnetic energy", "J", symbol="E magnetic in J", words="magnetic energy"),
    "load_energy_j": Quantity("energy of the loads", "J", symbol="E loads in J", words="energy of the loads"),
    "electric_energy": Quantity("energy of voltage or charge over mu T R0^2", symbol="E electric", si="energy"),
    "electric_energy_j": Quantity("energy of voltage or charge", "J", symbol="E electric in J", words="energy of voltage or charge"),
    "voltage": Quantity("voltage (Phi/T) sqrt(eps/mu)", symbol="phi", words="voltage", label="voltage φ = (Φ/T)√(ε/μ)", si="voltage"),
    "voltage_v": Quantity("voltage", "V", symbol="voltage in V", words="voltage"),
    "charge": Quantity("charge over R0^2 sqrt(eps mu)", symbol="Q", words="charge", label="charge Q/(R₀²√(εμ))", si="charge"),
    "charge_c": Quantity("charge", "C", symbol="charge in C", words="charge"),
    "capacitance": Quantity(
        "capacitance over eps R0^2/T", symbol="C", words="capacitance", label="capacitance CT/(εR₀²)", si="capacitance"
    ),
    "capacitance_f": Quantity("capacitance", "F", symbol="capacitance in F", words="capacitance"),
    "contact_radius": Quantity("largest deformed radius of contact over R0", label="radius of contact/R₀", si="length"),
    "contact_radius_m": Quantity("largest deformed radius of contact", "m", words="radius of contact"),
    "contact_reference_radius": Quantity(
        "reference radius of the border of contact over R0", label="reference radius of contact/R₀", si="length"
    ),
    "contact_reference_radius_m": Quantity("reference radius of the border of contact", "m", words="reference radius of contact"),
    "contact_force": Quantity("axial force on bodies over mu T R0, positive upwards", label="force on bodies F/(μTR₀)", si="force"),
    "contact_force_n": Quantity("axial force on bodies, positive upwards", "N", words="force on bodies"),
    "contact_area": Quantity("deformed area in contact over R0^2", label="area of contact/R₀²", si="area"),
    "contact_area_m2": Quantity("deformed area in contact", "m^2", words="area of contact"),
    "least_gap": Quantity("least gap between a node and a body over R0", label="least gap/R₀", si="length"),
    "least_gap_m": Quantity("least gap between a node and a body", "m", words="least gap"),
    "border_end": Quantity("number of the end of elements at a border of contact, -1 for none", type=int),
    "border_place": Quantity("place of a border of contact along the reference meridian"),
    "gap": Quantity("gap between membrane and nearest body over R0", label="gap/R₀", si="length"),
    "gap_m": Quantity("gap between membrane and nearest body", "m", words="gap"),
    "contact_pressure": Quantity("pressure between membrane and body over mu T/R0", label="pressure of contact pR₀/(μT)", si="pressure"),
    "contact_pressure_pa": Quantity("pressure between membrane and body", "Pa", words="pressure of contact"),
    "electric_field": Quantity(
        "true electric field over sqrt(mu/eps), of an equilibrium the largest", label="electric field E√(ε/μ)", si="electric_field"
    ),
    "electric_field_v_per_m": Quantity("true electric field, of an equilibrium the largest", "V/m", words="electric field"),
    "electric_field_profile": Quantity("true electric field along the meridian over sqrt(mu/eps)"),
    "electric_field_v_per_m_profile": Quantity("true electric field along the meridian", "V/m"),
    "breakdown_ratio": Quantity("largest true electric field over the breakdown field"),
    "gas": Quantity("amount of gas (P + atmosphere)(V + chamber) over mu T R0^2", words="amount of gas", label="amount of gas"),
    "residual": Quantity("out-of-balance force relative to the forces in balance"),
    "iterations": Quantity("solver iterations, rejected attempts included", type=int),
    "seconds": Quantity("wall time spent on the equilibrium", "s"),
    "status": Quantity("how the solve ended", type=str),
    "element_ends": Quantity("ends of the elements along the meridian over R0"),
    "mesh_ends": Quantity("ends of the elements of the equilibrium along the meridian over R0, where the mesh changes along the branch"),
    "mesh_degree": Quantity("degree of these elements", type=int),
    "mesh_estimated": Quantity("relative error that was estimated when this mesh was chosen"),
    "state": Quantity("displacement coefficients over R0 on the free degrees of freedom"),
    "r": Quantity("reference radius of the node over R0", label="reference radius r/R₀", si="length"),
    "s": Quantity(
        "arc length of the reference meridian from its first end to the node, over R0",
        label="arc length of the reference meridian s/R₀",
        si="length",
    ),
    "rho": Quantity("deformed radius over R0", label="radius ρ/R₀", si="length"),  # noqa: RUF001
    "eta": Quantity("deformed height over R0", label="height η/R₀", si="length"),
    "r_m": Quantity("reference radius of the node", "m", words="reference radius r"),
    "s_m": Quantity(
        "arc length of the reference meridian from its first end to the node", "m", words="arc length of the reference meridian s"
    ),
    "rho_m": Quantity("deformed radius", "m", words="radius"),
    "eta_m": Quantity("deformed height", "m", words="height"),
    "stretch_1": Quantity("meridional stretch"),
    "stretch_2": Quantity("circumferential stretch"),
    **{name: Quantity(f"{stress} over mu", si="stress") for name, stress in _STRESSES.items()},
    **{f"{name}_pa": Quantity(stress, "Pa") for name, stress in _STRESSES.items()},
    "kind": Quantity("kind of the special point", type=str),
    "error": Quantity("uncertainty of the special point's location"),
    "tangent": Quantity("direction of the branch on which it was found, in the unknowns and the pressure"),
    "waves_all": Quantity("number of waves around the axis with the lowest eigenvalue", words="worst number of waves", type=int),
    "azimuthal": Quantity("number of waves around the axis of the instability that sets in", type=int),
    "amplitude": Quantity("root mean square of the part of the displacement that has waves around the axis, over R0"),
    "shift": Quantity("displacement of the pole across the axis, over R0"),
    "harmonics": Quantity("number of harmonics around the axis beside the constant one", type=int),
    "wave_size": Quantity("size of the part of the displacement that has waves, over R0"),
    "truncation": Quantity("estimated root mean square of the harmonics left out, over R0"),
    "postbuckling": Quantity("whether it sets in gradually (supercritical) or with a jump (subcritical) at a held volume", type=str),
    "postbuckling_coefficient": Quantity("its coefficient b of Koiter at a held volume, over mu T R0^2", words="coefficient b"),
    "trace_border": Quantity("softest displacement at the last point of a trace over a number"),
    "trace_sigma": Quantity("arc length, or load, at the last points of the path"),
    "trace_point": Quantity("state and pressure at the last points of the path"),
    "trace_slope": Quantity("their derivatives with respect to arc length or load"),
    "jump_index": Quantity("number of the equilibrium that a snap of the membrane landed on", type=int),
    "jump_limit": Quantity("whether the fold before the snap was located", type=int),
    "jump_held": Quantity("what the run prescribed when the membrane snapped", type=str),
    "fraction_taut": Quantity("part of the reference area that is taut"),
    "fraction_radial": Quantity("part of the reference area with radial wrinkles (only s22 < 0)"),
    "fraction_circumferential": Quantity("part of the reference area with circumferential wrinkles (only s11 < 0)"),
    "fraction_double": Quantity("part of the reference area with wrinkles both ways (s11 < 0 and s22 < 0)"),
    "error_pressure": Quantity("estimated error of the pressure, relative"),
    "error_volume": Quantity("estimated error of the volume, relative"),
    "error_energy": Quantity("estimated error of the total energy, over the sum of the sizes of its parts"),
    "estimated": Quantity("quantity whose error is estimated"),
    "error_value": Quantity("quantity at the equilibrium whose error is estimated"),
    "error_estimate": Quantity("its estimated error, signed"),
    "error_control": Quantity("what is held while the error is estimated"),
    "error_method": Quantity("how the error is estimated"),
    "error_reason": Quantity("why there is no estimate of the error"),
    "changing_zone_kind": Quantity("kind of the zone that opens or closes", words="zone", type=str),
    "changing_zone_place": Quantity("where it does: at the pole, at a rim, or inside", words="place", type=str),
    "changing_zone_reference_radius": Quantity("reference radius over R0 at which it does", words="reference radius"),
    "changing_zone_radius": Quantity("deformed radius over R0 at which it does", words="radius"),
    "zone_step": Quantity("number of the equilibrium that the zone belongs to"),
    "zone_kind": Quantity("kind of the zone"),
    "zone_r_start": Quantity("reference radius over R0 at which the zone starts"),
    "zone_r_end": Quantity("reference radius over R0 at which the zone ends"),
    "zone_rho_start": Quantity("deformed radius over R0 at which the zone starts"),
    "zone_rho_end": Quantity("deformed radius over R0 at which the zone ends"),
    "zone_area_fraction": Quantity("part of the reference area in the zone"),
    "zone_deformed_area_fraction": Quantity("part of the deformed area in the zone"),
    # of convergence studies
    "degree": Quantity("degree of the elements", type=int),
    "elements": Quantity("number of elements", type=int),
    "unknowns": Quantity("number of unknowns", words="unknowns", type=int),
    "element_size": Quantity("largest element over R0", label="largest element h/R₀"),
    "quantity": Quantity("what is compared", type=str),
    "value": Quantity("what was found"),
    "reference": Quantity("the same on the reference mesh"),
    "floor": Quantity("error of the reference in the same measure"),
    "resolved": Quantity("whether the error stands clear of that of the reference", type=int),
    "order": Quantity("observed order"),
    "extrapolated": Quantity("value for infinitely many elements"),
    "extrapolated_error": Quantity("its estimated error"),
    "profile_l2": Quantity("error of the profile in L2", symbol="profile L2", label="profile (ρ, η), L² norm"),  # noqa: RUF001
    "profile_h1": Quantity("error of the profile in H1", symbol="profile H1", label="profile (ρ, η), H¹ norm"),  # noqa: RUF001
    "limit_pressure": Quantity("pressure at the first limit point", symbol="limit P", label="first limit point, P"),
    "limit_volume": Quantity("volume at the first limit point", symbol="limit V", label="first limit point, V"),
    # of studies of work against precision
    "what": Quantity("kind of the line: solve, stage or effect", type=str),
    "method": Quantity("solver or method; name of the stage or effect", type=str),
    "start": Quantity("warm or cold; of an effect, off or on", type=str),
    "tolerance": Quantity("tolerance of a method without a mesh"),
    "milliseconds": Quantity("median wall time", "ms", label="wall time of one equilibrium in ms"),
    "setup_milliseconds": Quantity("wall time of building the problem", "ms"),
    "evaluations": Quantity("evaluations of the right-hand sides", type=int),
    "repeats": Quantity("number of solves that the median is of", type=int),
    "converged": Quantity("whether the solve converged", type=int),
    "front": Quantity("whether nothing with the same start is both faster and more accurate", type=int),
    "message": Quantity("the reason, or what was done", type=str),
    "machine": Quantity("processor, number of processors, system and versions", type=str),
    # of sweeps, one value a scene or a series of them
    "steps": Quantity("number of equilibria along the branch", words="number of equilibria along the branch"),
    "limit_points": Quantity("number of limit points", words="number of limit points"),
    "volume_folds": Quantity("number of volume folds", words="number of volume folds"),
    "azimuthal_onsets": Quantity("number of azimuthal onsets", words="number of azimuthal onsets"),
    "onset_waves": Quantity("number of waves around the axis of the onsets"),
    **{
        name: text
        for tag, points in (("limit", "limit point"), ("fold", "volume fold"), ("onset", "onset"))
        for name, text in (
            (f"{tag}_identity", Quantity(f"which {points} it is: the same number in all scenes, 0 of one that no scene beside surely has")),
            (f"{tag}_cut", Quantity(f"whether the {points} has another number in a neighbouring scene, from a way round (1 or 0)")),
        )
    },
    "wrinkled_fraction": Quantity("part of the reference area that is wrinkled, along the branch"),
    "largest_wrinkled_fraction": Quantity(
        "largest part of the reference area that is wrinkled on the branch", label="largest wrinkled part of the area"
    ),
    "equilibria": Quantity("number of equilibria at the load that were found", label="number of equilibria"),
    "stable_equilibria": Quantity(
        "number of them that are stable under the load's control and against the waves asked for", label="number of stable equilibria"
    ),
    "displacement": Quantity("root mean square of the displacement over the reference area, over R0"),
    "stress_first": Quantity("meridional Cauchy stress at the first end, over mu", words="stress at first"),
    "stress_last": Quantity("meridional Cauchy stress at the last end, over mu", words="stress at last"),
    "state_energy": Quantity("energy that orders the equilibria, over mu T R0^2"),
    "state_stable": Quantity("whether each equilibrium is stable (1 or 0)"),
    "upright_at_start": Quantity("whether the branch starts stable against one wave around the axis (1 or 0)"),
    "outcome": Quantity("whether and where the onset was met", type=str),
    "has_result": Quantity("whether anything was computed of the scene", type=int),
}
#: the quantities that tell where on a branch an equilibrium lies
PLACES = ("volume", "pressure", "center_height")
#: stretches and stresses along the meridian
PROFILE = ("stretch_1", "stretch_2", *_STRESSES)
#: what a membrane with a voltage or a charge has besides, and its profile
ELECTRIC = ("voltage", "charge", "capacitance", "electric_field")
#: of the quantities of a verdict, whose names go on with a control or the number of waves
_OF_VERDICTS: Mapping[str, Quantity] = {
    "lambda_error": Quantity("bound on the algebraic error of the smallest eigenvalue"),
    "lambda": Quantity("smallest eigenvalue, omega^2 rho_m R0^2/mu", label="smallest eigenvalue λ"),
    "verdict": Quantity("stability", type=str),
    "negative_directions": Quantity("number of negative eigenvalues (-1: not counted)", type=int),
    "reason": Quantity("reason of the verdict", type=str),
    "wavelength": Quantity("length of a wave around the axis where the mode is largest, over R0"),
    "mode": Quantity("shape of the smallest eigenvalue's mode (none: NaN)"),
}
#: what follows the name of a quantity of each kind where it is given in SI units
_IN_SI = {
    "length": "m",
    "volume": "m3",
    "pressure": "pa",
    "stress": "pa",
    "energy": "j",
    "force": "n",
    "area": "m2",
    "voltage": "v",
    "charge": "c",
    "capacitance": "f",
    "electric_field": "v_per_m",
}
#: units in which a person reads a quantity, from small to large, and what they are in SI units
_READ: Mapping[str, tuple[tuple[str, float], ...]] = {
    "length": (("µm", 1e-6), ("mm", 1e-3), ("m", 1.0)),
    "volume": (("µl", 1e-9), ("ml", 1e-6), ("l", 1e-3), ("m³", 1.0)),
    "pressure": (("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6)),
    "stress": (("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6)),
    "energy": (("µJ", 1e-6), ("mJ", 1e-3), ("J", 1.0)),
    "force": (("µN", 1e-6), ("mN", 1e-3), ("N", 1.0), ("kN", 1e3)),
    "area": (("mm²", 1e-6), ("cm²", 1e-4), ("m²", 1.0)),
    "voltage": (("mV", 1e-3), ("V", 1.0), ("kV", 1e3)),
    "charge": (("nC", 1e-9), ("µC", 1e-6), ("mC", 1e-3), ("C", 1.0)),
    "capacitance": (("pF", 1e-12), ("nF", 1e-9), ("µF", 1e-6), ("mF", 1e-3), ("F", 1.0)),
    "electric_field": (("V/m", 1.0), ("kV/m", 1e3), ("MV/m", 1e6)),
}
#: words for the units in which pictures and pages show quantities
SYSTEMS = ("scaled", "si")
#: labels of numbers of a scene, by the pattern of their key
_KEYS = (
    (r"source(?:\.\d+)?\.strength", "dipole strength M = μ₀D²/(R₀⁶μ)"),
    (r"source(?:\.\d+)?\.height", "height of the source h/R₀"),
    (r"membrane\.susceptibility", "susceptibility χ"),
    (r"material\.mu\.(\d+)", "modulus of term {0} over the shear modulus, μ{0}/μ"),
    (r"material\.alpha\.(\d+)", "exponent of term {0}, α{0}"),  # noqa: RUF001
    (r"run\.start", "first load"),
    (r"run\.stop", "last load"),
)
#: the same of those that are shown in SI units
_MEASURED = (
    (r"source(?:\.\d+)?\.strength", "strength of the source"),
    (r"source(?:\.\d+)?\.height", "height of the source"),
    (r"obstacle(?:\.\d+)?\.height", "height of the obstacle"),
    (r"electric\.voltage", "voltage"),
)


def quantity(name: str) -> Quantity:
    """What is known of a quantity; of one that is not listed, its name."""
    return QUANTITIES.get(name) or _of_verdict(name) or Quantity(name)


def _of_verdict(name: str) -> Quantity | None:
    """A quantity of a verdict: its name ends in a control, or in n and the number of waves, and perhaps a part."""
    kind = next((k for k in _OF_VERDICTS if f"{name}_".startswith(f"{k}_")), None)
    if kind is None or kind == name:
        return _OF_VERDICTS.get(name)
    tag, _, part = name.removeprefix(kind + "_").partition("_")
    waves, known = tag[1:].isdigit(), _OF_VERDICTS[kind]
    if tag == "all":
        return Quantity(f"{known.meaning}, the worst number of waves", label="λ, worst n" if kind == "lambda" else "", type=known.type)
    against = f"azimuthal mode n = {tag[1:]}" if waves else f"axisymmetric shapes under {tag} control"
    return Quantity(
        f"{known.meaning}, {against}" + (f": {part}" if part else ""),
        symbol=f"{kind} ({QUANTITIES[tag].symbol})" if kind == "lambda" and tag in PLACES else "",
        label="λ, " + (f"n = {tag[1:]}" if waves else f"{tag} held") if kind == "lambda" else "",
        type=known.type,
    )


def words(name: str) -> str:
    """What sentences and wide tables call a quantity."""
    return quantity(name).words or name.replace("_", " ")


def heading(name: str) -> str:
    """The heading of a column where a person reads the table."""
    return quantity(name).symbol or words(name)


def heading_in(name: str, units: Units) -> str:
    """The heading of a column that shows the quantity in these units."""
    unit = units.unit(name)
    return f"{heading(in_si(name)).partition(' in ')[0]} in {unit}" if unit else heading(name)


def title(name: str) -> str:
    """Words and symbol of a quantity, such as "pressure P"."""
    known = quantity(name)
    return f"{words(name)} {known.symbol}" if len(known.symbol) == 1 else words(name)


def axis_label(name: str, units: Units | None = None) -> str:
    """Text at an axis, which shows the quantity in these units."""
    if units is not None and (unit := units.unit(name)):
        return f"{words(in_si(name))} in {unit}"
    return quantity(name).label or words(name)


def key_label(key: str, unit: str = "") -> str:
    """Text at an axis over a number of a scene, which is shown in an SI unit or as it is; its key where nothing better is known."""
    if unit:
        return f"{next((text for pattern, text in _MEASURED if re.fullmatch(pattern, key)), key)} in {unit}"
    for pattern, text in _KEYS:
        if match := re.fullmatch(pattern, key):
            return text.format(*(int(k) + 1 for k in match.groups()))  # terms are counted from 1
    return key


def written(name: str, value: Any, width: int = 0) -> str:
    """A value as tables of text have it, at the right of so many characters."""
    shown = value if isinstance(value, str) else value + 0  # 0 for -0
    return f"{shown:>{width or ''}{quantity(name).form}}"


def caption(volume: float, pressure: float, between: str = "  ", units: Units | None = None) -> str:
    """Volume and pressure of an equilibrium at a curve or in a line, to four digits."""
    return between.join(f"{symbol} = {text}" for symbol, text in _in_units({"volume": volume, "pressure": pressure}, units or SCALED))


def _in_units(values: Mapping[str, float], units: Units) -> Iterator[tuple[str, str]]:
    """Symbol, and value with its unit, of each quantity."""
    for name, value in values.items():
        unit = units.unit(name)
        yield heading_in(name, units).partition(" in ")[0], f"{value * units.factor(name) + 0.0:.4g}" + (f" {unit}" if unit else "")


def in_si(name: str) -> str:
    """The name of a quantity that is given in SI units."""
    return f"{name}_{_IN_SI[QUANTITIES[name].si]}"


def electric_quantities(scene: Any) -> tuple[str, ...]:
    """Those of :data:`ELECTRIC` that a scene has: electrodes with a frozen charge have no voltage, and so no capacitance."""
    if scene.electric is None:
        return ()
    return tuple(name for name in ELECTRIC if scene.electric.frozen_charge is None or name not in ("voltage", "capacitance"))


def si_values(values: Mapping[str, Any], scales: Converter) -> dict[str, Any]:
    """Quantities in SI units, under their names there."""
    return {in_si(name): scales.to_si(QUANTITIES[name].si, value) for name, value in values.items()}


def typed(name: str, values: Iterable[Any]) -> NDArray[Any]:
    """Values of a quantity as an array of its type, whatever their number."""
    return np.array(list(values), dtype={float: np.float64, int: np.int64, str: np.str_}[quantity(name).type])

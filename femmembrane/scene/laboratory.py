"""The tables of a scene file in the units of a laboratory.

A number with a unit ("5 kPa", "20 mm") may stand in the place of any number that has one. With ``units = "si"`` above all tables, numbers
without a unit are SI numbers as well. Here both become numbers in the units of the package, by the scales of the scene.

What a number is goes by its key; :data:`_KINDS` lists the kinds, which are those of :class:`~femmembrane.Scales`. A strength is told by its
unit: the moment of a dipole, loop or solenoid (A m^2), the current of a loop or wire (A), the remanence or magnetisation of a cylindrical
magnet (T or A/m), a uniform field (T or A/m). Numbers that are ratios, such as a susceptibility, stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from ..checks import choice, is_number
from ..discretization.supports import ENDS
from ..errors import InputError, unknown_name
from ..physics.scales import AGREEMENT, Scales
from ..physics.units import has_unit, in_unit
from ..quantities import SI_UNITS, SYSTEMS, quantity
from .moduli import without_moduli
from .run import PRESCRIBED
from .toml import item_path, modulus_of_own

#: kinds of the numbers of a scene file, by table and key; a unit in place of a kind is that of a number which a scene keeps in SI units
_KINDS: Mapping[str, Mapping[str, str]] = {
    "source": {
        "height": "length",
        "radius": "length",
        "length": "length",
        "inner_radius": "length",
        "remanence": "T",
        "rho": "length",
        "z": "length",
        "h_rho": "field",
        "h_z": "field",
    },
    "load": {"weight": "weight", "gamma": "gamma", "force": "force"},
    "obstacle": {"height": "length", "radius": "length", "length": "length", "rounding": "length", "points": "length"},
    "chamber": {"volume": "volume", "atmosphere": "pressure"},
    "electric": {"voltage": "V", "total_charge": "C", "frozen_charge": "C/m^2", "breakdown": "V/m", "from": "length", "to": "length"},
    "mesh": {
        "radii": "length",
        "ends": "length",
        "points": "length",
        "inner_radius": "length",
        "height": "length",
        "length": "length",
        "radius": "length",
    },
}
#: what may stand for the strength of a source, the one without a unit first
_STRENGTHS: Mapping[str, tuple[str, ...]] = {
    "dipole": ("A m^2",),
    "loop": ("A m^2", "A"),
    "solenoid": ("A m^2", "A", "T", "A/m"),
    "magnet": ("A m^2", "T", "A/m"),
    "wire": ("A",),
    "uniform": ("T", "A/m"),
}
_SCALES = {"radius": "m", "thickness": "m", "shear_modulus": "Pa", "dipole_moment": "A m^2"}


def scaled(data: Any) -> Any:
    """The tables of a scene file with all numbers in the units of the package; the given tables do not change.

    Parameters
    ----------
    data : mapping
        What is no number with a unit, or stands where none belongs, is left for the check of the scene.

    Raises
    ------
    InputError
        For an unknown unit or one of another kind, a number with a unit without [scales], and moduli that contradict the scales.
    """
    if not isinstance(data, Mapping):
        return data
    si = choice("units", data.get("units", "scaled"), SYSTEMS) == "si"
    tables = {name: table for name, table in data.items() if name != "units"}
    tables = _with_scales(tables, si)
    if (
        not si
        and not any(_has_units(table) for name, table in tables.items() if name in (*_KINDS, "run", "membrane"))
        and not _names_unit(tables)
    ):
        return tables
    return _Laboratory(tables, si).scaled()


def _with_scales(tables: dict[str, Any], si: bool) -> dict[str, Any]:
    """The tables with scales in SI units and a material without moduli in Pa."""
    given = tables.get("scales", {})
    scales = _measured_scales(given) if isinstance(given, Mapping) else given
    changed = {**tables, "scales": scales} if "scales" in tables else dict(tables)
    if not isinstance(tables.get("material"), Mapping) or not isinstance(scales, Mapping):
        return changed
    changed["material"], shear_modulus = without_moduli(tables["material"], scales.get("shear_modulus"), si)
    if shear_modulus is None or ("scales" not in tables and "name" in tables["material"]):  # a real material needs no scales
        return changed
    asked = scales.get("shear_modulus", shear_modulus)
    if is_number(asked) and not math.isclose(asked, shear_modulus, rel_tol=AGREEMENT):
        advice = f"[material] has a shear modulus of {shear_modulus:.12g} Pa; leave it out, or let them agree"
        raise InputError("scales.shear_modulus", asked, advice)
    return {**changed, "scales": {"shear_modulus": shear_modulus, **scales}}


def _measured_scales(table: Mapping[str, Any]) -> dict[str, Any]:
    units = {name: _SCALES[name] for name, value in table.items() if name in _SCALES and has_unit(value)}
    return {name: in_unit(f"scales.{name}", value, units[name])[0] if name in units else value for name, value in table.items()}


def _names_unit(tables: Mapping[str, Any]) -> bool:
    """Whether a mesh file or the file of a mould has a unit by its name."""
    obstacles = tables.get("obstacle")
    found = [tables.get("mesh"), *(obstacles if isinstance(obstacles, (list, tuple)) else ())]
    return any(isinstance(table, Mapping) and isinstance(table.get("unit"), str) for table in found)


def _has_units(value: Any) -> bool:
    if isinstance(value, Mapping):
        return any(map(_has_units, value.values()))
    return any(map(_has_units, value)) if isinstance(value, (list, tuple)) else has_unit(value)


@dataclass
class _Laboratory:
    """Tables whose scales and material are done."""

    tables: dict[str, Any]
    si: bool

    def _scales(self, key: str, value: Any) -> Scales:
        """The scales, which a number needs."""
        table = self.tables.get("scales", {})
        if not isinstance(table, Mapping):
            raise InputError("scales", table, "a table is allowed: [scales] with its keys below")
        names = [f.name for f in fields(Scales)]
        for name in table.keys() - set(names):
            raise InputError(f"scales.{name}", table[name], unknown_name(f"scales.{name}", name, names).allowed)
        missing = [name for name in ("radius", "thickness", "shear_modulus") if name not in table]
        if missing:
            follows = (
                modulus_of_own(self.tables.get("material")) or "the shear modulus follows where [material] has its moduli in Pa, or a name"
            )
            more = f"; {follows}" if missing[-1] == "shear_modulus" else ""
            raise InputError(key, value, f"a number in SI units needs [scales], where {', '.join(missing)} is missing{more}")
        return Scales(**table)

    def scaled(self) -> dict[str, Any]:
        changed = dict(self.tables)
        special = {"mesh": self._mesh, "run": self._run, "membrane": self._membrane}
        for name in {**_KINDS, **special}:
            table = changed.get(name)
            if isinstance(table, (list, tuple)):
                paths = (item_path(name, k, len(table)) for k in range(len(table)))
                changed[name] = [self._item(name, path, item) for path, item in zip(paths, table, strict=True)]
            elif isinstance(table, Mapping):
                changed[name] = special[name](table) if name in special else self._table(name, table, _KINDS[name])
        return changed

    def value(self, path: str, key: str, value: Any) -> Any:
        """A value of the number of a scene with this key, such as ``source.0.height``, or of a quantity; ``path`` names it in errors."""
        table, _, rest = key.partition(".")
        place, _, name = rest.rpartition(".")
        if table not in _KINDS:
            return self._number(path, value, "energy" if key == "gas" else quantity(PRESCRIBED.get(key, key)).si)
        items = self.tables.get(table)
        if name == "strength" and isinstance(items, (list, tuple)) and place.isdigit() and int(place) < len(items):
            return self._item(table, path.rpartition(".")[0], {**items[int(place)], "strength": value}, path)["strength"]
        return self._number(path, value, _KINDS[table].get(name, ""))

    def _number(self, key: str, value: Any, kind: str) -> Any:
        """A number, or lists of them, in the units of the package; what has no kind as it is."""
        if isinstance(value, (list, tuple)):
            return [self._number(f"{key}[{k}]", one, kind) for k, one in enumerate(value)]
        measured = in_unit(key, value, SI_UNITS.get(kind, kind))[0] if kind and has_unit(value) else None
        if kind not in SI_UNITS:
            return value if measured is None else measured
        if measured is None and not (self.si and is_number(value)):
            return value
        return self._over_unit(key, value if measured is None else measured, kind)

    def _over_unit(self, key: str, value: float, kind: str) -> float:
        try:
            return self._scales(key, value).from_si(kind, value)
        except InputError as error:
            raise InputError(key, value, error.allowed) if error.key == "value" else error from None

    def _table(self, path: str, table: Mapping[str, Any], kinds: Mapping[str, str]) -> dict[str, Any]:
        return {name: self._number(f"{path}.{name}", value, kinds.get(name, "")) for name, value in table.items()}

    def _item(self, name: str, path: str, table: Any, strength: str = "") -> Any:
        """A source, load or obstacle. The key of its strength in errors may be another one."""
        if not isinstance(table, Mapping):
            return table
        changed = self._table(path, table, _KINDS[name])
        if name == "obstacle":
            changed |= self._unit_of_file(path, table)
        if name == "source" and "strength" in table:
            changed["strength"] = self._strength(strength or f"{path}.strength", changed)
        return changed

    def _strength(self, key: str, source: Mapping[str, Any]) -> Any:
        """The strength of a source by what is measured of it."""
        kind, value = source.get("kind"), source["strength"]
        if isinstance(value, (list, tuple)):
            return [self._strength(key, {**source, "strength": one}) for one in value]
        units = _STRENGTHS.get(kind) if isinstance(kind, str) else None
        if units is None or not (has_unit(value) or (self.si and is_number(value))):
            return value
        found, unit = in_unit(key, value, *units) if isinstance(value, str) else (float(value), units[0])
        if kind == "wire":
            return self._over_unit(key, found, "wire_strength")
        from scipy.constants import mu_0

        if kind == "uniform":
            return self._over_unit(key, found if unit == "T" else found * mu_0, "uniform_strength")
        if unit != "A m^2":  # moment = current times area, or magnetisation times volume
            radius, inner, length = (source.get(name, 0.0) for name in ("radius", "inner_radius", "length"))
            if not all(map(is_number, (radius, inner, length))):
                return value  # the source refuses its size
            R0 = self._scales(key, value).radius
            area = math.pi * (radius**2 - inner**2) * R0**2
            found *= area * (1.0 if unit == "A" else length * R0) / (mu_0 if unit == "T" else 1.0)
        return self._over_unit(key, found, "dipole_strength")

    def _mesh(self, table: Mapping[str, Any]) -> dict[str, Any]:
        changed = self._table("mesh", table, _KINDS["mesh"])
        for name in ENDS:
            if isinstance(table.get(name), Mapping):
                changed[name] = self._table(f"mesh.{name}", table[name], _KINDS["mesh"])
        return changed | self._unit_of_file("mesh", table)

    def _unit_of_file(self, path: str, table: Mapping[str, Any]) -> dict[str, Any]:
        """The unit of the lengths in a file, where the table names a file."""
        if "file" not in table or not (self.si or isinstance(table.get("unit"), str)):
            return {}
        unit = table.get("unit", "m")
        return {"unit": self._number(f"{path}.unit", f"1 {unit}" if isinstance(unit, str) else unit, "length")}

    def _run(self, table: Mapping[str, Any]) -> dict[str, Any]:
        changed = dict(table)
        control = table.get("control", "volume")
        load = table.get("over", "volume") if control == "arc-length" else control
        for name in ("start", "stop", "values"):
            if name in table and isinstance(load, str):
                changed[name] = self.value(f"run.{name}", load, table[name])
        for name in ("until", "hold"):
            if isinstance(table.get(name), Mapping):
                changed[name] = {key: self.value(f"run.{name}.{key}", str(key), value) for key, value in table[name].items()}
        return changed

    def _membrane(self, table: Mapping[str, Any]) -> dict[str, Any]:
        changed = dict(table)
        for name in ("remanence", "saturation"):  # in T, or A/m
            if name in table:
                changed[name] = self._magnetization(f"membrane.{name}", table[name])
        for name, unit, scale in (("thickness", "m", "thickness"), ("modulus", "Pa", "shear_modulus")):
            if name in table:
                changed[name] = self._factor(f"membrane.{name}", table[name], unit, scale)
        return changed

    def _magnetization(self, key: str, value: Any) -> Any:
        if not (has_unit(value) or (self.si and is_number(value))):
            return value
        from scipy.constants import mu_0

        found, unit = in_unit(key, value, "T", "A/m") if isinstance(value, str) else (float(value), "T")
        return self._over_unit(key, found / mu_0 if unit == "T" else found, "field")

    def _factor(self, key: str, value: Any, unit: str, scale: str) -> Any:
        """A factor along the meridian: one with a unit is divided by that of the scales, and places are lengths."""
        if isinstance(value, (list, tuple)):
            pairs = [pair if isinstance(pair, (list, tuple)) else [pair] for pair in value]
            return [
                [self._number(f"{key}[{k}][0]", pair[0], "length"), *(self._factor(f"{key}[{k}][1]", one, unit, scale) for one in pair[1:])]
                if pair
                else pair
                for k, pair in enumerate(pairs)
            ]
        if not has_unit(value):
            return value
        measured, _ = in_unit(key, value, unit)
        return measured / float(getattr(self._scales(key, value), scale))


def number_kind(key: str) -> str:
    """Kind of a number of a scene, one of :data:`.SI_UNITS`; empty for others, and for strengths, which are of what the source is."""
    table, _, rest = key.partition(".")
    kind = _KINDS.get(table, {}).get(rest.rpartition(".")[2], "")
    return kind if kind in SI_UNITS else ""


def values_in_file(data: Mapping[str, Any], key: str, values: Sequence[Any]) -> tuple[Any, ...]:
    """Values for a key of a scene file, such as ``source.0.height``, in the units of the package; they are meant as in the file itself.

    Parameters
    ----------
    data : mapping
        The tables of the file, in any units.
    key : str
    values : sequence
    """
    from .keys import set_key

    if data.get("units") != "si" or key.partition(".")[0] == "material":  # whose numbers are over its shear modulus
        return tuple(values)
    found = [_at(scaled(set_key(data, key, value)), key) for value in values]
    return tuple(value if one is None else one for value, one in zip(values, found, strict=True))


def _at(tables: Any, key: str) -> Any:
    """What stands at a key; None where nothing does."""
    for name in key.split("."):
        tables = tables[int(name)] if isinstance(tables, list) else tables.get(name) if isinstance(tables, Mapping) else None
    return tables

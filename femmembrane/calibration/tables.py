"""Tables of measurements: read, checked, and named by row and column where something is wrong.

A column is a quantity with its unit after it: ``pressure_kPa``, ``pole_height_mm``, ``volume (ml)``, ``nominal_stress [MPa]``. Ratios such
as a stretch have none. ``_sd`` after the quantity makes it the standard deviation of that column: ``pressure_sd_kPa``.

====================================  =============================================================================
``pressure``                          of an inflated membrane
``center_height`` (``pole_height``)   height of the pole
``volume``
``pole_stretch``
``state``, ``r``, ``z``               points of the profile: rows with one ``state`` (any number) belong together
``reference_radius``                  beside r and z: where the point was before (a table of image correlation)
``stretch``, ``nominal_stress``       of a simple test, which says so: ``uniaxial_stress``, ``planar_stress``, ``equibiaxial_stress``
====================================  =============================================================================
"""

from __future__ import annotations

import csv
import difflib
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import as_float
from ..errors import InputError, as_meant
from ..physics.scales import Scales
from ..physics.units import has_unit, in_unit
from ..quantities import QUANTITIES, SI_UNITS

Array = NDArray[np.float64]

#: kind of every quantity that is measured; empty for a ratio
KINDS: Mapping[str, str] = {
    "pressure": "pressure",
    "center_height": "length",
    "volume": "volume",
    "pole_stretch": "",
    "stretch": "",
    "uniaxial_stress": "stress",
    "planar_stress": "stress",
    "equibiaxial_stress": "stress",
    "nominal_stress": "stress",
    "r": "length",
    "z": "length",
    "reference_radius": "length",
    "state": "",
}
_ALIASES: Mapping[str, str] = {
    "p": "pressure",
    "height": "center_height",
    "pole_height": "center_height",
    "apex_height": "center_height",
    "deflection": "center_height",
    "v": "volume",
    "apex_stretch": "pole_stretch",
    "lambda_pole": "pole_stretch",
    "stretch_at_the_pole": "pole_stretch",
    "engineering_stress": "nominal_stress",
    "stress": "nominal_stress",
    "biaxial_stress": "equibiaxial_stress",
    "uniaxial_nominal_stress": "uniaxial_stress",
    "planar_nominal_stress": "planar_stress",
    "equibiaxial_nominal_stress": "equibiaxial_stress",
    "profile_r": "r",
    "profile_z": "z",
    "rho": "r",
    "eta": "z",
}
#: columns that say nothing about the membrane
_IGNORED = frozenset({"row", "index", "step", "time", "comment", "note", "notes", "specimen", "sample", "seconds", "message", "test"})
#: simple tests by their columns
SIMPLE = {"uniaxial_stress": "uniaxial", "planar_stress": "planar", "equibiaxial_stress": "equibiaxial"}
_MAX_BYTES, _MAX_ROWS = 2**26, 10**5
_BEHIND = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\]]*)\]|\((?P<b>[^)]*)\)|/\s*(?P<c>\S.*))$")


@dataclass(frozen=True, eq=False)
class Table:
    """Measured columns in units of the package.

    Attributes
    ----------
    name : str
        What messages call it: the path of its file, or "data".
    columns : mapping of str to ndarray
        By quantity.
    deviations : mapping of str to ndarray
        Standard deviations of some columns.
    rows : tuple of int
        Number of each row in what was given, from 1; a file counts its lines.
    headers : mapping of str to str
        How each column was called.
    factors : mapping of str to float
        By what the numbers of each column were multiplied.
    notes : tuple of str
        What was done to the table.
    """

    name: str
    columns: Mapping[str, Array]
    deviations: Mapping[str, Array]
    rows: tuple[int, ...]
    headers: Mapping[str, str]
    factors: Mapping[str, float]
    notes: tuple[str, ...] = field(default=())

    def __len__(self) -> int:
        return len(self.rows)

    def where(self, row: int, column: str) -> str:
        """A cell in words."""
        word = "line" if self.name != "data" else "row"
        return f"{self.name}, {word} {self.rows[row]}, column {self.headers.get(column, column)!r}"

    def shown(self, row: int, column: str) -> float:
        """A number as it was given."""
        return float(self.columns[column][row] / self.factors.get(column, 1.0))


def read_table(data: Any, scales: Scales | None, units: str | None = None) -> Table:
    """The table of a mapping of columns, a DataFrame, or a CSV file.

    Parameters
    ----------
    data : mapping, DataFrame or path
    scales : Scales or None
        Of the scene, by which columns with a unit are converted.
    units : {"scaled", "si"}, optional
        What columns without a unit are, where the scene has scales.

    Raises
    ------
    InputError
        Names the row and the column.
    """
    if units not in (None, "scaled", "si"):
        raise InputError("units", units, "'scaled' (of the package) or 'si' is allowed")
    name, headers, cells, rows = _cells(data)
    if not rows:
        raise InputError(name, "no rows", "a table with one row for each measurement is allowed")
    columns: dict[str, Array] = {}
    deviations: dict[str, Array] = {}
    known: dict[str, str] = {}
    factors: dict[str, float] = {}
    found = [(header, *_quantity(name, header)) for header in headers]
    found = _without_copies(name, found)
    bare = [header for header, quantity, _, unit in found if quantity and KINDS[quantity] and not unit]
    united = [header for header, quantity, _, unit in found if unit]
    if bare and united:
        raise InputError(
            name, bare[0], f"column {bare[0]!r} has no unit, while {united[0]!r} has one; give it after the name, as in {_example(bare[0])}"
        )
    for header, quantity, deviation, unit in found:
        if not quantity:
            continue
        place = headers.index(header)
        values = np.array([_number(name, rows[i], header, row[place]) for i, row in enumerate(cells)])
        factor = _factor(name, header, quantity, unit, scales, units)
        into = deviations if deviation else columns
        into[quantity] = values * factor
        if not deviation:
            known[quantity], factors[quantity] = header, factor
    table = Table(name, columns, deviations, tuple(rows), known, factors)
    return _checked(table)


# --- what was given


def _cells(data: Any) -> tuple[str, list[str], list[list[Any]], list[int]]:
    """Name, headers, cells and numbers of rows."""
    if isinstance(data, (str, PathLike)):
        return _from_file(Path(fspath(data)))
    if hasattr(data, "to_dict") and hasattr(data, "columns"):
        data = {str(name): data[name].tolist() for name in data.columns}
    if not isinstance(data, Mapping):
        raise InputError("data", type(data).__name__, "a mapping of columns, a DataFrame or the path of a CSV file is allowed")
    columns: dict[str, list[Any]] = {}
    for name, values in data.items():
        if isinstance(values, (str, bytes)) or not hasattr(values, "__len__"):
            raise InputError(f"data[{name!r}]", values, "a list of numbers is allowed")
        columns[str(name)] = list(values)
    if not columns:
        raise InputError("data", {}, "columns such as 'center_height' and 'pressure' are allowed")
    first, *others = columns
    for other in others:
        if len(columns[other]) != len(columns[first]):
            raise InputError(
                "data",
                other,
                f"column {other!r} has {len(columns[other])} rows and {first!r} has {len(columns[first])}; as many are allowed",
            )
    cells = [list(row) for row in zip(*columns.values(), strict=True)]
    return "data", list(columns), cells, list(range(1, len(cells) + 1))


def _from_file(path: Path) -> tuple[str, list[str], list[list[Any]], list[int]]:
    try:
        if path.stat().st_size > _MAX_BYTES or not path.is_file():
            raise InputError("data", str(path), f"a CSV file of at most {_MAX_BYTES} bytes is allowed")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError("data", str(path), f"the file cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError:
        raise InputError("data", str(path), "text in UTF-8 is allowed") from None
    lines = text.splitlines()
    kept = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
    if len(kept) > _MAX_ROWS:
        raise InputError("data", str(path), f"at most {_MAX_ROWS} lines are allowed")
    if not kept:
        raise InputError("data", str(path), "the file is empty; a line of headers and a line for each measurement are allowed")
    _refuse_other_delimiters(path.name, kept)
    headers = [cell.strip() for cell in next(csv.reader(io.StringIO(kept[0][1])))]
    if all(math.isfinite(_parsed(cell)) for cell in headers):
        raise InputError(
            path.name,
            kept[0][1],
            f"line {kept[0][0]} holds numbers; the first line must name its columns, such as pole_height_mm,pressure_kPa",
        )
    cells, rows = [], []
    for number, line in kept[1:]:
        row = [cell.strip() for cell in next(csv.reader(io.StringIO(line)))]
        if len(row) != len(headers):
            hint = "; a number with a decimal comma counts as two" if len(row) > len(headers) else ""
            raise InputError(
                path.name, line, f"line {number} has {len(row)} values for {len(headers)} columns{hint}; decimal points are allowed"
            )
        cells.append(row)
        rows.append(number)
    return path.name, headers, cells, rows


def _refuse_other_delimiters(name: str, kept: Sequence[tuple[int, str]]) -> None:
    number, header = kept[0]
    for mark, word in ((";", "semicolons"), ("\t", "tabs"), ("|", "bars")):
        if mark in header:
            decimal = next((n for n, line in kept[1:] if re.search(r"\d,\d", line)), None)
            comma = f", and line {decimal} has decimal commas" if decimal else ""
            known = f"pandas.read_csv({name!r}, sep={mark!r}{', decimal=' + repr(',') if decimal else ''})"
            allowed = f"commas between columns and decimal points are allowed; {known} reads such a table"
            raise InputError(name, header, f"line {number} separates its columns by {word}{comma}; {allowed}")
    if (
        "," not in header
        and len(header.split()) > 1
        and len(kept) > 1
        and all(math.isfinite(_parsed(c)) for c in kept[1][1].split())
        and len(kept[1][1].split()) > 1
    ):
        raise InputError(name, header, f"line {number} separates its columns by blanks; commas are allowed")


def _quantity(table: str, header: str) -> tuple[str, bool, str]:
    """Quantity, whether it is a standard deviation, and unit of a header; the quantity is empty for a column that plays no part."""
    text, unit = header.strip(), ""
    if behind := _BEHIND.match(text):
        text, unit = behind["name"], (behind["a"] or behind["b"] or behind["c"] or "").strip()
    word = re.sub(r"[\s\-]+", "_", text.strip())
    for candidate, rest in _splits(word):
        deviation = False
        base, own_unit = candidate.lower(), rest
        for ending in ("_sd", "_std", "_sigma"):
            if base.endswith(ending):
                base, deviation = base[: -len(ending)], True
            elif own_unit.lower().endswith(ending):
                own_unit, deviation = own_unit[: -len(ending)], True
        base = _ALIASES.get(base, base)
        if base in KINDS and (own_unit in ("", "%") or KINDS[base]):
            if own_unit and unit and _unit_text(own_unit) != _unit_text(unit):
                raise InputError(table, header, f"it names two units, {own_unit!r} and {unit!r}; one of them is allowed")
            return base, deviation, "" if (own_unit or unit) in ("1", "-") else own_unit or unit
    lowered = word.lower()
    if (
        any(name in _IGNORED or name in QUANTITIES for name, _ in _splits(lowered))
        or not lowered
        or lowered.startswith(("verdict_", "lambda_"))
    ):
        return "", False, ""
    near = difflib.get_close_matches(lowered, [*KINDS, *_ALIASES], n=1, cutoff=0.6)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise InputError(table, header, f"column {header!r} is unknown; {hint}known: {', '.join(KINDS)}, each with its unit behind it")


def _splits(word: str) -> list[tuple[str, str]]:
    """A header as a name and a unit behind an underscore, the longest name first."""
    parts = word.split("_")
    return [("_".join(parts[:k]), "_".join(parts[k:])) for k in range(len(parts), 0, -1)]


def _without_copies(name: str, found: list[tuple[str, str, bool, str]]) -> list[tuple[str, str, bool, str]]:
    """Without columns in units of the package that stand beside the same in SI units, as in the tables of a run."""
    kept: dict[tuple[str, bool], tuple[str, str, bool, str]] = {}
    for entry in found:
        header, quantity, deviation, unit = entry
        if not quantity:
            continue
        if (quantity, deviation) in kept:
            other = kept[quantity, deviation]
            if bool(unit) == bool(other[3]):
                raise InputError(name, header, f"columns {other[0]!r} and {header!r} are the same quantity; leave one out")
            if not unit:
                continue
        kept[quantity, deviation] = entry
    return list(kept.values())


def _example(header: str) -> str:
    quantity = _quantity("", header)[0]
    units = {"pressure": "kPa", "length": "mm", "volume": "ml", "stress": "MPa"}
    return f"{quantity}_{units[KINDS[quantity]]}" if KINDS[quantity] else f"{quantity}, a ratio without a unit"


def _factor(name: str, header: str, quantity: str, unit: str, scales: Scales | None, units: str | None) -> float:
    kind = KINDS[quantity]
    if not kind:
        if unit and unit != "%":
            raise InputError(name, header, f"column {header!r} is a ratio and has no unit")
        return 0.01 if unit == "%" else 1.0
    if not unit:
        if scales is None or units == "scaled":
            return 1.0
        if units is None:
            allowed = f"column {header!r} has no unit; {_example(header)} is allowed, or units='si' or 'scaled' for the whole table"
            raise InputError(name, header, allowed)
        return scales.from_si(kind, 1.0)
    if scales is None:
        raise InputError(
            name, header, f"column {header!r} has a unit, and the scene has no scales; give scales=fm.Scales(...), in a file [scales]"
        )
    try:
        size = in_unit(header, f"1 {_unit_text(unit)}", SI_UNITS[kind])[0]
    except InputError as error:
        raise InputError(name, header, f"column {header!r}: {error.allowed}; its unit is read as {unit!r}") from None
    return scales.from_si(kind, size)


def _unit_text(unit: str) -> str:
    """A unit as headers have it: pa is Pa, and m3 or mm3 a power."""
    exact = {"pa": "Pa", "kpa": "kPa", "mpa": "MPa", "Kpa": "kPa", "KPa": "kPa", "mmhg": "mmHg", "cmh2o": "cmH2O", "ML": "ml", "mL": "mL"}
    return exact.get(unit, re.sub(r"(?<=m)([23])$", r"^\1", unit))


def _parsed(cell: Any) -> float:
    try:
        return float(cell)
    except (TypeError, ValueError):
        return math.nan


#: how programs write that nothing was measured
_NOTHING = ("nan", "na", "n/a", "none", "null", "inf", "infinity", "missing")


def _number(name: str, row: int, header: str, cell: Any) -> float:
    where = f"{name}, {'line' if name != 'data' else 'row'} {row}, column {header!r}"
    value = _parsed(cell) if isinstance(cell, str) else as_float(cell)
    if math.isfinite(value):
        return value
    if isinstance(cell, str) and "," in cell and as_meant(cell):
        raise InputError(where, cell, f"it has a decimal comma, or one between thousands; {as_meant(cell)}")
    if isinstance(cell, str) and has_unit(cell):
        raise InputError(where, cell, f"a number alone is allowed: its unit stands in the header, as in {_example(header)}")
    unit_like = isinstance(cell, str) and cell.strip().lower() not in _NOTHING
    if unit_like and row <= 3 and re.fullmatch(r"[\[(]?[^\W\d_][\w/^]{0,9}[\])]?", cell.strip()):
        allowed = f"a number is allowed; if these are units, write each behind the name of its column, as in {_example(header)}"
        raise InputError(where, cell, allowed)
    if cell is None or (isinstance(cell, str) and not cell.strip()):
        raise InputError(where, cell, "nothing was measured there; leave the row out")
    raise InputError(where, cell, "a finite number is allowed; leave the row out where nothing was measured")


# --- what cannot be


def _checked(table: Table) -> Table:
    for quantity, values in table.deviations.items():
        if quantity not in table.columns:
            raise InputError(table.name, f"{quantity}_sd", f"there is no column {quantity!r} to which these standard deviations belong")
        if (bad := np.flatnonzero(~(values >= 0))).size:
            raise InputError(table.where(int(bad[0]), quantity), float(values[bad[0]]), "a standard deviation >= 0 is allowed")
    for column in ("pole_stretch", "stretch"):
        if column in table.columns and (bad := np.flatnonzero(~(table.columns[column] > 0))).size:
            raise InputError(table.where(int(bad[0]), column), table.shown(int(bad[0]), column), "a stretch > 0 is allowed, 1 at rest")
        if column in table.columns and np.median(table.columns[column]) > 20:
            raise InputError(
                table.where(0, column),
                table.shown(0, column),
                "stretches are lengths over lengths at rest, 1 at rest; are these in percent?",
            )
    _refuse_copies(table)
    return table


def _refuse_copies(table: Table) -> None:
    """Refuse a row that stands twice: it would count twice."""
    seen: dict[tuple[float, ...], int] = {}
    for k, row in enumerate(zip(*table.columns.values(), strict=True)):
        key = tuple(float(v) for v in row)
        if key in seen and len(key) > 1:
            column = next(iter(table.columns))
            allowed = f"row {table.rows[k]} repeats row {table.rows[seen[key]]} in every column, and would count twice; leave one out"
            raise InputError(table.where(k, column), table.shown(k, column), allowed)
        seen[key] = k

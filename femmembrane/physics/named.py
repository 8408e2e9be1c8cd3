"""Real materials by name: sets of numbers from the literature, with their units and sources (``data/materials.toml``).

The shear modulus that belongs to the numbers of a source is twice the sum of dW/dI_1 and dW/dI_2 at rest (Rivlin 1948). A material of the
package has the shear modulus 1, so moduli are divided by it.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from ..checks import choice
from .invariant import LopezPamies, Yeoh
from .materials import Material, MooneyRivlin, Ogden


@dataclass(frozen=True)
class MaterialData:
    """A set of numbers of a real material.

    Attributes
    ----------
    name : str
        As in a scene file.
    title : str
        What it is.
    model : str
        Strain energy, as in a scene file.
    numbers : dict
        As the source gives them; moduli in ``unit``.
    unit : str
        Unit of the moduli.
    shear_modulus : float
        In Pa: what ``Scales(shear_modulus=...)`` takes.
    material : Material
        The strain energy with the shear modulus 1.
    valid : str
        For which deformations.
    citation : str
        Where the numbers are from.
    checked : str
        With what they were compared.
    """

    name: str
    title: str
    model: str
    numbers: Mapping[str, Any]
    unit: str
    shear_modulus: float
    material: Material
    valid: str
    citation: str
    checked: str


def material(name: str) -> Material:
    """The strain energy of a real material, in units of its shear modulus. A scene file of it holds the name.

    Parameters
    ----------
    name : {"treloar-ogden", "latex-balloon", "vhb-4910", "ecoflex-00-30"}

    Raises
    ------
    InputError
        For an unknown name.

    Examples
    --------
    >>> import femmembrane as fm
    >>> balloon = fm.material("latex-balloon")
    >>> round(balloon.ratio, 12), fm.Scene(material=balloon).to_dict()["material"]
    (0.1, {'name': 'latex-balloon'})
    """
    return material_data(name).material


def material_data(name: str) -> MaterialData:
    """Numbers, units, shear modulus, validity and source of a real material.

    Parameters
    ----------
    name : {"treloar-ogden", "latex-balloon", "vhb-4910", "ecoflex-00-30"}

    Raises
    ------
    InputError
        For an unknown name.

    Examples
    --------
    >>> import femmembrane as fm
    >>> data = fm.material_data("ecoflex-00-30")
    >>> data.model, data.numbers, data.unit, data.shear_modulus
    ('yeoh', {'c1': 17.0, 'c2': -0.2, 'c3': 0.023}, 'kPa', 34000.0)
    >>> scales = fm.Scales(radius=0.02, thickness=1e-3, shear_modulus=data.shear_modulus)
    >>> round(scales.to_si("pressure", 1.0), 6)
    1700.0
    """
    found = _sets()
    return found[choice("material.name", name, sorted(found))]


@cache
def _sets() -> dict[str, MaterialData]:
    tables = tomllib.loads((files(__package__) / "data" / "materials.toml").read_text(encoding="utf-8"))
    return {name: _record(name, table) for name, table in tables.items()}


def _record(name: str, table: dict[str, Any]) -> MaterialData:
    own, modulus = _BY_MODEL[table["model"]](table["numbers"])
    object.__setattr__(own, "named", name)  # beside its numbers: it plays no part in comparisons, and a changed copy has none
    pascals = table.pop("pascals")
    return MaterialData(name=name, material=own, shear_modulus=modulus * pascals, **table)


def _ogden(numbers: Any) -> tuple[Any, float]:
    modulus = math.fsum(m * a for m, a in zip(numbers["mu"], numbers["alpha"], strict=True)) / 2
    return Ogden(tuple(m / modulus for m in numbers["mu"]), tuple(numbers["alpha"])), modulus


def _mooney_rivlin(numbers: Any) -> tuple[Any, float]:
    plus, minus = numbers["s_plus"], numbers["s_minus"]  # 2 C_1 and -2 C_2
    return MooneyRivlin(-minus / plus), plus - minus


def _yeoh(numbers: Any) -> tuple[Any, float]:
    modulus = 2 * numbers["c1"]
    return Yeoh(numbers["c2"] / modulus, numbers["c3"] / modulus), modulus


def _lopez_pamies(numbers: Any) -> tuple[Any, float]:
    modulus = sum(numbers["mu"])
    first, second = numbers["alpha"]
    return LopezPamies(first, second, numbers["mu"][1] / modulus), modulus


_BY_MODEL: Mapping[str, Callable[[Any], tuple[Any, float]]] = {
    "lopez-pamies": _lopez_pamies,
    "mooney-rivlin": _mooney_rivlin,
    "ogden": _ogden,
    "yeoh": _yeoh,
}

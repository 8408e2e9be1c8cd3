"""How a membrane answers strains at a point: its material, its wrinkles, and the voltage or the charge on its faces.

This is the only place where they are put together. What it gives is a :class:`~.materials.Material` per thickness, in units of the local
modulus, whose stresses are the effective ones: those that the Legendre-Hadamard condition and wrinkles are decided by (Toupin 1956).
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .electric import Array
from .electric_wrinkles import ElectricTensionField
from .electrified import Electrified
from .materials import Material
from .sheet import Sheet
from .tension_field import TensionField

#: column of the local data: what a squared voltage, or frozen charge, is multiplied by for its local square over the modulus
ELECTRODE = "electrode"


def response_of(scene: Any, square: Any = None) -> Material:
    """The response of a membrane at points.

    Parameters
    ----------
    scene : Scene
        Or its parts, numbers of which may be symbols.
    square : float, ndarray or CasADi symbol, optional
        :func:`local_square` there; not asked for without voltage and charge.
    """
    material: Material = scene.material
    if scene.electricity is None:
        return TensionField(material) if scene.tension_field else material
    charge = scene.electricity.frozen_charge is not None
    own = getattr(material, "electrified", None)  # of a compressible material, whose thickness the field changes
    electrified = (own or partial(Electrified, material))(0.0 if charge else square, square if charge else 0.0)
    return ElectricTensionField(electrified) if scene.tension_field else electrified


def squared(electric: Any) -> Any:
    """phi^2 or q^2 where they are given."""
    value = electric.voltage if electric.voltage is not None else electric.frozen_charge
    return value * value


def local_square(scene: Any, R: Array, Z: Array, s: Array, square: Any) -> Any:
    """psi^2 = (phi/t)^2, or q^2, over the modulus at points of the meridian, from phi^2 or q^2; None without voltage and charge."""
    if scene.electricity is None:
        return None
    return square * response_columns(scene, R, Z, s).get(ELECTRODE, np.ones(np.shape(s)))


def response_columns(scene: Any, R: Array, Z: Array, s: Array) -> dict[str, Array]:
    """The local data of the response at points of the meridian; nothing where they are the same everywhere.

    ``electrode`` is 1/(t^2 m) for a voltage and 1/m for a frozen charge on the electrodes, with thickness t and modulus m.
    """
    electric = scene.electricity
    if electric is None:
        return {}
    sheet = Sheet.of(scene)
    if sheet is None and not electric.ends:
        return {}
    thickness, modulus = (1.0, 1.0) if sheet is None else sheet.factors(R, Z, s)
    through = 1.0 if electric.frozen_charge is not None else thickness * thickness
    return {ELECTRODE: electric.covers(s) / (through * modulus)}

"""Positions, stretches and stresses of the points of a meridian in a state of the membrane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..discretization.space import space_of_scene
from ..discretization.strains import strained_at
from ..physics.electric_wrinkles import ElectricTensionField
from ..physics.electrified import Electrified
from ..physics.loads import over_projection
from ..physics.magnetics import magnetic_field
from ..physics.magnetisation import Magnetisation, remanence_column
from ..physics.response import response_of
from ..physics.sheet import Sheet
from ..physics.stress import magnetised_stress, total_stress
from ..physics.tension_field import TensionField, cauchy_stress
from ..potential import potential_of
from ..quantities import Converter, quantity, si_values
from ..scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Profile:
    """Points of the deformed meridian, all arrays of shape (n,); 1 is the meridional direction, 2 the circumferential.

    Attributes
    ----------
    r : ndarray
        Reference radius over R0.
    s : ndarray or None
        Arc length of the reference meridian from its first end, over R0; None where it runs along the radius, from R = s.
    rho, eta : ndarray
        Deformed radius and height over R0.
    strain : (ndarray, ndarray)
        Hencky strains (e_1, e_2).
    mechanical, total : (ndarray, ndarray)
        Principal Cauchy stresses in units of mu (:mod:`~femmembrane.physics.stress`).
    effective : (ndarray, ndarray)
        What the energy feels: the mechanical stresses, less that of Maxwell under a voltage or a charge.
    beyond : (ndarray, ndarray) or None
        In a tension field the strains beyond natural width.
    field : ndarray or None
        With voltage or charge the true electric field in units of sqrt(mu/eps).
    """

    r: Array
    s: Array | None
    rho: Array
    eta: Array
    strain: tuple[Array, Array]
    mechanical: tuple[Array, Array]
    total: tuple[Array, Array]
    effective: tuple[Array, Array]
    beyond: tuple[Array, Array] | None = None
    field: Array | None = None

    def columns(self, scales: Converter | None = None) -> dict[str, Array]:
        """The profile by the names of its columns, with stretches in place of strains; stresses and field in SI units too where there are
        scales.
        """
        columns = {
            "r": self.r,
            **({} if self.s is None else {"s": self.s}),
            "rho": self.rho,
            "eta": self.eta,
            "stretch_1": np.exp(self.strain[0]),
            "stretch_2": np.exp(self.strain[1]),
            "mechanical_stress_1": self.mechanical[0],
            "mechanical_stress_2": self.mechanical[1],
            "total_stress_1": self.total[0],
            "total_stress_2": self.total[1],
            **({} if self.field is None else {"electric_field": self.field}),
        }
        if scales is not None:
            columns |= si_values({name: values for name, values in columns.items() if _converted(name, scales)}, scales)
        return columns


def _converted(name: str, scales: Converter) -> bool:
    kind = quantity(name).si
    return kind in ("stress", "electric_field") and scales.converts(kind)


def profile_at(scene: Scene, x: Array, pressure: float, s: Array) -> Profile:
    """The profile of a state at parameters s of the meridian, on the axis its limits.

    Parameters
    ----------
    scene : Scene
    x : ndarray, shape (n_free,)
        Displacement coefficients.
    pressure : float
        P = p R0/(mu T); enters the total stresses only, with what loads add to it.
    s : ndarray, shape (n,)
    """
    space = space_of_scene(scene)
    at = strained_at(space, x, s)
    R, Z, rho, eta, (e1, e2) = at.R, at.Z, at.rho, at.eta, at.strains
    response = response_of(scene, None if scene.electricity is None else potential_of(scene).local_square(x, R, Z, s))
    effective = mechanical = cauchy_stress(response, e1, e2)
    field = None if scene.electric is None else np.zeros_like(e1)  # one of a family may have no voltage
    if isinstance(response, (Electrified, ElectricTensionField)):
        mechanical, field = response.mechanical_stress(e1, e2), np.sqrt(response.field_squared(e1, e2))
    if (sheet := Sheet.of(scene)) is not None:
        modulus = sheet.factors(R, Z, s)[1]
        effective, mechanical = ((modulus * pair[0], modulus * pair[1]) for pair in (effective, mechanical))
        field = None if field is None else field * np.sqrt(modulus)
    beyond = response.beyond(e1, e2) if isinstance(response, (TensionField, ElectricTensionField)) else None
    h = magnetic_field(scene.sources, rho, eta) if scene.sources else (0.0, 0.0, 0.0)
    along = at.reference[0] + at.slopes[0], at.reference[1] + at.slopes[1]
    slope = np.hypot(*along)
    tangent = (along[0] / slope, along[1] / slope)
    local = pressure - over_projection(scene.loads, eta)[1]
    surroundings = local, scene.radius_to_thickness, h, tangent
    magnetisation = Magnetisation.of(scene)
    if magnetisation is None:
        total = total_stress(effective, *surroundings, scene.susceptibility or 0.0)
    else:
        stretches, remanence = (np.exp(e1), np.exp(e2)), remanence_column(magnetisation, R, Z, s, space.side)
        total = magnetised_stress(effective, *surroundings, stretches, magnetisation, remanence)
    return Profile(R, None if space.radial else s, rho, eta, (e1, e2), mechanical, total, effective, beyond, field)

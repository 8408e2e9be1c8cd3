"""What the strong form has to meet besides its equations: at the ends of a meridian, where legs meet, and by the control.

The variation of the energy leaves at an end, with the force F that the meridian hands on (per 2 pi) and the volume under flat lids ::

    s (F_z 2 pi + pi (rho^2 - wall^2) P) = force on a hub,       F_rho + g(eta) rho = 0

where s is 1 at the last end and -1 at the first, P counts positive to the left of the meridian, g is the energy of a load over projected
area, and ``wall`` the radius of a wall along which an end slides (:mod:`..discretization.supports`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..discretization.lift import lift_of
from ..discretization.space import anchored
from ..discretization.supports import Support, as_support, floats
from ..errors import InputError
from ..physics.loads import on_hubs, over_projection
from .strong_form import Guess, StrongForm

Array = NDArray[np.float64]


class Ends:
    """The conditions of one scene under one control.

    Attributes
    ----------
    floats : bool
        Whether nothing holds the membrane along the axis. Then a dead force along it, ``pull_up``, is one more unknown, which comes out
        as 0, and the height of the first end is that of the guess.
    known_height : float or None
        Of the first end, where it is prescribed.
    """

    def __init__(self, form: StrongForm, control: str, load: float, guess: Guess) -> None:
        scene, mesh = form.scene, form.scene.mesh
        self.form, self.control, self.load = form, control, load
        self.closed = not mesh.supports()
        self.supports: list[Support] = [as_support(held) for held in mesh.supports()]
        self.floats = floats(self.supports) and "along" not in anchored(scene)
        self.known_height: float | None = guess.center_height if self.floats else None
        if control == "center_height":
            self.known_height = load
            if self.closed or "w" in self.supports[0].held:
                raise InputError("center_height", load, "the first end of this meridian is held along the axis; prescribe another quantity")
            if self.floats:
                raise InputError("center_height", load, "nothing holds this membrane along the axis; prescribe another quantity")
        lift = lift_of(mesh, scene.prestretch)
        self.R, self.Z = mesh.position(mesh.breakpoints()[[0, -1]])
        self.stretch = np.ones(2) if lift is None else 1 + np.array(lift.radial)
        self.height = self.Z + (0.0 if lift is None else np.array(lift.axial))
        self.walls = [end.wall for end in self.supports]
        self.hub_forces = on_hubs(form.loads, [end.rigid for end in self.supports])

    def at_end(self, k: int, y: Array, pressure: Any) -> list[Any]:
        """The two conditions of the first (k = 0) or last (k = 1) end that is no pole, from the state there along the meridian."""
        leg, support = self.form.legs[0], self.supports[k]
        f_rho, f_z = self.form.forces(y, leg, leg.length if k else 0.0)
        rho, R = np.exp(y[0]) * self.R[k], self.R[k]
        across = y[0] - np.log(self.stretch[k])
        if "u" not in support.held:
            across = (f_rho + leg.pushes * rho * over_projection(self.form.loads, y[1])[0]) / R
        along = y[1] - self.height[k]
        if "w" not in support.held:
            wall = (R * self.stretch[k]) ** 2 if support.wall else 0.0
            sign = 1 if k else -1
            along = (sign * (f_z + leg.pushes * (rho**2 - wall) * pressure / 2) - self.hub_forces[k] / (2 * np.pi)) / R
        return [across, along]

    def conditions(self, begins: Sequence[Array], ends: Sequence[Array], pressure: Any, volume: Any) -> Array:
        """All conditions but that of a known height.

        Parameters
        ----------
        begins, ends : sequence of ndarray, shape (4, ...)
            States at the beginning and at the end of each leg.
        pressure, volume : float or ndarray
            The volume under flat lids that was integrated; None where it is not prescribed.

        Returns
        -------
        ndarray
            Zero at a solution: what is not met at ends that are no poles, where legs meet, and of a prescribed volume.
        """
        legs, rows = self.form.legs, []
        if self.closed:
            turn = 2 * np.pi * round(float(np.mean(ends[0][3] - begins[0][3])) / (2 * np.pi))
            rows += list(ends[0] - begins[0] - np.array([0.0, 0.0, 0.0, turn]).reshape(-1, *(1,) * (begins[0].ndim - 1)))
        else:
            if not legs[0].pole:
                rows += self.at_end(0, begins[0], pressure)
            if len(legs) == 1:
                rows += self.at_end(1, ends[0], pressure)
            else:
                miss = ends[0] - ends[1]
                rows += [*miss[:3], miss[3] - np.pi * np.round(np.mean(miss[3]) / np.pi)]
        if self.control == "volume":
            rows.append((volume + self.moved_lids(begins, ends) - self.load) / max(abs(self.load), 1.0))
        return np.array(rows)

    def moved_lids(self, begins: Sequence[Array], ends: Sequence[Array]) -> Any:
        """What the volume has beyond flat lids at the ends: lids stay where they were at ends that slide along a wall."""
        total, leg = 0.0, self.form.legs[0]
        for k, wall in enumerate(self.walls):
            if wall:
                y = ends[0] if k else begins[0]
                total += (1 if k else -1) * leg.pushes * np.pi * (self.R[k] * self.stretch[k]) ** 2 * (y[1] - self.height[k])
        return total

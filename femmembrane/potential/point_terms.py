"""What the terms of a scene answer at single points of a membrane, for the second variation: no mesh and no state enters."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import casadi as ca
import numpy as np

from ..kernels.interface import Array
from ..physics.loads import over_reference
from ..physics.magnetisation import Magnetisation, position_energy_density, remanence_column
from ..physics.response import response_of
from ..threads import cached_property
from .expressions import BUILDING, casadi_answers_numpy, point_rows, response_expressions
from .magnetic import wave_function
from .nearby import Nearby
from .replay import at_points

if TYPE_CHECKING:
    from ..discretization.space import Space
    from ..physics.electric import Electric
    from ..physics.loads import Load
    from ..physics.magnetics import Source
    from ..scene import Scene


class PointTerms:
    """The terms of a scene, each with exact derivatives at any point.

    Attributes
    ----------
    scene : Scene
    sources, loads : tuple
        Those that act.
    magnetisation : Magnetisation or None
    space : Space
        Its ``side`` says on which side of the meridian the inside is.
    """

    scene: Scene
    space: Space
    sources: tuple[Source, ...]
    loads: tuple[Load, ...]
    magnetisation: Magnetisation | None

    @property
    def surrounded(self) -> bool:
        """Whether anything but the pressure acts on the membrane. Otherwise the flat unloaded state is an equilibrium without stiffness."""
        return bool(self.sources or self.loads or self.electric)

    @property
    def prestressed(self) -> bool:
        """Whether the material has stress at rest, which holds no equilibrium in a curved membrane."""
        return bool(getattr(self.scene.material, "prestressed", False))

    @cached_property
    def electric(self) -> Electric | None:
        """Voltage or charge of the scene without units; None without."""
        return self.scene.electricity

    def response(self, e1: Array, e2: Array, square: Array | None = None) -> Array:
        """Principal stresses that the energy feels and their derivatives with respect to the Hencky strains, where the modulus is 1.

        Parameters
        ----------
        e1, e2 : ndarray
        square : ndarray, optional
            :meth:`local_square` at the points, with voltage or charge.

        Returns
        -------
        ndarray, shape (5, n)
            s_1, s_2, ds_1/de_1, ds_1/de_2, ds_2/de_2 in units of mu.
        """
        return at_points(self._response_function, e1, e2, *([] if square is None else [square]))

    @cached_property
    @BUILDING
    def _response_function(self) -> ca.Function:
        e = ca.SX.sym("e", 2 if self.electric is None else 3)
        with casadi_answers_numpy():
            response = response_of(self.scene, None if self.electric is None else e[2])
            stress, tangent = response_expressions(response, e)
        return point_rows([e], [stress, tangent[0, 0], tangent[0, 1], tangent[1, 1]])

    def field_energy(self, rho: Array, eta: Array) -> Array:
        """Energy density of sources and loads per reference area and its derivatives with respect to the position.

        Returns
        -------
        ndarray, shape (6, n)
            m, m_rho, m_eta, m_rho_rho, m_rho_eta, m_eta_eta in units of mu T, where the thickness is 1; zeros without sources and loads.
            A magnetic energy that depends on the slope is not part of it, see :meth:`wave_energy`.
        """
        if not self.surrounded:
            return np.zeros((6, np.size(rho)))
        return at_points(self._field_energy_function, rho, eta)

    @cached_property
    @BUILDING
    def _field_energy_function(self) -> ca.Function:
        y = ca.SX.sym("y", 2)
        with casadi_answers_numpy():
            density = over_reference(self.loads, y[0], y[1]) + ca.SX(0)
            near, scene = Nearby(self.sources, y[0], y[1]), self.scene
            if self.sources and not self.tilts:
                density += position_energy_density(near.sources, scene.susceptibility or 0.0, scene.saturation, y[0], y[1])
            hessian, gradient = ca.hessian(density, y)
            density, gradient, hessian = near.placed(density, gradient, hessian)
        return point_rows([y], [density, gradient, hessian[0, 0], hessian[0, 1], hessian[1, 1]])

    @property
    def field_operations(self) -> int:
        """Number of elementary operations of :meth:`field_energy` at one point."""
        return int(self._field_energy_function.n_instructions())

    @property
    def tilts(self) -> bool:
        """Whether the magnetic energy depends on the slope of the meridian."""
        return self.magnetisation is not None and self.magnetisation.tilts

    def wave_energy(self, rho: Array, eta: Array, slopes: tuple[Array, Array], R: Array, Z: Array, s: Array) -> Array | None:
        """Second derivatives of a magnetic energy that depends on the slope, see :func:`.magnetic.wave_function`; None without one.

        Parameters
        ----------
        rho, eta, slopes : ndarray
            Position and its derivatives with respect to the arc length of the reference meridian.
        R, Z, s : ndarray
            Reference meridian.

        Returns
        -------
        ndarray, shape (25, n)
            In units of mu T, where the thickness is 1.
        """
        if not self.tilts:
            return None
        remanence = remanence_column(self.magnetisation, R, Z, s, self.space.side)
        return at_points(self._wave_function, rho, eta, *slopes, R, np.zeros_like(rho) if remanence is None else remanence)

    @cached_property
    @BUILDING
    def _wave_function(self) -> ca.Function:
        with casadi_answers_numpy():
            return wave_function(cast(Magnetisation, self.magnetisation), self.sources)

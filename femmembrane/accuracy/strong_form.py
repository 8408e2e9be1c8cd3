"""The strong form of equilibrium as a system of first order (paper eq. 39), for methods that share nothing with the finite elements.

The tension of the meridian is F = r W_1 (cos phi, sin phi), with phi its angle to the plane of the rim. Along and across the meridian,
and with Hencky strains e_i = log lambda_i, its balance of forces is ::

    (r W_1)' = W_2 cos phi + r m_t,           r W_1 phi' = -W_2 sin phi + r m_n - P rho lambda_1
    rho' = lambda_1 cos phi,   eta' = lambda_1 sin phi,     W_i = s_i/lambda_i,     m_t, m_n: the gradient of the energy density
of sources and loads per reference area

Its size is kept through the strain it causes, so that a right-hand side asks the material once and nothing is solved for. The unknowns
are (e_2, eta, d, phi) with d = e_1 - e_2: at the pole d and phi vanish and everything is smooth, the singular terms are *linear*::

    y' = S y/r + f(r, y),      S = [[0 0 1 0], [0 0 0 0], [0 0 -2 0], [0 0 0 -1]],      f(0, y) = (0, 0, 0, (m_eta - P lambda^2)/W_1)

and at the rim e_2 = eta = 0, or what its own place asks for. An energy that depends on the slope of the meridian changes both equations,
:mod:`.sloped`. The energies, the volume and the force of the sources follow from the formulas of the material and the sources.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import between, convert, number, only
from ..discretization.lift import lift_of
from ..discretization.meridian import Disc
from ..errors import InputError
from ..physics.loads import over_projection, over_reference
from ..physics.magnetisation import Magnetisation, position_energy_density, sources_that_act
from ..physics.response import response_of, squared
from ..scene import Scene
from .sloped import is_strong, pull

Array = NDArray[np.float64]

#: the singular matrix S
SINGULAR: Array = np.array([[0.0, 0, 1, 0], [0, 0, 0, 0], [0, 0, -2, 0], [0, 0, 0, -1]])
#: imaginary step of the derivatives of the magnetic energy: nothing is subtracted, so that it may be tiny
_STEP = 1e-30


class StrongForm:
    """The equations of one scene.

    Parameters
    ----------
    scene : Scene
        A plain membrane (no tension field) on the clamped disc; mesh size and degree play no part. Sources are differentiated by a complex
        step: their fields must be analytic functions that accept complex positions.

    Attributes
    ----------
    rim : (float, float)
        Stretch around the rim, and its height over R0.
    evaluations : int
        Radii at which right-hand sides were computed so far.

    Raises
    ------
    InputError
        For a scene with a tension field, whose equations change where wrinkles begin, or another meridian than the disc.
    """

    def __init__(self, scene: Scene) -> None:
        if scene.tension_field:
            allowed = "false is allowed: shooting and collocation solve the equations of a plain membrane"
            raise InputError("effects.tension_field", True, allowed)
        for key in ("thickness", "modulus"):
            if getattr(scene, key) is not None:
                raise InputError(f"membrane.{key}", getattr(scene, key).given, "an even sheet is allowed here")
        if not isinstance(scene.mesh, Disc):
            raise InputError("mesh.shape", getattr(scene.mesh, "shape", scene.mesh), "the disc is allowed")
        electric = scene.electricity
        if electric is not None and (electric.total_charge is not None or electric.ends):
            allowed = "a voltage or a frozen charge on the whole membrane is allowed: the equations here are local and smooth"
            raise InputError(f"electric.{electric.load}", getattr(electric, electric.load), allowed)
        self.material = response_of(scene, None if electric is None else squared(electric))
        lift = lift_of(scene.mesh, scene.prestretch)
        self.rim = (1.0, 0.0) if lift is None else (1 + lift.radial[1], lift.axial[1])
        self.susceptibility = scene.susceptibility or 0.0
        self.saturation = scene.saturation
        self.sources = sources_that_act(scene)
        magnetisation = Magnetisation.of(scene) if self.sources else None
        self.sloped = magnetisation if magnetisation is not None and magnetisation.tilts else None
        if self.sloped is not None and not is_strong(self.sloped):
            allowed = 'none is allowed here but a number that is "normal" and "rotated": others change with the stretches, or have a cone'
            raise InputError("membrane.remanence", scene.remanence, allowed)
        self.loads = tuple(load for load in scene.loads if load.acts)
        self.evaluations = 0

    def rates(self, r: Any, y: Array, pressure: Any) -> Array:
        """y' at radii r > 0.

        Parameters
        ----------
        r : float or ndarray, shape (n,)
        y : ndarray, shape (4, n)
            (e_2, eta, d, phi).
        pressure : float or ndarray, shape (n,)
        """
        self.evaluations += int(np.size(r))
        e2, eta, d, phi = y
        e1, cos, sin = e2 + d, np.cos(phi), np.sin(phi)
        l1, l2 = np.exp(e1), np.exp(e2)
        s1, s2 = self.material.stress(e1, e2)
        s11, s12, _ = self.material.tangent(e1, e2)
        m_rho, m_eta = self.force(l2 * r, eta)
        pressure = pressure - over_projection(self.loads, eta)[1]
        turned = None if self.sloped is None else pull(self.sloped, self.sources, l2 * r, eta, cos, sin)
        if turned is not None:
            m_rho, m_eta = m_rho + turned.rho, m_eta + turned.eta
        # differences of nearly equal numbers at the pole are written so that they keep their digits
        excess = np.expm1(d) * cos - 2 * np.sin(phi / 2) ** 2  # rho'/lambda_2 - 1
        along = (s2 - s1 + s2 * excess) / r + l1 * (m_rho * cos + m_eta * sin)
        e2_r = excess / r
        across = -s2 * np.exp(d) * sin / r + l1 * (m_eta * cos - m_rho * sin) - pressure * l2 * l1**2
        if turned is None:
            e1_r = (along - s12 * e2_r) / (s11 - s1)
            phi_r = across / s1
        else:  # both equations times lambda_1/r
            a, b, c = s11 - s1, -turned.turning, s1 + turned.stiffness
            right = along - s12 * e2_r, across - turned.turning / r - l1 * turned.along
            e1_r, phi_r = (right[0] * c - b * right[1]) / (a * c - b * b), (a * right[1] - b * right[0]) / (a * c - b * b)
        return np.array([e2_r, l1 * sin, e1_r - e2_r, phi_r])

    def regular(self, r: Array, y: Array, pressure: float) -> Array:
        """f(r, y) at radii r >= 0, shape (4, n)."""
        away = r > 0
        f = np.zeros_like(y)
        f[:, away] = self.rates(r[away], y[:, away], pressure) - SINGULAR @ y[:, away] / r[away]
        e, eta = y[0, ~away], y[1, ~away]
        if e.size:
            f[3, ~away] = self._lift(e, eta, pressure)
        return f

    def densities(self, r: Any, y: Array) -> Array:
        """Derivatives along r of the volume, elastic and magnetic energy, all with the 2 pi, shape (3, n)."""
        e2, eta, d, phi = y
        l1, rho = np.exp(e2 + d), np.exp(e2) * r
        magnetic = self._magnetic(rho, eta) if self.sources else np.zeros_like(rho)
        if self.sloped is not None:
            magnetic = pull(self.sloped, self.sources, rho, eta, np.cos(phi), np.sin(phi)).value
        elastic = self.material.energy(e2 + d, e2)
        return 2 * np.pi * np.array([rho * l1 * np.cos(phi) * (eta - self.rim[1]), r * elastic, r * magnetic])

    def pole(self, r: Any, center_height: Any, stretch: Any, pressure: Any) -> Array:
        """The regular solution near the pole, y at small radii r > 0 up to terms of order r^4, shape (4, n)."""
        e = np.log(stretch)
        s, _ = self.material.stress(e, e)
        s11, s12, _ = self.material.tangent(e, e)
        curvature = self._lift(e, center_height, pressure) / 2  # phi = curvature r
        m_rho, m_eta = self.force(stretch * r, center_height)
        if self.sloped is not None:
            angle = curvature * r
            turned = pull(self.sloped, self.sources, stretch * r, center_height + 0 * angle, np.cos(angle), np.sin(angle))
            m_rho, m_eta = m_rho + turned.rho + turned.turning / stretch * curvature, m_eta + turned.eta
        inward = stretch * (m_rho / r + m_eta * curvature)
        # 4 (d/r^2) is the limit of f_d/r
        d = (((s12 - s) * curvature**2 / 2 + inward) / (s11 - s) + curvature**2 / 2) / 4
        square = r * r
        return np.array(
            [e + (d - curvature**2 / 2) * square / 2, center_height + stretch * curvature * square / 2, d * square, curvature * r]
        )

    def force(self, rho: Any, eta: Any) -> tuple[Any, Any]:
        """Gradient (m_rho, m_eta) of the energy density of sources and loads per reference area."""
        if not (self.loads or (self.sources and self.sloped is None)):
            return 0.0, 0.0
        place = np.array([rho + 1j * _STEP, rho + 0j]), np.array([eta + 0j, eta + 1j * _STEP])
        values = over_reference(self.loads, *place) + (self._magnetic(*place) if self.sources and self.sloped is None else 0j * place[0])
        gradient = values.imag / _STEP
        return gradient[0], gradient[1]

    def _magnetic(self, rho: Any, eta: Any) -> Any:
        return position_energy_density(self.sources, self.susceptibility, self.saturation, rho, eta)

    def _lift(self, e: Any, eta: Any, pressure: Any) -> Any:
        """(m_eta - P lambda^2)/W_1 at the pole."""
        stress, _ = self.material.stress(e, e)
        _, m_eta = self.force(np.zeros_like(eta), eta)
        pressure = pressure - over_projection(self.loads, eta)[1]
        if self.sloped is not None:
            zero = np.zeros_like(eta)
            turned = pull(self.sloped, self.sources, zero, eta, 1 + zero, zero)
            return np.exp(e) * (m_eta + turned.eta - 2 * turned.along - pressure * np.exp(2 * e)) / (stress + turned.stiffness)
        return np.exp(e) * (m_eta - pressure * np.exp(2 * e)) / stress


@dataclass(frozen=True)
class Guess:
    """Where a method sets out from.

    Attributes
    ----------
    pressure, center_height : float
        P and the height of the pole over R0.
    stretch : float
        lambda_1 = lambda_2 > 0 at the pole.
    profile : mapping of ndarray, optional
        Reference radii r (increasing, from 0 to 1) with rho and eta there; collocation needs one.

    Raises
    ------
    InputError
        For a number that is not finite, a stretch that is not positive, or a profile without these columns.
    """

    pressure: float
    center_height: float
    stretch: float
    profile: Mapping[str, Any] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in ("pressure", "center_height", "stretch"):
            positive = name == "stretch"
            bound = {"above": 0.0} if positive else {}
            convert(self, f"guess.{name}", f"a finite number{' > 0' if positive else ''} is allowed", **bound)
        if self.profile is not None and not {"r", "rho", "eta"} <= set(self.profile):
            raise InputError("guess.profile", sorted(self.profile), "columns r, rho and eta are needed")

    @classmethod
    def of(cls, equilibrium: Any) -> Guess:
        """A known state as a guess: an :class:`~femmembrane.Equilibrium` or a :class:`Solution`."""
        profile = equilibrium.profile()
        return cls(equilibrium.pressure, equilibrium.center_height, float(profile["stretch_1"][0]), profile)

    def beyond(self, before: Guess, factor: float = 1.0) -> Guess:
        """Linear extrapolation from ``before`` through this solution, by ``factor`` times their distance; profiles on the same radii."""

        def along(name: str) -> float:
            return float(getattr(self, name) + factor * (getattr(self, name) - getattr(before, name)))

        profile = None
        if self.profile is not None and before.profile is not None:
            mine, other = self.profile, before.profile
            profile = {"r": mine["r"], **{n: mine[n] + factor * (mine[n] - other[n]) for n in ("rho", "eta")}}
        return Guess(along("pressure"), along("center_height"), along("stretch"), profile)


@dataclass(frozen=True, eq=False)
class Solution:
    """The answer of a method that is independent of the finite elements.

    Attributes
    ----------
    method : str
    pressure, volume, center_height, elastic_energy, magnetic_energy : float
        As in :class:`~femmembrane.Equilibrium`.
    converged : bool
        Whether ``residual`` is below what was asked for; recomputed, whatever the method says of itself.
    residual : float
        What is left of the boundary conditions and of the control (and for collocation of the equations); infinite if nothing was found.
    evaluations, iterations : int
        Radii at which right-hand sides were computed, and iterations of the outer solver.
    message : str
        Why it did not converge.
    """

    method: str
    pressure: float
    volume: float
    center_height: float
    elastic_energy: float
    magnetic_energy: float
    converged: bool
    residual: float
    evaluations: int
    iterations: int
    message: str = ""
    _at: Callable[[Array], Array] | None = field(default=None, repr=False)

    def profile(self, r: ArrayLike | None = None) -> dict[str, Array]:
        """The deformed meridian at reference radii in [0, 1], 101 of them by default: r, rho, eta, stretch_1, stretch_2.

        Raises
        ------
        InputError
            For radii outside the membrane, or when nothing was found.
        """
        at = np.linspace(0, 1, 101) if r is None else np.atleast_1d(np.asarray(r, dtype=float))
        if not ((at >= 0) & (at <= 1)).all():
            raise InputError("r", r, "reference radii in [0, 1] are allowed")
        if self._at is None:
            raise InputError("profile", self.method, f"nothing was found: {self.message}")
        e2, eta, d, _ = self._at(at)
        return {"r": at, "rho": np.exp(e2) * at, "eta": eta, "stretch_1": np.exp(e2 + d), "stretch_2": np.exp(e2)}


#: what may be prescribed, as the position of its number in (center_height, stretch, pressure); a volume has no position there
POLE_UNKNOWN: Mapping[str, int | None] = {"center_height": 0, "pressure": 2, "volume": None}


def prescribed(volume: float | None, pressure: float | None, center_height: float | None) -> tuple[str, float]:
    """The one control that is given and its load.

    Raises
    ------
    InputError
        Unless exactly one is given, a finite number.
    """
    given = {"volume": volume, "pressure": pressure, "center_height": center_height}
    name, load = only("control", given, "exactly one of volume, pressure and center_height is allowed")
    return name, number(name, load, "one finite number is allowed")


def check_tolerance(key: str, value: Any, least: float) -> float:
    """A tolerance as a float.

    Raises
    ------
    InputError
        Unless it is a number from ``least`` to 0.1.
    """
    return between(key, value, least, 0.1, f"a number from {least:.1g} to 0.1 is allowed")

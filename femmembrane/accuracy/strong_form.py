"""The strong form of equilibrium as a system of first order (paper eq. 39), for methods that share nothing with the finite elements.

The meridian runs at unit speed along x, with the reference radius R and the angle Phi. The tension of the deformed meridian per
circumference at rest is N_1 (cos phi, sin phi), with phi its angle to the plane of the rim. Along and across the meridian, and with Hencky
strains e_i = log lambda_i, its balance of forces is ::

    (R N_1)' = N_2 cos phi + R b_t,           R N_1 phi' = -N_2 sin phi + R b_n - P rho lambda_1
    rho' = lambda_1 cos phi,   eta' = lambda_1 sin phi,     N_i = t m s_i/lambda_i,     b_t, b_n: the gradient of the energy density of
sources and loads per reference area; thickness t and modulus m

Its size is kept through the strain it causes, so that a right-hand side asks the material once and nothing is solved for. The unknowns
are (e_2, eta, d, phi) with d = e_1 - e_2: at a pole d and phi vanish and everything is smooth, the singular terms are *linear*::

    y' = S y/x + f(x, y),      S = [[0 0 1 0], [0 0 0 0], [0 0 -2 0], [0 0 0 -1]],      f(0, y) = (0, 0, 0, (b_eta - P lambda^2)/N_1)

At other ends the supports ask for places or forces, :mod:`.ends`. An energy that depends on the slope of the meridian changes both
equations, :mod:`.sloped`. The energies, the volume and the force of the sources follow from the formulas of the material and the sources.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from ..checks import between, convert, number, only
from ..discretization.meridian import LEAST_LENGTH, Disc, Meridian
from ..errors import InputError
from ..physics.loads import lidded_volume_density, over_projection, over_reference
from ..physics.magnetisation import Magnetisation, position_energy_density, sources_that_act
from ..physics.response import response_of, squared
from ..physics.sheet import Sheet
from ..scene import Scene
from .legs import Leg, Unevenness, legs_of
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
        A plain membrane (no tension field) of a smooth shape; mesh size and degree play no part. Sources are differentiated by a complex
        step: their fields must be analytic functions that accept complex positions.

    Attributes
    ----------
    legs : tuple of Leg
        Where the equations are integrated, :mod:`.legs`. Methods take the first of them unless another one is named.
    evaluations : int
        Places at which right-hand sides were computed so far.

    Raises
    ------
    InputError
        For a scene with a tension field, whose equations change where wrinkles begin, for a meridian or a sheet with kinks, and for a
        voltage or charge that is not local or not the same everywhere.
    """

    def __init__(self, scene: Scene) -> None:
        if scene.tension_field:
            allowed = "false is allowed: shooting and collocation solve the equations of a plain membrane"
            raise InputError("effects.tension_field", True, allowed)
        if scene.bodies:
            raise InputError("obstacle", scene.bodies[0].label(), "none is allowed here: the equations are those of a free membrane")
        self.scene = scene
        self.legs = legs_of(scene.mesh)
        sheet = Sheet.of(scene)
        self.uneven = None if sheet is None else Unevenness(sheet, scene.mesh)
        electric = scene.electricity
        if electric is not None and (electric.total_charge is not None or electric.ends or sheet is not None):
            allowed = "a voltage or a frozen charge on a whole, even membrane is allowed: the equations here are local and smooth"
            raise InputError(f"electric.{electric.load}", getattr(electric, electric.load), allowed)
        self.material = response_of(scene, None if electric is None else squared(electric))
        self.susceptibility = scene.susceptibility or 0.0
        self.saturation = scene.saturation
        self.sources = sources_that_act(scene)
        magnetisation = Magnetisation.of(scene) if self.sources else None
        self.sloped = magnetisation if magnetisation is not None and magnetisation.tilts else None
        if self.sloped is not None and not is_strong(self.sloped):
            allowed = 'none is allowed here but a number that is "normal" and "rotated": others change with the stretches, or have a cone'
            raise InputError("membrane.remanence", scene.remanence, allowed)
        if self.sloped is not None and sheet is not None:
            raise InputError("effects.demagnetization", scene.demagnetization, "not together with an uneven sheet here")
        if self.sloped is not None and self.sloped.remanence is not None and (len(self.legs) > 1 or self.legs[0].pushes < 0):
            raise InputError(
                "membrane.remanence", scene.remanence, "none is allowed here where the inside lies on the left of the meridian"
            )
        self.loads = tuple(load for load in scene.loads if load.acts)
        self.evaluations = 0

    def rates(self, x: Any, y: Array, pressure: Any, leg: Leg | None = None, pull_up: Any = 0.0) -> Array:
        """y' at distances x > 0 from the beginning of a leg.

        Parameters
        ----------
        x : float or ndarray, shape (n,)
        y : ndarray, shape (4, n)
            (e_2, eta, d, phi).
        pressure : float or ndarray, shape (n,)
        leg : Leg, optional
        pull_up : float or ndarray, shape (n,)
            A dead force along the axis per reference area; 0, but unknown where nothing else holds the membrane along the axis.
        """
        leg = leg or self.legs[0]
        self.evaluations += int(np.size(x))
        e2, eta, d, phi = y
        R, straight, angle = leg.reference(x)
        e1, cos, sin = e2 + d, np.cos(phi), np.sin(phi)
        l1, l2 = np.exp(e1), np.exp(e2)
        s1, s2 = self.material.stress(e1, e2)
        s11, s12, _ = self.material.tangent(e1, e2)
        thickness, modulus, slope = self._sheet(leg, x)
        b_rho, b_eta = self.force(l2 * R, eta)
        b_rho, b_eta = b_rho / modulus, (b_eta - pull_up) / modulus
        pressure = leg.pushes * (pressure - over_projection(self.loads, eta)[1]) / (thickness * modulus)
        turned = None if self.sloped is None else pull(self.sloped, self.sources, l2 * R, eta, cos, sin)
        if turned is not None:
            b_rho, b_eta = b_rho + turned.rho, b_eta + turned.eta
        # differences of nearly equal numbers at a pole are written so that they keep their digits
        excess = np.expm1(d) * cos - 2 * np.sin((phi + angle) / 2) * np.sin((phi - angle) / 2)  # rho'/lambda_2 - R'
        along = ((s2 - s1) * straight + s2 * excess) / R + l1 * (b_rho * cos + b_eta * sin) - s1 * slope
        e2_x = excess / R
        across = -s2 * np.exp(d) * sin / R + l1 * (b_eta * cos - b_rho * sin) - pressure * l2 * l1**2
        if turned is None:
            e1_x = (along - s12 * e2_x) / (s11 - s1)
            phi_x = across / s1
        else:  # both equations times lambda_1/R
            a, b, c = s11 - s1, -turned.turning, s1 + turned.stiffness
            right = along - s12 * e2_x, across - turned.turning * straight / R - l1 * turned.along
            e1_x, phi_x = (right[0] * c - b * right[1]) / (a * c - b * b), (a * right[1] - b * right[0]) / (a * c - b * b)
        return np.array([e2_x, l1 * sin, e1_x - e2_x, phi_x])

    def regular(self, x: Array, y: Array, pressure: Any, leg: Leg | None = None, pull_up: Any = 0.0) -> Array:
        """f(x, y) at distances x >= 0 from a pole, shape (4, n)."""
        leg = leg or self.legs[0]
        away = x > 0
        f = np.zeros_like(y)
        f[:, away] = self.rates(x[away], y[:, away], pressure, leg, pull_up) - SINGULAR @ y[:, away] / x[away]
        e, eta = y[0, ~away], y[1, ~away]
        if e.size:
            f[3, ~away] = self._lift(e, eta, pressure, leg, pull_up)
        return f

    def densities(self, x: Any, y: Array, leg: Leg | None = None) -> Array:
        """Derivatives along a leg of the volume under flat lids, elastic and magnetic energy, all with the 2 pi, shape (3, n)."""
        leg = leg or self.legs[0]
        e2, eta, d, phi = y
        R = leg.reference(x)[0]
        thickness, modulus, _ = self._sheet(leg, x)
        l1, rho = np.exp(e2 + d), np.exp(e2) * R
        magnetic = self._magnetic(rho, eta) if self.sources else np.zeros_like(rho)
        if self.sloped is not None:
            magnetic = pull(self.sloped, self.sources, rho, eta, np.cos(phi), np.sin(phi)).value
        elastic = modulus * self.material.energy(e2 + d, e2)
        volume = lidded_volume_density(rho, leg.pushes * l1 * np.sin(phi))
        return 2 * np.pi * np.array([volume, R * thickness * elastic, R * thickness * magnetic])

    def pole(self, x: Any, height: Any, stretch: Any, pressure: Any, leg: Leg | None = None, pull_up: Any = 0.0) -> Array:
        """The regular solution near a pole, y at small distances x > 0 up to terms of order x^4, shape (4, n)."""
        leg = leg or self.legs[0]
        e = np.log(stretch)
        s, _ = self.material.stress(e, e)
        s11, s12, _ = self.material.tangent(e, e)
        bend = self._lift(e, height, pressure, leg, pull_up) / 2  # phi = bend x
        R, _, angle = leg.reference(np.asarray(x))
        b_rho, b_eta = self.force(stretch * R, height)
        if self.sloped is not None:
            phi = bend * x
            turned = pull(self.sloped, self.sources, stretch * R, height + 0 * phi, np.cos(phi), np.sin(phi))
            b_rho, b_eta = b_rho + turned.rho + turned.turning / stretch * bend, b_eta + turned.eta
        modulus, curvature = 1.0, 0.0
        if self.uneven is not None:
            modulus, curvature = self.uneven.factors(leg.start)[1], self.uneven.curvature(leg.start)
        inward = stretch * (b_rho / R + (b_eta - pull_up) * bend) / modulus - s * curvature
        bent = (bend**2 - (angle / x) ** 2) / 2
        # 4 (d/x^2) is the limit of f_d/x
        d = ((s12 - s) * bent + inward) / (s11 - s) / 4 + bent / 4
        square = x * x
        return np.array([e + (d - bent) * square / 2, height + stretch * bend * square / 2, d * square, bend * x])

    def forces(self, y: Array, leg: Leg, x: float) -> tuple[Any, Any]:
        """(F_rho, F_z) per circumference at rest over 2 pi: what the deformed meridian hands on at a place along its leg."""
        e2, eta, d, phi = y
        cos, sin, l1 = np.cos(phi), np.sin(phi), np.exp(e2 + d)
        thickness, modulus, _ = self._sheet(leg, x)
        R = leg.reference(x)[0]
        tension = R * thickness * modulus * self.material.stress(e2 + d, e2)[0] / l1
        if self.sloped is None:
            return tension * cos, tension * sin
        across = R * thickness * pull(self.sloped, self.sources, np.exp(e2) * R, eta, cos, sin).turning / l1
        return tension * cos - across * sin, tension * sin + across * cos

    def force(self, rho: Any, eta: Any) -> tuple[Any, Any]:
        """Gradient (b_rho, b_eta) of the energy density of sources and loads per reference area and thickness."""
        if not (self.loads or (self.sources and self.sloped is None)):
            return 0.0, 0.0
        place = np.array([rho + 1j * _STEP, rho + 0j]), np.array([eta + 0j, eta + 1j * _STEP])
        values = over_reference(self.loads, *place) + (self._magnetic(*place) if self.sources and self.sloped is None else 0j * place[0])
        gradient = values.imag / _STEP
        return gradient[0], gradient[1]

    def _sheet(self, leg: Leg, x: Any) -> tuple[Any, Any, Any]:
        """Thickness, modulus, and the slope of the logarithm of their product along a leg."""
        if self.uneven is None:
            return 1.0, 1.0, 0.0
        s = leg.along(np.asarray(x))
        return *self.uneven.factors(s), leg.direction * self.uneven.slope(s)

    def _magnetic(self, rho: Any, eta: Any) -> Any:
        return position_energy_density(self.sources, self.susceptibility, self.saturation, rho, eta)

    def _lift(self, e: Any, eta: Any, pressure: Any, leg: Leg, pull_up: Any) -> Any:
        """(b_eta - P lambda^2)/N_1 at a pole, over lambda."""
        stress, _ = self.material.stress(e, e)
        _, b_eta = self.force(np.zeros_like(eta), eta)
        thickness, modulus = (1.0, 1.0) if self.uneven is None else self.uneven.factors(leg.start)
        b_eta = (b_eta - pull_up) / modulus
        pressure = leg.pushes * (pressure - over_projection(self.loads, eta)[1]) / (thickness * modulus)
        if self.sloped is not None:
            zero = np.zeros_like(eta)
            turned = pull(self.sloped, self.sources, zero, eta, 1 + zero, zero)
            return np.exp(e) * (b_eta + turned.eta - 2 * turned.along - pressure * np.exp(2 * e)) / (stress + turned.stiffness)
        return np.exp(e) * (b_eta - pressure * np.exp(2 * e)) / stress


@dataclass(frozen=True)
class Guess:
    """Where a method sets out from.

    Attributes
    ----------
    pressure, center_height : float
        P and the height of the pole, or of the first end, over R0.
    stretch : float
        lambda_1 > 0 there.
    profile : mapping of ndarray, optional
        Reference radii r with rho and eta there, and the places s along the meridian where these are not the radii; increasing, from the
        first end to the last. Collocation needs one, and so does shooting from two poles or from an end that is none.

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
            places = {name: mine[name] for name in ("r", "s") if name in mine}
            profile = {**places, **{n: mine[n] + factor * (mine[n] - other[n]) for n in ("rho", "eta")}}
        return Guess(along("pressure"), along("center_height"), along("stretch"), profile)


def states_of(guess: Guess, form: StrongForm) -> tuple[Array, Array]:
    """Places s from the first end to the last, and the unknowns there, from the profile of a guess.

    Raises
    ------
    InputError
        For a guess without a profile, and for one that is not that of this meridian.
    """
    if guess.profile is None:
        raise InputError("guess.profile", None, "missing; the method sets out from a profile with columns r, rho and eta")
    mesh, profile = form.scene.mesh, guess.profile
    s, rho, eta = (np.asarray(profile[name], dtype=float) for name in ("s" if "s" in profile else "r", "rho", "eta"))
    first, last = (float(end) for end in mesh.breakpoints()[[0, -1]])
    near = LEAST_LENGTH * max(abs(first), abs(last))
    if s.ndim == 1 and s.size > 2 and abs(s[0] - first) <= near and abs(s[-1] - last) <= near:
        s = np.array([first, *s[1:-1], last])  # computed ends are exact to round-off only
    if s.ndim != 1 or s.size < 3 or s[0] != first or s[-1] != last or not (np.diff(s) > 0).all() or not (s.shape == rho.shape == eta.shape):
        allowed = f"three or more increasing radii from {first:g} to {last:.6g} are allowed, with rho and eta at each"
        raise InputError("guess.profile", f"{s.size} radii", allowed if isinstance(mesh, Disc) else allowed.replace("radii", "places"))
    rho_s, eta_s = CubicSpline(s, rho)(s, 1), CubicSpline(s, eta)(s, 1)
    R = mesh.position(s)[0]
    poles = np.zeros(s.size, dtype=bool)
    poles[0], poles[-1] = form.legs[0].pole, len(form.legs) > 1
    l1 = np.hypot(rho_s, eta_s)
    l1[0] = guess.stretch if poles[0] else l1[0]
    l2 = np.where(poles, l1, rho / np.where(poles, 1.0, R))
    if not (l2 > 0).all():
        raise InputError("guess.profile", float(l2.min()), "radii rho > 0 away from the pole are allowed")
    phi = np.unwrap(np.arctan2(eta_s, rho_s))
    if form.legs[0].pole:
        phi[0] = 0.0
    d = np.where(poles, 0.0, np.log(l1 / l2))
    return s, np.array([np.log(l2), eta, d, phi])


def on_leg(leg: Leg, s: Array, y: Array) -> tuple[Array, Array]:
    """Distances from the beginning of a leg, and the unknowns along it, of states along the whole meridian."""
    x = leg.direction * (s - leg.start)
    order = np.argsort(x)
    keep = order[x[order] <= leg.length]
    inside, states = x[keep], y[:, keep].copy()
    if inside[-1] < leg.length:
        middle = np.array([np.interp(leg.length, x[order], row[order]) for row in y])
        inside, states = np.append(inside, leg.length), np.column_stack([states, middle])
    if leg.direction < 0:
        states[3] = states[3] - states[3, 0]  # turned round, and 0 at the pole
    return inside, states


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
    mesh : Meridian
        The shape at rest.
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
    mesh: Meridian = field(default=Disc(elements=1), repr=False)
    _at: Callable[[Array], Array] | None = field(default=None, repr=False)

    def profile(self, r: ArrayLike | None = None) -> dict[str, Array]:
        """The deformed meridian at places along the reference meridian, 101 of them by default: r, rho, eta, stretch_1, stretch_2, and s
        where that is not the reference radius r.

        Parameters
        ----------
        r : ndarray, shape (n,), optional
            Reference radii of a flat shape, else arc lengths from the first end, over R0.

        Raises
        ------
        InputError
            For places outside the membrane, or when nothing was found.
        """
        first, last = (float(s) for s in self.mesh.breakpoints()[[0, -1]])
        at = np.linspace(first, last, 101) if r is None else np.atleast_1d(np.asarray(r, dtype=float))
        if not ((at >= first) & (at <= last)).all():
            raise InputError("r", r, f"reference radii in [{first:g}, {last:.6g}] are allowed, or arc lengths of a shape that is not flat")
        if self._at is None:
            raise InputError("profile", self.method, f"nothing was found: {self.message}")
        e2, eta, d, _ = self._at(at)
        R = self.mesh.position(at)[0]
        along = {} if np.array_equal(R, at) else {"s": at}
        return {"r": R, **along, "rho": np.exp(e2) * R, "eta": eta, "stretch_1": np.exp(e2 + d), "stretch_2": np.exp(e2)}


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

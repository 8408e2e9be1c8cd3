"""Shapes that enclose a volume: where the search for a first equilibrium begins, and no more than that."""

from __future__ import annotations

import numpy as np

from ..discretization.meridian import Disc
from ..discretization.space import Space
from ..potential import Array, Potential

#: the guess falls off to a support within this arc length, in units of the membrane's own size
_EDGE = 1.5


def guess_at_volume(potential: Potential, volume: float) -> Array:
    """Coefficients of a smooth shape that respects the supports and encloses a volume."""
    if isinstance(potential.space.mesh, Disc):
        return spherical_dome(potential, volume)
    direction = _direction(potential.space, volume)
    amplitudes = np.array([-1.0, 0.0, 1.0, 2.0])
    # the volume is a cubic in the amplitude: so through four values exactly
    volumes = np.array([potential.evaluate(a * direction, 0.0).volume for a in amplitudes])
    cubic = np.linalg.solve(np.vander(amplitudes), volumes)
    cubic[np.abs(cubic) < 1e-14 * np.abs(cubic).max()] = 0.0
    cubic[-1] = potential.space.reference_volume - volume
    roots = np.roots(cubic)
    real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots)].real
    return float(real[np.argmin(np.abs(real))]) * direction if real.size else direction


def _direction(space: Space, volume: float) -> Array:
    """Displacement along which the shape changes its volume. A shape without edges grows as it is, so that it crosses the axis nowhere."""
    if not space.edges and volume * space.reference_volume > 0:
        return space.interpolate(*space.mesh.position(space.interpolation_points()))
    return space.unit * _normal(space)


def _normal(space: Space) -> Array:
    """Coefficients of the unit normal of the reference meridian, falling off to ends that hold a component of it."""
    s = space.interpolation_points()
    R_s, Z_s = space.mesh.tangent(s)
    J = np.hypot(R_s, Z_s)
    n_u, n_w = -Z_s / J, R_s / J
    length = np.concatenate([[0.0], np.cumsum(space.lengths)])
    along = length[:-1] + (s - space.ends[:-1]) / space.sizes * space.lengths
    held = [
        ("u" in support.held and abs(n_u[place]) > 1e-9) or ("w" in support.held and abs(n_w[place]) > 1e-9)
        for support, place in zip(space.supports, ((0, 0), (-1, -1)), strict=False)
    ]
    edge = min(_EDGE * space.unit, length[-1] / max(sum(held), 1))
    factor = np.ones_like(s)
    for is_held, distance_ in zip(held, (along, length[-1] - along), strict=False):
        if is_held:
            factor = factor * (1 - (1 - np.minimum(1.0, distance_ / edge)) ** 2)
    return space.interpolate(factor * n_u, factor * n_w)


def spherical_dome(potential: Potential, volume: float) -> Array:
    """Coefficients of a spherical cap over the rim that encloses a volume, material points at equal angles; of a rim of radius 1, to
    which others are similar.

    The height H solves pi H (H^2 + 3)/6 = V: with H = 2 sinh t this is sinh 3t = 3 V/pi, exact down to the smallest volumes.
    """
    space = potential.space
    s = space.interpolation_points()
    rim = 1.0 if space.lift is None else 1 + space.lift.radial[1]
    height = 2 * np.sinh(np.arcsinh(volume / rim**3 * (3 / np.pi)) / 3)
    if height == 0:
        return np.zeros(space.n_free)
    radius = (1 + height**2) / (2 * height)
    angle = 2 * np.arctan(height)
    u = radius * (_sine_excess(angle * s) - s * _sine_excess(np.asarray(angle)))  # radius sin(angle s) - s, for radius sin(angle) = 1
    eta = 2 * radius * np.sin(angle * (1 + s) / 2) * np.sin(angle * (1 - s) / 2)
    return space.interpolate(rim * u, rim * eta)


def _sine_excess(x: Array) -> Array:
    """sin x - x without cancellation: the radial displacement of a nearly flat dome is far below round-off of its radius."""
    square = x**2
    series = -x * square / 6 * (1 - square / 20 * (1 - square / 42 * (1 - square / 72)))
    return np.where(square < 0.1, series, np.sin(x) - x)

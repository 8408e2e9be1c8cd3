"""Deformed meridians in a plane through the axis, and what they stand in: clamped ends and magnetic sources."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..quantities import SCALED, Units, axis_label
from .figures import RED, Style
from .surroundings import Box, clamped_ends, named, surroundings
from .vtk import smooth_profile
from .zones import draw_meridian_zones

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results.equilibrium import Equilibrium

#: points of a drawn meridian
_CURVE = 201


def draw_profile(axes: Axes, equilibrium: Equilibrium, style: Style, *, zones: bool | None = None, units: Units = SCALED) -> None:
    """The deformed meridian, both halves, and rigid hubs, under the style's label.

    With the wrinkled zones, by default when the scene asks for them.
    """
    if equilibrium.scene.analysis.wrinkling if zones is None else zones:
        draw_meridian_zones(axes, equilibrium, units.factor("rho"))
    profile = smooth_profile(equilibrium, points=_CURVE)
    rho, eta = (units.factor(name) * profile[name] for name in ("rho", "eta"))
    look = {"linestyle": style.dashes, "color": style.color, "linewidth": style.width, "dash_capstyle": "butt"}
    cut = [np.nan] if rho[0] > 0 else []  # the halves meet on the axis only
    axes.plot(np.concatenate([-rho[::-1], cut, rho]), np.concatenate([eta[::-1], cut, eta]), label=style.label or None, **look)
    for k in equilibrium.potential.space.hubs:
        axes.plot([-rho[k], rho[k]], [eta[k], eta[k]], color=style.color, linewidth=3 * style.width, solid_capstyle="butt", alpha=0.5)


def draw_surroundings(axes: Axes, shown: Sequence[Equilibrium], units: Units = SCALED) -> None:
    """What drawn meridians stand in: labelled axes of equal scale, the clamped ends, and the magnetic sources of their scene."""
    axes.set_xlabel(axis_label("rho", units))
    axes.set_ylabel(axis_label("eta", units))
    axes.set_aspect("equal", adjustable="box")
    axes.locator_params(axis="x", nbins=6)  # heights have as many as there is room for beside a flat shape
    length = units.factor("rho")
    for rho, eta in ((length * rho, length * eta) for _, rho, eta in clamped_ends(shown[0])):
        axes.axhline(eta, color="0.8", linewidth=0.8, zorder=0)
        axes.plot([-rho, rho], [eta, eta], "s", color="black", markersize=5, zorder=5)
    _draw_sources(axes, shown, units)


def _draw_sources(axes: Axes, shown: Sequence[Equilibrium], units: Units) -> None:
    """Bodies of sources, with an arrow along the moment; one that is not drawn is named."""
    length = units.factor("eta")
    box = Box.of([e.profile() for e in shown])
    around = surroundings(shown[0].scene, box)
    for body in around.near:
        rho, z = length * np.array(body.points).T
        middle = float(z.mean())
        if body.moment:
            tail, tip = (middle + sign * 0.11 * body.moment * box.size * length for sign in (-1, 1))
            arrow = {"arrowstyle": "-|>", "color": RED, "linewidth": 2.0, "mutation_scale": 14}
            axes.annotate("", xy=(0, tip), xytext=(0, tail), arrowprops=arrow)
            axes.update_datalim([(0, tail), (0, tip)])
        point: dict[str, Any] = {"marker": "o", "markersize": 6} if rho.size == 1 else {}
        look: dict[str, Any] = {"color": "0.45" if body.rigid else RED, "linewidth": 2.5, **point}
        for side in (1, -1) if rho.any() else (1,):
            axes.plot(side * rho, z, label=named(body.label, units) if side > 0 and body.label else None, **look)
    for name in around.absent:
        axes.plot([], [], " ", label=f"({named(name, units)})")

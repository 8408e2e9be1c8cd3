"""How wrinkling zones are drawn: in patterns, not colours, that say which way the wrinkles run. Along a curve a pattern is a light band
behind the line, whose edges differ. In a filled region it is a hatch, with the pole at the bottom::

    radial             thin rails along the curve      strokes from the pole to the rim
    circumferential    short teeth across the curve    strokes along circles
    double             wide bars along the curve       both
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium
    from ..results.zones import Zones
    from ..scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pattern:
    """How a kind of zones is drawn and named.

    Attributes
    ----------
    name, compressed : str
        What it is, and the stresses that are negative there.
    core : float
        Part of the width of a band that is light.
    ink, fill : str
        Grey of the edges of a band, and of a filled region.
    dashes : line style of Matplotlib
        Of the edges of a band.
    hatch : str
    """

    name: str
    compressed: str = ""
    core: float = 0.0
    ink: str = "0.35"
    dashes: Any = "-"
    fill: str = "1.0"
    hatch: str = ""


PATTERNS = {
    "taut": Pattern("taut"),
    "radial": Pattern("radial wrinkles", "s22", core=0.84, fill="0.92", hatch="||"),
    "circumferential": Pattern("circumferential wrinkles", "s11", core=0.5, dashes=(0, (0.12, 0.3)), fill="0.92", hatch="--"),
    "double": Pattern("double wrinkles", "s11, s22", core=0.55, ink="0.5", fill="0.75", hatch="+++"),
}
#: grey of a band behind the line
_CORE = "0.94"
#: widths in points of a pattern along a meridian and along a branch, where it must show beside the band of azimuthal instability
MERIDIAN_WIDTH, BRANCH_WIDTH = 8.0, 12.0
#: points of a drawn zone of a meridian
_POINTS = 101


def zone_label(scene: Scene, kind: str) -> str:
    """Name of a kind of zones with what decides, for a legend."""
    pattern, criterion = PATTERNS[kind], scene.analysis.zone_criterion
    if kind == "taut":
        return pattern.name
    why = f"{criterion} {pattern.compressed} < 0"
    if scene.tension_field and criterion == "mechanical":  # where no stress is ever negative
        why = "slack" if kind == "double" else "no tension across"
    return f"{pattern.name} ({why})"


def zone_order(label: str) -> int:
    """Place of a label among the labels of the kinds of zones. Any other label comes after all of them."""
    return next((k for k, pattern in enumerate(PATTERNS.values()) if label.startswith(pattern.name)), len(PATTERNS))


def new_label(axes: Axes, label: str) -> str | None:
    """A label, unless the legend has it already."""
    return label if label and label not in axes.get_legend_handles_labels()[1] else None


def draw_along(axes: Axes, line: Array, kind: str, label: str, width: float) -> None:
    """The pattern of a kind of zones behind a curve, shape (n, 2)."""
    from matplotlib.patheffects import Stroke

    pattern = PATTERNS[kind]
    solid = {"dash_offset": 0, "dash_list": None}
    effects = [Stroke(linewidth=width), Stroke(linewidth=pattern.core * width, foreground=_CORE, dashes=solid)]
    look: dict[str, Any] = {"linestyle": pattern.dashes, "solid_capstyle": "butt", "dash_capstyle": "butt", "zorder": 0.5}
    axes.plot(*line.T, color=pattern.ink, linewidth=width, path_effects=effects, label=new_label(axes, label), **look)


def draw_meridian_zones(axes: Axes, equilibrium: Equilibrium) -> None:
    """The patterns of the wrinkled zones along both halves of a deformed meridian."""
    wrinkled = [zone for zone in equilibrium.zones() if zone.kind != "taut"]
    for zone in sorted(wrinkled, key=lambda zone: list(PATTERNS).index(zone.kind)):  # where bands run into each other, the worst on top
        profile = equilibrium.profile(np.linspace(*zone.s, _POINTS))
        half = np.stack([profile["rho"], profile["eta"]], axis=1)
        mirrored = half * (-1, 1)
        for line in [np.concatenate([mirrored[::-1], half])] if zone.rho[0] == 0 else [half, mirrored]:
            draw_along(axes, line, zone.kind, zone_label(equilibrium.scene, zone.kind), MERIDIAN_WIDTH)


def shown_kinds(zones: Zones) -> tuple[str, ...]:
    """The kinds of wrinkles that mark an equilibrium of a branch: where some are double, these alone."""
    return ("double",) if "double" in zones.kinds else tuple(kind for kind in ("radial", "circumferential") if kind in zones.kinds)


def fill_zones(axes: Axes, branch: Branch, across: Array) -> list[Patch]:
    """The zones of a branch as filled regions, the parameter of the meridian (of a flat one: the reference radius) upwards.

    Borders go straight from one equilibrium to the next. Where the kinds of zones change, states between are interpolated; a snap has no
    states between.

    Parameters
    ----------
    across : ndarray, shape (len(branch),)
        Place of each equilibrium along the other axis, monotone.

    Returns
    -------
    list of Patch
        For a legend, with labels: each kind that there is.
    """
    from matplotlib.patches import Patch

    along = branch.zones_along()
    places_of_all = np.interp(along.steps, np.arange(len(branch)), across)
    for places, part in _runs(places_of_all, along.zones, along.snaps):
        edges = np.array([[part[0][0].s[0], *(zone.s[1] for zone in z)] for z in part])
        edges = np.concatenate([edges[:1], edges, edges[-1:]])
        for k, kind in enumerate(part[0].kinds):
            look: dict[str, Any] = {"facecolor": PATTERNS[kind].fill, "hatch": PATTERNS[kind].hatch, "edgecolor": "0.3", "lw": 0.0}
            axes.fill_between(places, edges[:, k], edges[:, k + 1], antialiased=False, **look)
        for border in edges.T[1:-1]:
            axes.plot(places, border, color="black", linewidth=1.4)
    found = [kind for kind in PATTERNS if any(kind in equilibrium.zones().kinds for equilibrium in branch)]
    return [
        Patch(facecolor=PATTERNS[k].fill, hatch=PATTERNS[k].hatch, edgecolor="0.3", linewidth=0.8, label=zone_label(branch.scene, k))
        for k in found
    ]


def _runs(x: Array, zones: Sequence[Zones], snaps: frozenset[int]) -> Iterator[tuple[Array, list[Zones]]]:
    """Stretches with the same kinds of zones and no snap, and their places, extended half-way to the stretches before and after."""
    half = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, x[-1:]])
    if x.size == 1:
        half += (-0.5, 0.5)
    starts = [0, *(k for k in range(1, len(zones)) if k in snaps or zones[k].kinds != zones[k - 1].kinds), len(zones)]
    for a, b in pairwise(starts):
        yield np.concatenate([half[a : a + 1], x[a:b], half[b : b + 1]]), list(zones[a:b])

"""The membrane in space, drawn without a display: a coloured surface, its circles, the sources around it, and where to look from.

Colours come from maps whose lightness only rises, so that they are ordered in grey as well.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..files import replace_file
from ..quantities import in_si, quantity
from ..results.zones import KINDS
from .backend import load
from .surroundings import Box, Surroundings, surroundings
from .vtk import FIELDS, SECTORS, Revolution, smooth_profile

if TYPE_CHECKING:
    import pyvista

    from ..physics.outline import Outline
    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium
    from ..scene import Scene

Array = NDArray[np.float64]

#: pixels of a frame along each side of one that is shown
FINER = 2
#: points along a drawn meridian with fewer nodes
_POINTS = 101
_MAP = "viridis"
_SOURCE = "#b03060"
#: little shading, so that the colours stay those of the scale
_MATT: dict[str, Any] = {"ambient": 0.35, "diffuse": 0.65, "specular": 0.1}
#: the number of each kind of zones, in the middle of its colour, and its name beside it
_ZONE_LIMITS = (-0.5, len(KINDS) - 0.5)
_ZONE_NAMES = ("taut", "radial", "circum-\nferential", "both\nways")
#: directions in which the outline of a body reaches farthest
_ROUND = ((1, 0), (-1, 0), (0, 1), (0, -1))
#: nothing is rendered before all is there
_STILL: dict[str, Any] = {"reset_camera": False, "render": False}
#: height in pixels of a picture whose text has its plain size
_PLAIN = 900


def render(
    shown: Branch | Equilibrium, path: str | PathLike[str], *, quantity: str = "stretch_2", size: tuple[int, int] = (1200, 900)
) -> None:
    """Draw an equilibrium (of a branch: the last one) as a coloured surface, without a display.

    Parameters
    ----------
    shown : Branch or Equilibrium
    path : path
        PNG file to write.
    quantity : str
        What the colour shows: one of :data:`~femmembrane.views.vtk.FIELDS` (those in SI units only when the scene has scales), or "zone".
    size : tuple of int
        Width and height of the picture in pixels.

    Raises
    ------
    InputError
        For an empty branch, an unknown quantity, or a file that cannot be written.
    """
    surface = Surface.of(_one(shown), quantity)
    with replace_file(path) as temporary, new_plotter(size) as plotter:
        drawn = [*draw_surroundings(plotter, surface.equilibrium.scene, surface.box), surface.points]
        draw_surface(plotter, surface, surface.range, surface.box.size)
        draw_key(plotter, surface, surface.range)
        aim(plotter, np.concatenate(drawn))
        plotter.screenshot(str(temporary))


@dataclass(frozen=True, eq=False)
class Surface:
    """An equilibrium as a surface of revolution with the values that its colour shows.

    Attributes
    ----------
    equilibrium : Equilibrium
    quantity : str
    rho, eta : ndarray, shape (n_nodes,)
        The drawn meridian.
    revolution : Revolution
    values : ndarray
        Of a quantity at the nodes; of "zone" between them: places in :data:`~femmembrane.results.zones.KINDS`.
    """

    equilibrium: Equilibrium
    quantity: str
    rho: Array
    eta: Array
    revolution: Revolution
    values: Array

    @classmethod
    def of(cls, equilibrium: Equilibrium, quantity: str, sectors: int = 4 * SECTORS, most: int | None = None) -> Surface:
        """The surface of an equilibrium, with at most so many points along its meridian.

        Raises
        ------
        InputError
            For an unknown quantity.
        """
        check_quantity(quantity, equilibrium.scene)
        if quantity == "zone":
            zones, ends = equilibrium.zones(), equilibrium.potential.space.ends
            s = np.unique(np.concatenate([np.linspace(ends[0], ends[-1], _POINTS), [zone.s[1] for zone in zones]]))
            profile, values = equilibrium.profile(s), zones.numbers((s[1:] + s[:-1]) / 2).astype(np.float64)
        else:
            profile = smooth_profile(equilibrium, points=min(_POINTS, most or _POINTS), most=most)
            values = profile[quantity]
        return cls(
            equilibrium,
            quantity,
            profile["rho"],
            profile["eta"],
            Revolution.of_membrane(equilibrium, profile["r"], sectors),
            values,
        )

    @property
    def points(self) -> Array:
        """Positions, shape (n_points, 3)."""
        return self.revolution.vectors(self.rho, self.eta)

    @property
    def scalars(self) -> Array:
        """Values at the points."""
        return self.revolution.scalars(self.values)

    @property
    def circles(self) -> list[tuple[int, float]]:
        """Nodes whose circles are drawn, with their thickness."""
        return circles(self.rho, self.eta, [end % self.rho.size for end in self.equilibrium.potential.space.edges])

    @property
    def normals(self) -> Array:
        """Normals of the deformed surface at the points, shape (n_points, 3)."""
        along = np.stack([np.gradient(self.rho), np.gradient(self.eta)])
        along /= np.maximum(np.linalg.norm(along, axis=0), 1e-300)
        found = self.revolution.vectors(-along[1], along[0])
        on_axis = np.abs(self.rho) <= 1e-12 * np.abs(self.rho).max()
        found[on_axis[self.revolution.node]] = (0.0, 0.0, 1.0)
        return found

    @property
    def box(self) -> Box:
        return Box.of([{"rho": self.rho, "eta": self.eta}])

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest value, apart by as much as is worth a colour."""
        low, high = float(self.values.min()), float(self.values.max())
        spare = max(0.005 * max(abs(low), abs(high)) - (high - low) / 2, 0.0)
        return low - spare, high + spare


def check_quantity(quantity: str, scene: Scene, key: str = "quantity") -> None:
    """Raise InputError unless a colour can show the quantity."""
    known = [name for name in FIELDS if _has(scene, name)]
    if not isinstance(quantity, str) or quantity not in (*known, "zone"):
        raise unknown_name(key, str(quantity), (*known, "zone"))


def _has(scene: Scene, name: str) -> bool:
    """Whether the profiles of a scene have one of :data:`.FIELDS`."""
    plain = next((of for of in FIELDS if quantity(of).si and in_si(of) == name), "")
    if "electric_field" in (name, plain) and scene.electric is None:
        return False
    return not plain or (scene.converter is not None and scene.converter.converts(quantity(plain).si))


@contextmanager
def new_plotter(size: tuple[int, int], off_screen: bool = True, *, frames: bool = False) -> Iterator[pyvista.Plotter]:
    """A white picture that is closed at the end.

    For frames of a movie it is :data:`FINER` times as large, and :func:`frame` takes the mean of its pixels: without a graphics card that
    is four times as fast as the samples that VTK takes to smooth edges.
    """
    load()  # for its colour maps
    import pyvista

    with pyvista.vtk_verbosity("off"):  # VTK reports a missing display before it does without
        plotter = pyvista.Plotter(off_screen=off_screen, window_size=[FINER * length for length in size] if frames else list(size))
        try:
            plotter.set_background("white")
            if frames:
                plotter.render_window.SetMultiSamples(0)
            else:
                plotter.enable_anti_aliasing("ssaa")
            yield plotter
        finally:
            plotter.close()


def frame(plotter: pyvista.Plotter) -> NDArray[np.uint8]:
    """The picture of a plotter for frames, shape (height, width, 3)."""
    from PIL import Image

    plotter.render()
    fine = np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)[..., :3]
    return np.asarray(Image.fromarray(fine).reduce(FINER))


def draw_surface(plotter: pyvista.Plotter, surface: Surface, limits: tuple[float, float], size: float) -> None:
    """Draw a surface, its ends, hubs and a few circles. Colours span the limits; lines are as thick as suits a membrane of the size."""
    DrawnMembrane(plotter, limits, size).show(surface)


class DrawnMembrane:
    """A membrane in a picture: one surface after the other, each in place of the one before.

    Surfaces with as many points share their cells, which are built once: of a movie only points, colours and normals change.

    Parameters
    ----------
    plotter : pyvista.Plotter
    limits : (float, float)
        Of the colours.
    size : float
        Of the membranes, to which the lines are fitted.
    """

    def __init__(self, plotter: pyvista.Plotter, limits: tuple[float, float], size: float) -> None:
        self._plotter, self._limits, self._size = plotter, limits, size
        self._mesh: Any = None
        self._lines: Any = None

    def show(self, surface: Surface) -> None:
        """Draw a surface, its ends, hubs and a few circles."""
        points, revolution = surface.points, surface.revolution
        if self._mesh is None or surface.quantity == "zone" or self._mesh.n_points != len(points):
            self._mesh = polydata(revolution, points)
            self._color(surface)
            actor = self._plotter.add_mesh(self._mesh, name="membrane", show_scalar_bar=False, **self._scale(surface), **_STILL, **_MATT)
            actor.prop.interpolation = "Gouraud"
        else:
            self._mesh.points = points
            self._color(surface)
        self._draw_circles(surface)
        for k in surface.equilibrium.potential.space.hubs:
            self._draw_hub(f"hub {k}", float(surface.rho[k]), float(surface.eta[k]))

    def _color(self, surface: Surface) -> None:
        revolution = surface.revolution
        self._mesh.point_data.active_normals = surface.normals
        if surface.quantity == "zone":
            first = np.concatenate([revolution.node[cells].min(axis=1) for cells in (revolution.triangles, revolution.quads)])
            self._mesh.cell_data["zone"] = surface.values[first]
        else:
            self._mesh.point_data[surface.quantity] = surface.scalars

    def _scale(self, surface: Surface) -> dict[str, Any]:
        if surface.quantity == "zone":
            return {"scalars": "zone", "clim": _ZONE_LIMITS, "cmap": list(zone_colors()), "preference": "cell"}
        return {"scalars": surface.quantity, "clim": self._limits, "cmap": _MAP}

    def _draw_circles(self, surface: Surface) -> None:
        import pyvista

        shown = surface.circles
        points = _rings(np.array([(surface.rho[node], surface.eta[node], radius * self._size) for node, radius in shown]).reshape(-1, 3))
        if self._lines is not None and self._lines.n_points == len(points):
            self._lines.points = points
        elif len(points):
            self._lines = pyvista.PolyData(points, faces=_ring_faces(len(shown)))
            self._plotter.add_mesh(self._lines, color="black", ambient=1.0, diffuse=0.0, name="circles", **_STILL)

    def _draw_hub(self, name: str, radius: float, height: float) -> None:
        import pyvista

        disc = pyvista.Disc(center=(0.0, 0.0, height), inner=0.0, outer=radius, normal=(0, 0, 1), c_res=4 * SECTORS)
        self._plotter.add_mesh(disc, color="#9a9a9a", ambient=0.4, diffuse=0.6, name=name, **_STILL)


#: sides of a thick line, and pieces of a circle
_SIDES, _PIECES = 6, 2 * SECTORS


def _rings(shown: Array) -> Array:
    """Points on thick circles about the axis, whose radius, height and thickness stand in the rows."""
    turn, side = 2 * np.pi * np.arange(_PIECES) / _PIECES, 2 * np.pi * np.arange(_SIDES) / _SIDES
    radius, height, thick = (column[:, None, None] for column in shown.T)
    rho, z = radius + thick * np.cos(side), height + thick * np.sin(side) + 0 * turn[:, None]
    x, y = rho * np.cos(turn)[:, None], rho * np.sin(turn)[:, None]
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def _ring_faces(count: int) -> NDArray[np.int64]:
    """The sides of so many thick circles, as four points each."""
    ring, turn, side = np.ogrid[:count, :_PIECES, :_SIDES]

    def number(turn: NDArray[np.int64], side: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.asarray((ring * _PIECES + turn % _PIECES) * _SIDES + side % _SIDES)

    corners = [number(turn, side), number(turn + 1, side), number(turn + 1, side + 1), number(turn, side + 1)]
    return np.stack([np.full_like(corners[0], 4), *corners], axis=-1).ravel()


def circles(rho: Array, eta: Array, ends: Sequence[int], count: int = 6) -> list[tuple[int, float]]:
    """Nodes whose circles are drawn, with their thickness: ends off the axis, and a few at equal distances along the meridian."""
    if (rho[0], eta[0]) == (rho[-1], eta[-1]) and rho[0] > 0:  # the last node of a closed meridian is the first
        rho, eta = rho[:-1], eta[:-1]
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(rho), np.diff(eta)))])
    shown = np.searchsorted(length, length[-1] * np.arange(count + 1) / count).clip(max=rho.size - 1)
    thin = [int(node) for node in np.unique(shown) if rho[node] > 1e-9 and node not in ends]
    return [*((node, 0.0015) for node in thin), *((node, 0.005) for node in ends)]


def draw_key(plotter: pyvista.Plotter, surface: Surface, limits: tuple[float, float]) -> None:
    """The scale of the colours with name and unit, or the kinds of zones."""
    import pyvista

    scale, zones = plotter.window_size[1] / _PLAIN, surface.quantity == "zone"
    if zones:
        table = pyvista.LookupTable(list(zone_colors()), n_values=len(KINDS), scalar_range=_ZONE_LIMITS)
        table.annotations = dict(enumerate(_ZONE_NAMES))
        criterion = surface.equilibrium.scene.analysis.zone_criterion
        title = f"wrinkles by {criterion} stress"
    else:
        table = pyvista.LookupTable(_MAP, scalar_range=limits)
        shown = quantity(surface.quantity)
        title = shown.meaning if shown.unit == "1" else f"{shown.meaning} in {shown.unit}"
    mapper = pyvista.DataSetMapper()
    mapper.lookup_table, mapper.scalar_range = table, table.scalar_range
    plotter.add_scalar_bar(
        "\n".join(textwrap.wrap(title, 16)) + "\n",
        mapper=mapper,
        render=False,
        vertical=True,
        n_labels=0 if zones else 5,
        fmt=f"%.{_digits(limits)}g",
        color="black",
        title_font_size=round(22 * scale),
        label_font_size=round(20 * scale),
        height=0.55,
        width=0.07,
        position_x=0.9 if zones else 0.85,  # its names stand on the left
        position_y=0.15,
    )


def _digits(limits: tuple[float, float]) -> int:
    """Significant digits that tell the numbers at a scale apart: three, or more where the range is small beside the values."""
    size, span = max(map(abs, limits)), limits[1] - limits[0]
    return 3 if not 0 < span < size else int(np.clip(np.ceil(np.log10(size / span)) + 2, 3, 8))


def zone_colors() -> tuple[str, ...]:
    """One colour a kind of zones, from light to dark."""
    load()
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return tuple(to_hex(colormaps[_MAP](0.95 - 0.3 * k)) for k in range(len(KINDS)))


def draw_surroundings(plotter: pyvista.Plotter, scene: Scene, box: Box) -> list[Array]:
    """The bodies of sources with arrows along their moments, and a line of text for each that is not drawn; the points of the bodies."""
    around, drawn = surroundings(scene, box), []
    for part, look in _bodies(around, box):
        plotter.add_mesh(part, **look)
        drawn.append(np.asarray(part.points))
    if around.absent:
        corner = tuple(0.03 * length for length in plotter.window_size)
        text = "\n".join(f"{name} not shown" for name in around.absent)
        plotter.add_text(text, position=corner, font_size=10 * plotter.window_size[1] / _PLAIN, color="black", render=False)
    return drawn


def _bodies(around: Surroundings, box: Box) -> Iterator[tuple[Any, dict[str, Any]]]:
    """The parts of bodies with their looks."""
    for body in around.near:
        look: dict[str, Any] = {"color": "#999999", "opacity": 0.25} if body.rigid else {"color": _SOURCE}
        for part in _parts(body, 0.1 * box.size):
            yield part, look | _STILL | {"smooth_shading": True, "ambient": 0.3}


class MovingBodies:
    """Bodies of scenes one after the other in one picture, such as a magnet that comes and goes.

    Parameters
    ----------
    plotter : Plotter
        In which the bodies of the first scene are not drawn yet.
    scenes : sequence of Scene
    box : Box
    """

    def __init__(self, plotter: pyvista.Plotter, scenes: Sequence[Scene], box: Box) -> None:
        self._plotter, self._box = plotter, box
        self._actors: list[Any] = []
        self._shown: Any = None
        self.points = [
            np.array([[x * rho, y * rho, z] for body in surroundings(scene, box).near for rho, z in body.points for x, y in _ROUND])
            for scene in scenes
        ]

    def show(self, scene: Scene) -> None:
        """The bodies of a scene, in place of those before."""
        if (scene.sources, scene.obstacles) == self._shown:
            return
        for actor in self._actors:
            self._plotter.remove_actor(actor, render=False)
        parts = _bodies(surroundings(scene, self._box), self._box)
        self._actors = [self._plotter.add_mesh(part, **look) for part, look in parts]
        self._shown = scene.sources, scene.obstacles


def _parts(body: Outline, size: float) -> list[Any]:
    """Meshes of a body turned about the axis: a ball, a ring, a rod or a surface, and the arrow of its moment."""
    import pyvista

    rho, z = np.array(body.points).T
    parts: list[Any] = []
    if rho.size == 1 and rho[0] == 0:
        parts.append(pyvista.Sphere(radius=0.3 * size, center=(0, 0, z[0])))
    elif rho.size == 1:
        turn = 2 * np.pi * np.arange(4 * SECTORS) / (4 * SECTORS)
        ring = np.stack([rho[0] * np.cos(turn), rho[0] * np.sin(turn), np.full_like(turn, z[0])], axis=1)
        parts.append(pyvista.lines_from_points(ring, close=True).tube(radius=0.15 * size))
    elif not rho.any():
        parts.append(pyvista.lines_from_points(np.stack([0 * z, 0 * z, z], axis=1)).tube(radius=0.1 * size))
    else:
        revolution = Revolution.of(rho, sectors=4 * SECTORS)
        parts.append(polydata(revolution, revolution.vectors(rho, z)))
    if body.moment:
        start = (0.0, 0.0, float(z.mean()) - 1.2 * body.moment * size)
        look = {"tip_length": 0.3, "tip_radius": 0.12, "shaft_radius": 0.045}
        parts.append(pyvista.Arrow(start=start, direction=(0, 0, body.moment), scale=2.4 * size, **look))
    return parts


def polydata(revolution: Revolution, points: Array) -> pyvista.PolyData:
    """A surface with its triangles first."""
    import pyvista

    faces = [np.insert(cells, 0, cells.shape[1], axis=1).ravel() for cells in (revolution.triangles, revolution.quads)]
    return pyvista.PolyData(points, faces=np.concatenate(faces))


def aim(plotter: pyvista.Plotter, points: Array, *, margin: float = 0.08, bar: float = 0.18, words: float = 0.0) -> None:
    """Look from the front and a little from above, so that the points fill what words at the top and the colour scale leave."""
    toward = np.array([0.3, -1.0, 0.45])
    toward /= np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    x, y, depth = points @ right, points @ up, np.ptp(points @ toward) + 1.0
    aspect = plotter.window_size[0] / plotter.window_size[1]
    # height of the picture in units of the scene
    height = max(np.ptp(y), np.ptp(x) / (aspect * (1 - bar))) / (1 - 2 * margin - words)
    centre = (x.min() + x.max()) / 2 * right + (y.min() + y.max()) / 2 * up + (points @ toward).mean() * toward
    centre = centre + bar / 2 * aspect * height * right + words / 2 * height * up
    plotter.enable_parallel_projection()
    plotter.camera.focal_point, plotter.camera.up = tuple(centre), tuple(up)
    plotter.camera.position = tuple(centre + 10 * depth * toward)
    plotter.camera.parallel_scale = height / 2
    plotter.renderer.ResetCameraClippingRange()


def _one(shown: Branch | Equilibrium) -> Equilibrium:
    if not isinstance(shown, Sequence):
        return shown
    if not len(shown):
        raise InputError("branch", "no equilibria", "a branch with one or more equilibria is needed")
    return shown[-1]

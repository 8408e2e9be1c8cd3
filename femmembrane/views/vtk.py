"""The deformed membrane as a surface of revolution: VTU files for ParaView, and rendered pictures.

A meridian of n nodes is turned about the axis in equal sectors. Points are numbered ring by ring, a node on the axis being one point::

              o  pole (one point)          triangles around the pole, quadrilaterals elsewhere; their normals point
             /|\\                           the way the pressure pushes (up where the membrane is flat)
            o-o-o  ring of node 1
           /  |  \\                         line: the meridian itself, at angle 0
          o---o---o  ring of node 2
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..results.store import MEANING, replace_file

if TYPE_CHECKING:
    import pyvista

    from ..results.records import Branch, Equilibrium

Array = NDArray[np.float64]
_Number = TypeVar("_Number", np.float64, np.int32)

#: profile quantities that a file shows as point data, in this order; those in Pa when the scene has scales
FIELDS = (
    "stretch_1",
    "stretch_2",
    "mechanical_stress_1",
    "mechanical_stress_2",
    "total_stress_1",
    "total_stress_2",
    "mechanical_stress_1_pa",
    "mechanical_stress_2_pa",
    "total_stress_1_pa",
    "total_stress_2_pa",
)
SECTORS = 48
#: a source further from the membrane than this many times its size would leave the membrane a speck in the picture
_FAR = 1.5


@dataclass(frozen=True)
class Revolution:
    """How a meridian becomes a surface.

    Attributes
    ----------
    node : ndarray of int, shape (n_points,)
        Node of the meridian that each point comes from.
    cosine, sine : ndarray, shape (n_points,)
        Of the angle of each point.
    triangles, quads, line : ndarray of int32, shape (n_cells, 3), (n_cells, 4), (n_cells, 2)
    """

    node: NDArray[np.int64]
    cosine: Array
    sine: Array
    triangles: NDArray[np.int32]
    quads: NDArray[np.int32]
    line: NDArray[np.int32]

    @classmethod
    def of(cls, r: Array, sectors: int = SECTORS, closed: bool = False) -> Revolution:
        """Revolve nodes at the reference radii r; a node with r = 0 lies on the axis, and the last one of a closed curve is the first."""
        copies = np.where(r > 0, sectors, 1)
        if closed:
            copies[-1] = 0
        first = np.cumsum(copies) - copies
        turn = np.arange(sectors)
        point = first[:, None] + np.where(copies[:, None] == 1, 0, turn)
        if closed:
            point[-1] = point[0]
        a, b = point[:-1], point[1:]
        cells = np.stack([a, b, np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)], axis=2).reshape(-1, 4).astype(np.int32)
        inner, outer = cells[:, 0] == cells[:, 3], cells[:, 1] == cells[:, 2]
        angle = 2 * np.pi * np.concatenate([turn[:n] for n in copies]) / sectors
        return cls(
            node=np.repeat(np.arange(r.size), copies),
            cosine=np.cos(angle),
            sine=np.sin(angle),
            triangles=np.concatenate([cells[inner & ~outer][:, :3], cells[outer & ~inner][:, [0, 1, 3]]]),
            quads=cells[~inner & ~outer],
            line=np.stack([point[:-1, 0], point[1:, 0]], axis=1).astype(np.int32),
        )

    def vectors(self, radial: Array, vertical: Array) -> Array:
        """Vectors (or positions) at the points from their components at the nodes, shape (n_points, 3)."""
        radial = radial[self.node]
        return np.stack([radial * self.cosine, radial * self.sine, vertical[self.node]], axis=1)

    def scalars(self, values: NDArray[_Number]) -> NDArray[_Number]:
        """Values at the points from values at the nodes."""
        return values[self.node]


def write_vtk(branch: Branch, path: str | PathLike[str]) -> list[Path]:
    """Write one VTU file an equilibrium and the PVD file that strings them together for ParaView.

    The VTU files go to a folder beside ``path``, named like it. Time is the step number; volume and pressure are cell data. When the
    scene asks for wrinkling, ``zone`` is 0 at taut points, 1, 2, 3 where wrinkles run along meridians, along circles, both ways.
    VTU files of a longer branch written to the same place before are removed.

    Returns
    -------
    list of Path
        The VTU files and, last, the PVD file.

    Raises
    ------
    InputError
        When the name does not end in ``.pvd`` or the folder cannot be written to.
    """
    return write_collection(path, len(branch), lambda step, file: _write_surface(branch[step], smooth_profile(branch[step]), file))


def write_collection(path: str | PathLike[str], count: int, write_one: Callable[[int, Path], None]) -> list[Path]:
    """Write numbered VTU files to a folder beside a PVD file, and the PVD file last; those of an earlier, longer collection are removed.

    Raises
    ------
    InputError
        When the name does not end in ``.pvd`` or the folder cannot be written to.
    """
    path = Path(path)
    if path.suffix != ".pvd":
        raise InputError("path", str(path), "a name that ends in .pvd is needed; the surfaces go to a folder beside it")
    files = [_surface_file(path, number) for number in range(count)]
    if files:
        _make_folder(files[0].parent)
    for number, file in enumerate(files):
        write_one(number, file)
    remove_surfaces(path, keep=len(files))
    with replace_file(path) as temporary:
        temporary.write_text(_collection(path, files), encoding="utf-8")
    return [*files, path]


def remove_surfaces(path: Path, keep: int = 0) -> None:
    """Remove the VTU files that belong to a PVD file, but for the first few."""
    for file in path.with_suffix("").glob("*.vtu"):
        number = re.fullmatch(re.escape(path.stem) + r"_(\d{4,})\.vtu", file.name)
        if number and int(number[1]) >= keep:
            file.unlink()


def smooth_profile(equilibrium: Equilibrium, points: int = 0) -> dict[str, Array]:
    """The profile at the nodes, with any value that is not defined on the axis (0/0) taken from the node next to it.

    With fewer nodes than ``points`` it is taken at that many places instead, so that the curvature of long elements shows.
    """
    found = equilibrium.profile()
    if found["r"].size < points:
        s = equilibrium.potential.space.node_parameters()
        found = equilibrium.profile(np.linspace(s[0], s[-1], points))
    profile = {key: np.array(values, dtype=np.float64) for key, values in found.items()}
    for values in profile.values():
        for end, beside in ((0, 1), (-1, -2)):
            if values.size > 1 and not np.isfinite(values[end]):
                values[end] = values[beside]
    return profile


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
        What the colour shows: one of :data:`FIELDS` (those in Pa only when the scene has scales).
    size : tuple of int
        Width and height of the picture in pixels.

    Raises
    ------
    InputError
        For an empty branch, an unknown quantity, or a file that cannot be written.
    """
    import pyvista

    equilibrium = _one(shown)
    profile = smooth_profile(equilibrium, points=101)
    if quantity not in FIELDS or quantity not in profile:
        raise InputError("quantity", quantity, "known: " + ", ".join(f for f in FIELDS if f in profile))
    with replace_file(path) as temporary, pyvista.vtk_verbosity("off"):  # VTK reports a missing display before it does without
        plotter = pyvista.Plotter(off_screen=True, window_size=list(size))
        try:
            plotter.set_background("white")
            plotter.enable_anti_aliasing("ssaa")
            drawn = _draw_membrane(plotter, profile, quantity, size[1] / 900)
            _draw_hubs(plotter, equilibrium, profile)
            drawn += _draw_sources(plotter, equilibrium, profile, size[1] / 900)
            _aim(plotter, np.concatenate(drawn))
            plotter.screenshot(str(temporary))
        finally:
            plotter.close()


def _one(shown: Branch | Equilibrium) -> Equilibrium:
    if not isinstance(shown, Sequence):
        return shown
    if not len(shown):
        raise InputError("branch", "no equilibria", "a branch with one or more equilibria is needed")
    return shown[-1]


def _write_surface(equilibrium: Equilibrium, profile: Mapping[str, Array], file: Path) -> None:
    import meshio

    revolution = Revolution.of(profile["r"], closed=equilibrium.potential.space.closed)
    cells = [(kind, c) for kind, c in (("triangle", revolution.triangles), ("quad", revolution.quads), ("line", revolution.line)) if len(c)]
    rho, eta = profile["rho"], profile["eta"]
    R, Z = equilibrium.scene.mesh.position(equilibrium.potential.space.node_parameters())
    point_data = {"displacement": revolution.vectors(rho - R, eta - Z)}
    point_data |= {name: revolution.scalars(profile[name]) for name in FIELDS if name in profile}
    if equilibrium.scene.analysis.wrinkling:
        point_data["zone"] = revolution.scalars(equilibrium.zones().numbers(equilibrium.potential.space.node_parameters()).astype(np.int32))
    loads = {"pressure": equilibrium.pressure, "volume": equilibrium.volume}
    mesh = meshio.Mesh(
        revolution.vectors(rho, eta),
        cells,
        point_data=point_data,
        cell_data={name: [np.full(len(c), load) for _, c in cells] for name, load in loads.items()},
    )
    with replace_file(file) as temporary:
        mesh.write(temporary, file_format="vtu")


def _surface_file(path: Path, step: int) -> Path:
    return path.with_suffix("") / f"{path.stem}_{step:04d}.vtu"


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError("path", str(folder), f"an existing, writable folder around it is needed ({error.strerror})") from error


def _collection(path: Path, files: list[Path]) -> str:
    names = [quoteattr(file.relative_to(path.parent).as_posix()) for file in files]
    entries = "".join(f'    <DataSet timestep="{step}" part="0" file={name}/>\n' for step, name in enumerate(names))
    return f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n{entries}  </Collection>\n</VTKFile>\n'


def _draw_membrane(plotter: pyvista.Plotter, profile: Mapping[str, Array], quantity: str, scale: float) -> list[Array]:
    """Draw the surface, its rims and a few parallels; the points that must be in the picture."""
    import pyvista

    revolution = Revolution.of(profile["r"], 4 * SECTORS, is_closed(profile["rho"], profile["eta"]))
    points = revolution.vectors(profile["rho"], profile["eta"])
    faces = np.concatenate([np.insert(c, 0, c.shape[1], axis=1).ravel() for c in (revolution.triangles, revolution.quads)])
    surface = pyvista.PolyData(points, faces=faces)
    surface.point_data[quantity] = revolution.scalars(profile[quantity])
    meaning, unit = MEANING[quantity]
    bar = {
        "title": (meaning if unit == "1" else f"{meaning} in {unit}").replace(" ", "\n") + "\n",
        "vertical": True,
        "n_labels": 5,
        "fmt": "%.3g",
        "color": "black",
        "title_font_size": round(22 * scale),
        "label_font_size": round(20 * scale),
        "height": 0.55,
        "width": 0.07,
        "position_x": 0.85,
        "position_y": 0.15,
    }
    # little shading, so that the colours stay those of the scale
    look = {"smooth_shading": True, "ambient": 0.35, "diffuse": 0.65, "specular": 0.1}
    plotter.add_mesh(surface, scalars=quantity, cmap="viridis", clim=_color_range(profile[quantity]), scalar_bar_args=bar, **look)
    for node, radius in _drawn_circles(profile["rho"], profile["eta"]):
        tube = pyvista.lines_from_points(points[revolution.node == node], close=True).tube(radius=radius * _extent(profile))
        plotter.add_mesh(tube, color="black", ambient=1.0, diffuse=0.0)
    return [points]


def _color_range(values: Array) -> tuple[float, float]:
    """Ends of a colour scale: those of the values, unless they differ by less than is worth a colour."""
    low, high = float(np.min(values)), float(np.max(values))
    spare = max(0.005 * max(abs(low), abs(high)) - (high - low) / 2, 0.0)
    return low - spare, high + spare


def is_closed(rho: Array, eta: Array) -> bool:
    """Whether a deformed meridian ends where it starts, off the axis."""
    gap = max(abs(rho[0] - rho[-1]), abs(eta[0] - eta[-1]))
    return bool(rho[0] > 0 and gap <= 1e-9 * (np.ptp(rho) + np.ptp(eta)))


def _drawn_circles(rho: Array, eta: Array, count: int = 6) -> list[tuple[int, float]]:
    """Nodes whose circles are drawn, with their thickness: the rims, and a few at equal distances along the meridian to show the shape."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(rho), np.diff(eta)))])
    closed = is_closed(rho, eta)
    inner = np.unique(np.searchsorted(length, length[-1] * np.arange(1 - int(closed), count) / count))
    rims = [] if closed else [k for k in (0, rho.size - 1) if rho[k] > 1e-9 * length[-1]]
    return [*((int(node), 0.0015) for node in inner if closed or 0 < node < rho.size - 1), *((k, 0.005) for k in rims)]


def _draw_hubs(plotter: pyvista.Plotter, equilibrium: Equilibrium, profile: Mapping[str, Array]) -> None:
    """The rigid discs that close an end."""
    import pyvista

    for k in equilibrium.potential.space.hubs:
        center = (0.0, 0.0, float(profile["eta"][k]))
        disc = pyvista.Disc(center=center, inner=0.0, outer=float(profile["rho"][k]), normal=(0, 0, 1), c_res=4 * SECTORS)
        plotter.add_mesh(disc, color="#9a9a9a", ambient=0.4, diffuse=0.6)


def _extent(profile: Mapping[str, Array]) -> float:
    """Size of the deformed membrane."""
    return float(max(np.ptp(profile["eta"]), 2 * np.max(profile["rho"])))


def _draw_sources(plotter: pyvista.Plotter, equilibrium: Equilibrium, profile: Mapping[str, Array], scale: float) -> list[Array]:
    """A sphere with an arrow along the moment for each source that is near; a line of text for those that are far away."""
    import pyvista

    size, drawn, far = 0.1 * _extent(profile), [], []
    for source in equilibrium.scene.sources:
        height = getattr(source, "height", None)
        if height is None:
            continue
        name = type(source).__name__.lower()
        if np.min(np.abs(profile["eta"] - height)) > _FAR * _extent(profile):
            far.append(f"{name} at height {height:g} not shown")
            continue
        up = float(getattr(source, "orientation", 1))
        start = (0.0, 0.0, height - 1.2 * up * size)
        arrow = pyvista.Arrow(start=start, direction=(0, 0, up), scale=2.4 * size, tip_length=0.3, tip_radius=0.12, shaft_radius=0.045)
        sphere = pyvista.Sphere(radius=0.3 * size, center=(0, 0, height))
        for part in (arrow, sphere):
            plotter.add_mesh(part, color="#b03060", smooth_shading=True, ambient=0.3)
            drawn.append(np.asarray(part.points))
    if far:
        corner = tuple(0.03 * length for length in plotter.window_size)
        plotter.add_text("\n".join(far), position=corner, font_size=10 * scale, color="black")
    return drawn


def _aim(plotter: pyvista.Plotter, points: Array, *, margin: float = 0.08, bar: float = 0.18) -> None:
    """Look from the front and a little from above, so that the points fill the picture beside the colour scale."""
    toward = np.array([0.3, -1.0, 0.45])
    toward /= np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    x, y, depth = points @ right, points @ up, np.ptp(points @ toward) + 1.0
    aspect = plotter.window_size[0] / plotter.window_size[1]
    # height of the picture in units of the scene
    height = max(np.ptp(y), np.ptp(x) / (aspect * (1 - bar))) / (1 - 2 * margin)
    centre = (x.min() + x.max()) / 2 * right + (y.min() + y.max()) / 2 * up + (points @ toward).mean() * toward
    centre = centre + bar / 2 * aspect * height * right
    plotter.enable_parallel_projection()
    plotter.camera.focal_point, plotter.camera.up = tuple(centre), tuple(up)
    plotter.camera.position = tuple(centre + 10 * depth * toward)
    plotter.camera.parallel_scale = height / 2
    plotter.renderer.ResetCameraClippingRange()

"""Modes of vibration and of instability in space: an animation for ParaView, and a picture.

With n waves around the axis the membrane at the phase phi of its motion is, in (e_rho, e_theta, e_z)::

    (rho + A u cos(n theta) cos phi,   A c sin(n theta) cos phi,   eta + A w cos(n theta) cos phi)

with (rho, eta) the equilibrium, (u, c, w) the mode and A the amplitude. An unstable direction has no period; it is shown the same way.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import number, whole
from ..errors import InputError
from ..files import replace_file
from ..results.verdict import Verdict
from ..threads import cached_property
from .picture import aim, circles, new_plotter, polydata
from .surroundings import Box
from .vtk import SECTORS, Array, Revolution, shown_length, smooth_profile, write_collection

if TYPE_CHECKING:
    import pyvista

    from ..results.equilibrium import Equilibrium
    from ..results.vibration import Vibration

#: largest displacement that is shown unless an amplitude is given, relative to half the size of the membrane
SHOWN = 0.15
#: sectors around the axis for each wave, so that short waves stay round
_PER_WAVE = 12
#: the horizontal and the vertical of the picture, as the camera of :func:`render_mode` looks
_TO_THE_RIGHT, _UPWARD = np.array([1.0, 0.3, 0.0]) / np.hypot(1.0, 0.3), np.array([0.0, 0.0, 1.0])
#: colour of the equilibrium's lines
_REST = "#4a8f4a"
_MAP = "coolwarm"
_MATT: dict[str, Any] = {"smooth_shading": True, "ambient": 0.4, "diffuse": 0.6}


def write_mode_vtk(
    equilibrium: Equilibrium, mode: Vibration | Verdict, path: str | PathLike[str], *, frames: int = 24, amplitude: float | None = None
) -> list[Path]:
    """Write one period of a mode as one VTU file a frame and the PVD file that strings them together for ParaView.

    The VTU files go to a folder beside ``path``, named like it. Frame k has the phase 2 pi k/frames, so that the first shows the mode at
    full amplitude, and after the last the motion repeats. The point data ``displacement`` starts at the equilibrium. Lengths are in m
    where the scene has scales.

    Parameters
    ----------
    equilibrium : Equilibrium
        The one that the mode belongs to.
    mode : Vibration or Verdict
    path : path
        PVD file to write.
    frames : int
        At least 2.
    amplitude : float, optional
        Factor on the mode; default such that its largest displacement is :data:`SHOWN` times half the size of the membrane.

    Returns
    -------
    list of Path
        The VTU files and, last, the PVD file.

    Raises
    ------
    InputError
        When the name does not end in ``.pvd`` or the folder cannot be written to; for too few frames, an amplitude that is no number, a
        verdict that has no mode, or a mode of another mesh.
    """
    frames = whole("frames", frames, least=2)
    surface = ModeSurface(equilibrium, mode, amplitude)
    length = shown_length(equilibrium)
    return write_collection(path, frames, lambda k, file: _write_frame(surface, float(np.cos(2 * np.pi * k / frames)), length, file))


def render_mode(
    equilibrium: Equilibrium,
    mode: Vibration | Verdict,
    path: str | PathLike[str],
    *,
    amplitude: float | None = None,
    size: tuple[int, int] = (1500, 700),
) -> None:
    """Draw the equilibrium and, beside it, the membrane at the full amplitude of a mode, without a display.

    The colour is the displacement along the normal of the equilibrium, relative to the largest displacement: red the way the pressure
    pushes, blue against it, grey where the membrane rests or moves within its own surface. Green circles belong to the equilibrium.

    Parameters
    ----------
    equilibrium : Equilibrium
        The one that the mode belongs to.
    mode : Vibration or Verdict
    path : path
        PNG file to write.
    amplitude : float, optional
        As in :func:`write_mode_vtk`.
    size : tuple of int
        Width and height of the picture in pixels.

    Raises
    ------
    InputError
        For an amplitude that is no number, a verdict that has no mode, a mode of another mesh, or a file that cannot be written.
    """
    surface = ModeSurface(equilibrium, mode, amplitude, sectors=4 * SECTORS)
    with replace_file(path) as temporary, new_plotter(size) as plotter:
        _draw(plotter, surface)
        plotter.screenshot(str(temporary))


class ModeSurface:
    """Points of the equilibrium and their displacements at full amplitude."""

    def __init__(self, equilibrium: Equilibrium, mode: Vibration | Verdict, amplitude: float | None, sectors: int = SECTORS) -> None:
        shape = _shape(equilibrium, mode)
        self.n, self.caption = mode.azimuthal, _caption(mode)
        profile = smooth_profile(equilibrium)
        self.rho, self.eta = profile["rho"], profile["eta"]
        self.extent = Box.of([profile]).size
        self.revolution = Revolution.of_membrane(equilibrium, profile["r"], max(sectors, _PER_WAVE * self.n))
        self.rest = self.revolution.vectors(self.rho, self.eta)
        unit = _displacements(self.revolution, shape, self.n)
        shown = SHOWN * self.extent / 2 / np.linalg.norm(unit, axis=1).max()
        amplitude = shown if amplitude is None else number("amplitude", amplitude)
        self.displacement = amplitude * unit

    @cached_property
    def normal(self) -> Array:
        """Displacement along the normal of the equilibrium over the largest displacement, shape (n_points,)."""
        return _along_the_normal(self)


def _caption(mode: Vibration | Verdict) -> str:
    value = mode.smallest_eigenvalue if isinstance(mode, Verdict) else mode.eigenvalue
    motion = f"omega = {np.sqrt(value):.4g}" if value >= 0 else f"growth rate {np.sqrt(-value):.4g}"
    held = f", {mode.control} held" if mode.control else ""
    return f"n = {mode.azimuthal}{held}: eigenvalue {value:.4g}, {motion}"


def _shape(equilibrium: Equilibrium, mode: Vibration | Verdict) -> Mapping[str, Array]:
    shape = mode.mode
    if shape is None:
        reason = getattr(mode, "reason", "")
        raise InputError("mode", mode, f"a verdict with a mode is needed; this one has none ({reason})")
    if not np.array_equal(shape["r"], equilibrium.profile()["r"]):
        raise InputError("mode", mode, "a mode of this equilibrium is needed: the nodes are not the same")
    return shape


def _displacements(revolution: Revolution, shape: Mapping[str, Array], n: int) -> Array:
    """The mode at the points. On the axis, which is one point at the angle 0, it is (u, 0, w)."""
    angle = np.arctan2(revolution.sine, revolution.cosine)
    wave, turned = np.cos(n * angle), np.sin(n * angle)
    u, w = shape["u"][revolution.node] * wave, shape["w"][revolution.node] * wave
    c = shape["c"][revolution.node] * turned if n else np.zeros_like(u)
    x, y = revolution.cosine, revolution.sine
    return np.stack([u * x - c * y, u * y + c * x, w], axis=1)


def _write_frame(surface: ModeSurface, phase: float, length: float, file: Path) -> None:
    import meshio

    revolution = surface.revolution
    cells = [(kind, c) for kind, c in (("triangle", revolution.triangles), ("quad", revolution.quads)) if len(c)]
    moved = phase * surface.displacement
    mesh = meshio.Mesh(length * (surface.rest + moved), cells, point_data={"displacement": length * moved})
    with replace_file(file) as temporary:
        mesh.write(temporary, file_format="vtu")


def _draw(plotter: pyvista.Plotter, surface: ModeSurface) -> None:
    """On the left the equilibrium, on the right the membrane at full amplitude."""
    beside = surface.rest - 1.15 * surface.extent * _TO_THE_RIGHT
    plotter.add_mesh(polydata(surface.revolution, beside), color="#d9e6d6", **_MATT)
    _draw_lines(plotter, surface, beside, _REST)
    draw_moved(plotter, surface, 1.0)
    _draw_key(plotter, surface, position_x=0.57)
    low = surface.rest - 0.3 * surface.extent * _UPWARD
    aim(plotter, np.concatenate([beside, surface.rest, surface.rest + surface.displacement, low]), bar=0.0, margin=0.04)


def set_up_motion(plotter: pyvista.Plotter, surface: ModeSurface) -> None:
    """Draw what does not move: the key, and a camera that sees the whole motion."""
    _draw_key(plotter, surface, position_x=0.58)
    low = surface.rest - 0.3 * surface.extent * _UPWARD
    moved = [surface.rest + sign * surface.displacement for sign in (1, -1)]
    aim(plotter, np.concatenate([*moved, low]), bar=0.0, margin=0.06)


def draw_moved(plotter: pyvista.Plotter, surface: ModeSurface, part: float) -> None:
    """Draw the membrane at a part, -1 to 1, of the amplitude beside the circles of the equilibrium, in place of the last one."""
    moved = surface.rest + part * surface.displacement
    coloured = polydata(surface.revolution, moved)
    coloured.point_data["normal"] = part * surface.normal
    look = {"clim": (-1, 1), "cmap": _MAP, "show_scalar_bar": False, "name": "moved", "reset_camera": False, "render": False, **_MATT}
    plotter.add_mesh(coloured, scalars="normal", **look)
    _draw_lines(plotter, surface, moved, "black", meridians=True, name="lines")
    _draw_lines(plotter, surface, surface.rest, _REST, name="rest")


def _draw_key(plotter: pyvista.Plotter, surface: ModeSurface, position_x: float) -> None:
    import pyvista

    width, height = plotter.window_size
    scale = min(height / 700, width / 900)
    mapper = pyvista.DataSetMapper()
    mapper.lookup_table = pyvista.LookupTable(_MAP, scalar_range=(-1, 1))
    mapper.scalar_range = (-1, 1)
    plotter.add_scalar_bar(
        "displacement along the normal\nover the largest one\n",
        mapper=mapper,
        color="black",
        title_font_size=round(18 * scale),
        label_font_size=round(18 * scale),
        n_labels=5,
        fmt="%.1f",
        width=0.36,
        height=0.14,
        position_x=position_x,
        position_y=0.02,
        render=False,
    )
    plotter.add_text(surface.caption, position=(0.03 * width, 0.03 * height), font_size=11 * scale, color="black", render=False)


def _along_the_normal(surface: ModeSurface) -> Array:
    """Displacement along the normal of the equilibrium over the largest displacement."""
    rest = polydata(surface.revolution, surface.rest)
    normals = rest.compute_normals(cell_normals=False, split_vertices=False, consistent_normals=False, auto_orient_normals=False)
    largest = np.linalg.norm(surface.displacement, axis=1).max()
    return (surface.displacement * normals.point_data["Normals"]).sum(axis=1) / (largest or 1.0)


def _draw_lines(
    plotter: pyvista.Plotter, surface: ModeSurface, points: Array, color: str, meridians: bool = False, name: str | None = None
) -> None:
    """A few circles of a surface, and meridians every 30 degrees."""
    import pyvista

    node = surface.revolution.node
    lines = [(points[node == circle], True) for circle, _ in circles(surface.rho, surface.eta, ())]
    if meridians:
        turn = np.round(np.arctan2(surface.revolution.sine, surface.revolution.cosine) / (np.pi / 6), 6) % 12
        # a pole is one point, of all meridians
        first, last = (points[node == end] if np.count_nonzero(node == end) == 1 else points[:0] for end in (0, node[-1]))
        inner = np.isin(node, [end for end, pole in ((0, first), (node[-1], last)) if len(pole)], invert=True)
        closed = not len(first) and node[-1] < surface.rho.size - 1
        lines += [(np.concatenate([first, points[(turn == k) & inner], last]), closed) for k in range(12)]
    tubes = [pyvista.lines_from_points(line, close=closed).tube(radius=0.0016 * surface.extent, n_sides=8) for line, closed in lines]
    plotter.add_mesh(pyvista.merge(tubes), color=color, ambient=1.0, diffuse=0.0, name=name, reset_camera=False, render=False)

"""Modes of vibration and of instability in space: an animation for ParaView, and a picture.

With n waves around the axis the membrane at the phase phi of its motion is, in (e_rho, e_theta, e_z)::

    (rho + A u cos(n theta) cos phi,   A c sin(n theta) cos phi,   eta + A w cos(n theta) cos phi)

with (rho, eta) the equilibrium, (u, c, w) the mode and A the amplitude. An unstable direction has no period; it is shown the same way.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..results.store import replace_file
from ..stability.verdict import Verdict
from .vtk import (
    SECTORS,
    Array,
    Revolution,
    _aim,
    _drawn_circles,
    _extent,
    smooth_profile,
    write_collection,
)

if TYPE_CHECKING:
    import pyvista

    from ..results.records import Equilibrium
    from ..stability.frequencies import Vibration

#: largest displacement that is shown unless an amplitude is given, relative to half the size of the membrane
SHOWN = 0.15
#: sectors around the axis for each wave, so that short waves stay round
_PER_WAVE = 12
#: horizontal and vertical in the picture, as the camera of :func:`render_mode` looks
_TO_THE_RIGHT, _UPWARD = np.array([1.0, 0.3, 0.0]) / np.hypot(1.0, 0.3), np.array([0.0, 0.0, 1.0])
#: colour of the equilibrium's lines
_REST = "#4a8f4a"


def write_mode_vtk(
    equilibrium: Equilibrium, mode: Vibration | Verdict, path: str | PathLike[str], *, frames: int = 24, amplitude: float | None = None
) -> list[Path]:
    """Write one period of a mode as one VTU file a frame and the PVD file that strings them together for ParaView.

    The VTU files go to a folder beside ``path``, named like it. Frame k has the phase 2 pi k/frames, so that the first shows the mode at
    full amplitude, and after the last the motion repeats. The point data ``displacement`` is that from the equilibrium.

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
    if isinstance(frames, bool) or not isinstance(frames, (int, np.integer)) or frames < 2:
        raise InputError("frames", frames, "a whole number >= 2 is allowed")
    surface = _ModeSurface(equilibrium, mode, amplitude)
    return write_collection(path, frames, lambda frame, file: _write_frame(surface, float(np.cos(2 * np.pi * frame / frames)), file))


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
    pushes, blue against it, grey where the membrane rests or moves within its own surface. Green circles are those of the equilibrium.

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
    import pyvista

    surface = _ModeSurface(equilibrium, mode, amplitude, sectors=4 * SECTORS)
    with replace_file(path) as temporary, pyvista.vtk_verbosity("off"):  # VTK reports a missing display before it does without
        plotter = pyvista.Plotter(off_screen=True, window_size=list(size))
        try:
            _draw(plotter, surface, size[1] / 700)
            plotter.screenshot(str(temporary))
        finally:
            plotter.close()


class _ModeSurface:
    """Points of the equilibrium and their displacements at full amplitude."""

    def __init__(self, equilibrium: Equilibrium, mode: Vibration | Verdict, amplitude: float | None, sectors: int = SECTORS) -> None:
        shape = _shape(equilibrium, mode)
        self.n, self.caption = mode.azimuthal, _caption(mode)
        profile = smooth_profile(equilibrium)
        self.rho, self.eta = profile["rho"], profile["eta"]
        self.extent = _extent(profile)
        self.revolution = Revolution.of(profile["r"], max(sectors, _PER_WAVE * self.n), equilibrium.potential.space.closed)
        self.rest = self.revolution.vectors(self.rho, self.eta)
        unit = _displacements(self.revolution, shape, self.n)
        if amplitude is None:
            amplitude = SHOWN * self.extent / 2 / np.linalg.norm(unit, axis=1).max()
        elif not np.isfinite(amplitude):
            raise InputError("amplitude", amplitude, "a finite number is allowed")
        self.displacement = amplitude * unit


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


def _write_frame(surface: _ModeSurface, phase: float, file: Path) -> None:
    import meshio

    revolution = surface.revolution
    cells = [(kind, c) for kind, c in (("triangle", revolution.triangles), ("quad", revolution.quads)) if len(c)]
    moved = phase * surface.displacement
    mesh = meshio.Mesh(surface.rest + moved, cells, point_data={"displacement": moved})
    with replace_file(file) as temporary:
        mesh.write(temporary, file_format="vtu")


def _polydata(revolution: Revolution, points: Array) -> pyvista.PolyData:
    import pyvista

    faces = [np.insert(cells, 0, cells.shape[1], axis=1).ravel() for cells in (revolution.triangles, revolution.quads)]
    return pyvista.PolyData(points, faces=np.concatenate(faces))


def _draw(plotter: pyvista.Plotter, surface: _ModeSurface, scale: float) -> None:
    """On the left the equilibrium, on the right the membrane at full amplitude."""
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    matt = {"smooth_shading": True, "ambient": 0.4, "diffuse": 0.6}
    beside = surface.rest - 1.15 * surface.extent * _TO_THE_RIGHT
    moved = surface.rest + surface.displacement
    plotter.add_mesh(_polydata(surface.revolution, beside), color="#d9e6d6", **matt)
    _draw_lines(plotter, surface, beside, _REST)
    coloured = _polydata(surface.revolution, moved)
    coloured.point_data["normal"] = _along_the_normal(surface)
    shown = plotter.add_mesh(coloured, scalars="normal", clim=(-1, 1), cmap="coolwarm", show_scalar_bar=False, **matt)
    _draw_lines(plotter, surface, moved, "black", meridians=True)
    _draw_lines(plotter, surface, surface.rest, _REST)
    text, black = round(18 * scale), "black"
    plotter.add_scalar_bar(
        "displacement along the normal, over the largest one\n",
        mapper=shown.mapper,
        color=black,
        title_font_size=text,
        label_font_size=text,
        n_labels=5,
        fmt="%.1f",
        width=0.36,
        height=0.12,
        position_x=0.57,
        position_y=0.02,
    )
    plotter.add_text(
        surface.caption, position=(0.03 * plotter.window_size[0], 0.03 * plotter.window_size[1]), font_size=11 * scale, color=black
    )
    low = surface.rest - 0.25 * surface.extent * _UPWARD
    _aim(plotter, np.concatenate([beside, surface.rest, moved, low]), bar=0.0, margin=0.04)


def _along_the_normal(surface: _ModeSurface) -> Array:
    rest = _polydata(surface.revolution, surface.rest)
    normals = rest.compute_normals(cell_normals=False, split_vertices=False, consistent_normals=False, auto_orient_normals=False)
    largest = np.linalg.norm(surface.displacement, axis=1).max()
    return (surface.displacement * normals.point_data["Normals"]).sum(axis=1) / (largest or 1.0)


def _draw_lines(plotter: pyvista.Plotter, surface: _ModeSurface, points: Array, color: str, meridians: bool = False) -> None:
    """A few circles of a surface, and meridians every 30 degrees."""
    import pyvista

    node = surface.revolution.node
    lines = [(points[node == circle], True) for circle, _ in _drawn_circles(surface.rho, surface.eta)]
    if meridians:
        turn = np.round(np.arctan2(surface.revolution.sine, surface.revolution.cosine) / (np.pi / 6), 6) % 12
        axis = points[:1] if np.count_nonzero(node == 0) == 1 else points[:0]
        lines += [(np.concatenate([axis, points[(turn == k) & (node > 0)]]), False) for k in range(12)]
    for line, closed in lines:
        tube = pyvista.lines_from_points(line, close=closed).tube(radius=0.0016 * surface.extent)
        plotter.add_mesh(tube, color=color, ambient=1.0, diffuse=0.0)

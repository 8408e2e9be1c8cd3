"""``femmembrane view``: the membrane of a finished run in space."""

from __future__ import annotations

from pathlib import Path

from ..errors import SolveError
from .folders import OwnScene, System, finished_any, own_of
from .outcome import DONE, NOT_CONVERGED, explain, fail, succeed


def view(
    folder: Path,
    /,
    *,
    color: str = "stretch_2",
    step: int | None = None,
    mode: int | None = None,
    screenshot: Path | None = None,
    movie: Path | None = None,
    units: System = "scaled",
    own: OwnScene = None,
) -> int:
    """Show the membrane of a run in space: a window with a slider over the steps, or a picture or movie, which need no display.

    Parameters
    ----------
    folder
        Folder of a run, or a branch that was saved (.nc).
    color
        What the colour shows: stretch_1, stretch_2 (1 along the meridian, 2 around the axis), mechanical_stress_1, total_stress_1, ...
        (in Pa with _pa at the end when the scene has scales), or zone.
    step
        Number of the equilibrium shown first, in a picture, and of a mode; negative ones count from the end.
    mode
        Show the lowest mode with so many waves around the axis in motion.
    screenshot
        PNG file to write.
    movie
        GIF or MP4 file to write (MP4 with imageio[ffmpeg] installed).
    units
        Of numbers and stresses: those of the package, or SI units by the [scales] of the scene.
    """
    from ..files import remove_leftovers
    from ..views.viewer import view as show
    from .progress import counter

    for file in filter(None, (screenshot, movie)):
        remove_leftovers(file.parent)
    branch = finished_any(folder, own=own_of(own))
    try:
        with counter("frames") as count:
            show(branch, color=color, step=step, mode=mode, screenshot=screenshot, movie=movie, units=units, on_frame=count)
    except SolveError as error:
        return fail(NOT_CONVERGED, explain(error.status, str(error)))
    written = list(filter(None, (screenshot, movie)))
    return succeed("", written) if written else DONE

"""A branch in space: a window with a slider over the steps, a picture, or a movie; and the same for a mode in motion."""

from __future__ import annotations

import os
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..errors import InputError
from ..files import replace_file
from ..quantities import SCALED, Units, caption, in_si, words
from ..results.analyses import remarks
from ..results.tipped import TippedBranch, TippedEquilibrium
from .modes import ModeSurface, draw_moved, render_mode, set_up_motion
from .movie import Frame, check_movie, write_movie
from .picture import DrawnMembrane, MovingBodies, Surface, aim, check_quantity, draw_key, draw_surroundings, frame, new_plotter
from .surroundings import Box, place_of
from .tipped import COLOR, WavySurface

if TYPE_CHECKING:
    import pyvista

    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium

#: who is told of each frame of a movie: its number, counted from 1, and how many there are
OnFrame: TypeAlias = Callable[[int, int], object]
#: sizes of a window and a picture, and of a movie
DEFAULT_COLOR = "stretch_2"
SIZE, MOVIE_SIZE = (1200, 900), (720, 540)
#: sectors and points along a meridian of a surface of which many are shown: it is round to a third of a pixel
SECTORS_SHOWN, POINTS_SHOWN = 72, 73
#: most frames of a movie of a branch, and frames of one period of a mode
_MOST, _PERIOD = 90, 30
_RATE = 12.0
#: characters of a line of a caption
_LINE = 72
#: seconds for which the last step of a branch stays; milliseconds between two phases of a mode in a window
_HOLD, _PAUSE = 1.5, 50


def view(
    shown: Branch | Equilibrium | TippedBranch | TippedEquilibrium,
    *,
    color: str = DEFAULT_COLOR,
    step: int | None = None,
    mode: int | None = None,
    screenshot: str | PathLike[str] | None = None,
    movie: str | PathLike[str] | None = None,
    size: tuple[int, int] | None = None,
    units: str = "scaled",
    on_frame: OnFrame | None = None,
) -> None:
    """Show the membrane in space: in a window, or in files and without a display if files are asked for.

    Camera and colours are the same for all steps of a window or a movie.

    Parameters
    ----------
    shown : Branch, Equilibrium, TippedBranch or TippedEquilibrium
    color : str
        What the colour shows: a stretch or a stress of the profile (``stretch_1``, ``total_stress_2``, ...), or ``zone``.
        Of states with waves around the axis it is the size of their waves.
    step : int, optional
        The equilibrium of a picture or of a mode; in a window, the one shown first. Default: the last. Negative steps count from the end.
    mode : int, optional
        Number of waves around the axis. The lowest mode with so many waves moves about the equilibrium, in place of the steps.
    screenshot : path, optional
        PNG file to write.
    movie : path, optional
        GIF or MP4 file to write: all steps (90 of them, where there are more), or one period of the mode.
    size : tuple of int
        Width and height in pixels. Default: (1200, 900), for a movie (720, 540).
    units : {"scaled", "si"}
        Of the numbers beside the membrane and of stresses: those of the package, or SI units by the scales of the scene.
    on_frame : callable, optional
        Called with (number, total) after each frame of a movie.

    Raises
    ------
    InputError
        For an empty branch, an unknown colour, SI units of a scene without scales, a step that does not exist, a file that cannot be
        written, MP4 without a writer, and a window without a display.
    SolveError
        For a mode of a state that has no natural modes.
    """
    branch: list[Any] = list(shown) if isinstance(shown, Sequence) else [shown]
    if not branch:
        raise InputError("branch", "no equilibria", "a branch with one or more equilibria is needed")
    chosen_units = Units.of(units, branch[0].scene.converter)
    if isinstance(branch[0], TippedEquilibrium):
        color = _color_of_waves(color, mode)
    else:
        color = in_si(color) if chosen_units.unit(color) else color
        check_quantity(color, branch[0].scene, "color")
    place = place_of(step, len(branch))
    if movie is not None:
        check_movie(movie)
    if screenshot is None and movie is None:
        _check_display()
    if mode is not None:
        _view_mode(branch[place], mode, screenshot, movie, size, on_frame)
        return
    if screenshot is not None:
        with replace_file(_png(screenshot)) as temporary, new_plotter(size or SIZE) as plotter:
            _Stage(plotter, [branch[place]], [place], len(branch), color, chosen_units).draw(0)
            plotter.screenshot(str(temporary))
    if movie is not None:
        chosen = np.unique(np.linspace(0, len(branch) - 1, min(len(branch), _MOST)).round().astype(int)).tolist()
        with new_plotter(size or MOVIE_SIZE, frames=True) as plotter:
            stage = _Stage(plotter, [branch[k] for k in chosen], chosen, len(branch), color, chosen_units)
            write_movie(_told(_frames(stage), len(chosen), on_frame), movie, rate=_RATE, hold=_HOLD)
    if screenshot is None and movie is None:
        with new_plotter(size or SIZE, off_screen=False) as plotter:
            open_steps(plotter, branch, color, place, chosen_units)
            plotter.show(title=branch[0].scene.title or "femmembrane")


def open_steps(plotter: pyvista.Plotter, branch: Sequence[Equilibrium], color: str, place: int, units: Units = SCALED) -> None:
    """Fill a window: the membrane at a step and, for more than one, the slider."""
    stage = _Stage(plotter, branch, range(len(branch)), len(branch), color, units)
    stage.draw(place)
    if len(branch) > 1:
        plotter.add_slider_widget(
            lambda value: stage.draw(round(value)),
            (0, len(branch) - 1),
            value=place,
            title="step",
            fmt="%.0f",
            pointa=(0.66, 0.07),
            pointb=(0.96, 0.07),
            color="black",
            style="modern",
            interaction_event="always",
        )


@dataclass(eq=False)
class _Stage:
    """The steps of a branch in one picture: camera, colours and sources do not change from one to the next."""

    plotter: pyvista.Plotter
    branch: Sequence[Equilibrium]
    numbers: Sequence[int]
    total: int
    color: str
    units: Units = SCALED

    def __post_init__(self) -> None:
        self.surfaces = [_surface(equilibrium, self.color) for equilibrium in self.branch]
        self.limits = min(s.range[0] for s in self.surfaces), max(s.range[1] for s in self.surfaces)
        boxes = [s.box for s in self.surfaces]
        box = Box(max(b.radius for b in boxes), min(b.low for b in boxes), max(b.high for b in boxes))
        self.membrane = DrawnMembrane(self.plotter, self.limits, box.size)
        self.bodies = None
        scenes = [equilibrium.scene for equilibrium in self.branch]
        if all((scene.sources, scene.obstacles) == (scenes[0].sources, scenes[0].obstacles) for scene in scenes):
            drawn = draw_surroundings(self.plotter, scenes[0], box)
        else:
            self.bodies = MovingBodies(self.plotter, scenes, box)
            drawn = self.bodies.points
        draw_key(self.plotter, self.surfaces[0], self.limits)
        lines = max(self.caption(k).count("\n") for k in range(len(self.branch)))
        aim(self.plotter, np.concatenate([*drawn, *(s.points for s in self.surfaces)]), margin=0.11, words=_further(lines))

    def draw(self, index: int) -> None:
        self.membrane.show(self.surfaces[index])
        if self.bodies is not None:
            self.bodies.show(self.branch[index].scene)
        write_caption(self.plotter, self.caption(index))

    def caption(self, index: int) -> str:
        """The words beside a step."""
        return _caption(self.branch[index], self.numbers[index], self.total, self.units)


def _surface(equilibrium: Equilibrium | TippedEquilibrium, color: str) -> Surface:
    if isinstance(equilibrium, TippedEquilibrium):
        return WavySurface.of_tipped(equilibrium, SECTORS_SHOWN)
    return Surface.of(equilibrium, color, SECTORS_SHOWN, POINTS_SHOWN)


def _color_of_waves(color: str, mode: int | None) -> str:
    """What the colour of states with waves shows, or InputError for a colour or a mode that they do not have."""
    if mode is not None:
        raise InputError("mode", mode, "modes in motion are those of axisymmetric equilibria; of states with waves it is left out")
    if color not in (COLOR, DEFAULT_COLOR):
        raise InputError("color", color, f"of states with waves around the axis {COLOR!r} is allowed, which needs not be given")
    return COLOR


def _frames(stage: _Stage) -> Iterator[Frame]:
    for index in range(len(stage.surfaces)):
        stage.draw(index)
        yield frame(stage.plotter)


def _told(frames: Iterator[Frame], total: int, on_frame: OnFrame | None) -> Iterator[Frame]:
    """The same frames; whoever waits for them is told of each."""
    for number, drawn in enumerate(frames, 1):
        if on_frame is not None:
            on_frame(number, total)
        yield drawn


def write_caption(plotter: pyvista.Plotter, text: str) -> None:
    """Lines at the upper left, in place of those before."""
    width, height = plotter.window_size
    low = 0.9 - _further(text.count("\n"))  # the first line stays where it is
    plotter.add_text(text, position=(0.03 * width, low * height), font_size=11 * height / 720, color="black", name="caption", render=False)


def _further(breaks: int) -> float:
    """What a caption takes of the height beyond two lines."""
    return 0.035 * max(breaks - 1, 0)


def _caption(equilibrium: Equilibrium, number: int, total: int, units: Units = SCALED) -> str:
    height = f"{words('center_height')} {units.factor('center_height') * equilibrium.center_height:.4g} {units.unit('center_height')}"
    numbers = f"{caption(equilibrium.volume, equilibrium.pressure, '   ', units)}   {height.rstrip()}"
    if isinstance(equilibrium, TippedEquilibrium):
        answers = [f"{equilibrium.waves} wave{'s' if equilibrium.waves > 1 else ''} around the axis, amplitude {equilibrium.amplitude:.3g}"]
    else:
        answers = [remark.caption for remark in remarks(equilibrium) if remark.caption]
    step = f"step {number}/{total - 1}   " if total > 1 else ""
    return "\n".join([step + numbers, *textwrap.wrap(", ".join(answers), _LINE)])


def _view_mode(
    equilibrium: Equilibrium,
    waves: int,
    screenshot: str | PathLike[str] | None,
    movie: str | PathLike[str] | None,
    size: tuple[int, int] | None,
    on_frame: OnFrame | None,
) -> None:
    found = equilibrium.frequencies(azimuthal=waves, count=1)[0]
    if screenshot is not None:
        render_mode(equilibrium, found, _png(screenshot), size=size or (1500, 700))
    surface = ModeSurface(equilibrium, found, None, sectors=96)
    if movie is not None:
        with new_plotter(size or MOVIE_SIZE, frames=True) as plotter:
            write_movie(_told(_phases(plotter, surface), _PERIOD, on_frame), movie, rate=2 * _RATE)
    if screenshot is None and movie is None:
        with new_plotter(size or SIZE, off_screen=False) as plotter:
            set_in_motion(plotter, surface)
            plotter.show(title=surface.caption)


def set_in_motion(plotter: pyvista.Plotter, surface: ModeSurface) -> None:
    """Fill a window with a mode that moves while it is open."""

    def move(tick: int) -> None:
        draw_moved(plotter, surface, float(np.cos(2 * np.pi * tick / _PERIOD)))
        plotter.render()

    set_up_motion(plotter, surface)
    draw_moved(plotter, surface, 1.0)
    plotter.add_timer_event(max_steps=10**6, duration=_PAUSE, callback=move)


def _phases(plotter: pyvista.Plotter, surface: ModeSurface) -> Iterator[Frame]:
    set_up_motion(plotter, surface)
    for tick in range(_PERIOD):
        draw_moved(plotter, surface, float(np.cos(2 * np.pi * tick / _PERIOD)))
        yield frame(plotter)


def _png(path: str | PathLike[str]) -> str | PathLike[str]:
    if not str(path).lower().endswith(".png"):
        raise InputError("screenshot", str(path), "a name that ends in .png is allowed")
    return path


def _check_display() -> None:
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError("view", "a window", "there is no display; screenshot or movie (--screenshot, --movie) draw without one")

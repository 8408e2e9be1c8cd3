"""A scene whose numbers change under somebody's hands: its branch is computed anew, as fast as it can be, at each change.

The branch is traced by arc length where the scene's [run] goes over volumes, pressures or heights of the pole: so its folds are seen, and
so are both sides of them. Other runs are what the scene says.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..errors import InputError, SolveError
from ..results.branch import Branch
from ..scene import Run, Scene
from ..scene.variation import Parameter, names
from ..solve.continuation import StepControl
from .follow import equilibrium, run
from .trace import trace

#: numbers of elements between which an accuracy is chosen, from rough to fine
ELEMENTS = (4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
#: verdicts that a live branch has at least
_VERDICTS = ("pressure", "volume")
#: what a run may prescribe that a trace follows as well, by the names that ``until`` has for them
_FOLLOWED = {"volume": "volume", "pressure": "pressure", "height": "center_height"}
#: steps of a branch that is drawn anew many times a second: longer than those of a run, for between them it is drawn along cubics
_STRIDES = StepControl(largest=1.0, deviation=2e-3)
#: a slider spans these multiples of a number, and this much about zero
_SPAN, _ABOUT_ZERO = 2.0, 1.0
#: times that the way to an end of that range is halved where the scene cannot take it
_HALVED = 6


@dataclass(frozen=True)
class Slider:
    """A number of the scene, with the range over which it is moved at first."""

    name: str
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Answer:
    """What came of some values: the scene, its branch, what it cost, and how far off it is.

    Attributes
    ----------
    scene : Scene
    branch : Branch
    milliseconds : float
        Of the computation, verdicts included.
    error : float
        Estimated relative error of the pressure of the last equilibrium at its volume; NaN where none can be given.
    """

    scene: Scene
    branch: Branch
    milliseconds: float
    error: float


class LiveScene:
    """A scene with sliders.

    Parameters
    ----------
    scene : Scene
        With a [run], and a mesh that is given.

    Raises
    ------
    InputError
        For a scene without a [run].
    """

    def __init__(self, scene: Scene) -> None:
        if scene.run is None:
            raise InputError("run", None, 'missing; say what to compute: [run] with control = "volume", start, stop and steps')
        asked = scene.analysis
        stability = asked.stability or _VERDICTS
        self.scene = scene.replace(analysis=replace(asked, stability=stability, error_estimates=False))

    def sliders(self) -> list[Slider]:
        """One for every number of the scene that can vary, except the one that its run varies."""
        varied = self._run.number
        found = (_slider(Parameter(self.scene, name)) for name in names(self.scene) if name != varied)
        return [slider for slider in found if slider.low < slider.high]

    @property
    def elements(self) -> int | None:
        """Number of elements of the mesh; None where a mesh has a number of its own, as one from a file."""
        return getattr(self.scene.mesh, "elements", None) if hasattr(self.scene.mesh, "with_elements") else None

    def scene_at(self, values: Mapping[str, float], elements: int | None = None) -> Scene:
        """The scene with these values, and so many elements.

        Raises
        ------
        InputError
            For a name that the scene does not have, and a value that it cannot take.
        """
        scene = self.scene
        for name, value in values.items():
            scene = _at(Parameter(scene, name), float(value))
        if elements is not None and self.elements is not None:
            scene = scene.replace(mesh=self.scene.mesh.with_elements(int(elements)))  # type: ignore[attr-defined]  # has elements
        return scene

    def answer(self, values: Mapping[str, float], elements: int | None = None) -> Answer:
        """The branch at these values.

        Raises
        ------
        InputError
            As :meth:`scene_at`.
        SolveError
            Where not even a first equilibrium is found.
        """
        scene = self.scene_at(values, elements)
        begun = time.perf_counter()
        branch = self._branch(scene)
        spent = time.perf_counter() - begun
        return Answer(scene, branch, 1e3 * spent, _error(branch))

    @property
    def _run(self) -> Run:
        run = self.scene.run
        if run is None:
            raise InputError("run", None, "a scene with a [run] is needed")
        return run

    def _branch(self, scene: Scene) -> Branch:
        asked = self._run
        until = _FOLLOWED.get(asked.control) if asked.number is None else None
        if until is None:
            return run(scene)
        loads = asked.loads()
        first, last = float(loads[0]), float(loads[-1])
        held: dict[str, Any] = {until: first}
        start: Any = first if until == "volume" else equilibrium(scene, **held)
        if first == last:
            return trace(scene, start=start, max_steps=1)
        return trace(scene, start=start, until={until: last}, direction=1 if last > first else -1, steps=_STRIDES)


def _slider(number: Parameter) -> Slider:
    value = number.value
    low, high = sorted((value / _SPAN, value * _SPAN)) if value else (-_ABOUT_ZERO, _ABOUT_ZERO)
    return Slider(number.name, value, _reached(number, low), _reached(number, high))


def _reached(number: Parameter, end: float) -> float:
    """The end of a range, or what of the way to it the scene can take: a body comes no nearer than the membrane at rest."""
    value = number.value
    for k in range(_HALVED):
        there = value + (end - value) / 2**k
        try:
            _at(number, there)
        except InputError:
            continue
        return there
    return value


def _at(number: Parameter, value: float) -> Scene:
    """The scene with a value, in which a run can set out from rest: no body is where the membrane is then."""
    return number.scene_at(value).replace(squeezed=number.scene.squeezed)


def _error(branch: Branch) -> float:
    try:
        return float(branch[-1].error_estimate().pressure.relative) if len(branch) else float("nan")
    except SolveError:
        return float("nan")

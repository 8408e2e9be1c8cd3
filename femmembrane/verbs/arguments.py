"""Checks of arguments that several verbs share."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from ..checks import choice, is_whole, whole
from ..discretization.space import anchored
from ..discretization.supports import as_support, floats
from ..errors import InputError
from ..physics.units import has_unit, in_unit
from ..quantities import SI_UNITS, quantity
from ..results.analyses import asked
from ..scene import MAX_STEPS, Scene
from ..scene.laboratory import number_kind
from ..scene.run import GAS

ILL_POSED = ("stop", "mark")


def check_scene(scene: Any) -> None:
    """Raise InputError for what is no scene, such as the path of its file, and for one that asks for an analysis that nobody registered."""
    if not isinstance(scene, Scene):
        raise InputError("scene", scene, "a Scene is allowed; Scene.from_toml reads one from a file")
    asked(scene)
    _check_walls(scene)


def kind_of(name: str) -> str:
    """Kind of a quantity or of a number of a scene, one of :data:`.SI_UNITS`; empty for one without a value in SI units."""
    return "energy" if name == GAS else number_kind(name) or quantity(name).si


def plain(key: str, value: Any, scene: Any, name: str) -> Any:
    """A text with a unit, such as "1 kPa", as a number in the units of the package, by the scales of the scene; other values as they are.

    Raises
    ------
    InputError
        For a unit of another kind, and for a scene without scales.
    """
    if not has_unit(value):
        return value
    check_scene(scene)
    kind = kind_of(name)
    if not kind:
        raise InputError(key, value, "a number without a unit is allowed")
    if scene.scales is None:
        raise InputError(key, value, "a number with a unit needs a scene with scales=fm.Scales(...)")
    return scene.scales.from_si(kind, in_unit(key, value, SI_UNITS[kind])[0])


def _check_walls(scene: Scene) -> None:
    """Raise InputError for a membrane that slides along a wall where nothing holds it against the pressure.

    Moved as a whole along the axis it changes its volume by the area across the wall, so that any pressure pushes it out of its pipe. Two
    walls of one radius are pushed in opposite directions.
    """
    supports = [as_support(held) for held in scene.mesh.supports()]
    if not any(end.wall for end in supports) or not floats(supports) or "along" in anchored(scene):
        return
    radii = scene.mesh.position(scene.mesh.breakpoints()[[0, -1]])[0]
    walls = [float(R) ** 2 if end.wall else 0.0 for R, end in zip(radii, supports, strict=True)]
    if abs(walls[1] - walls[0]) > 1e-9 * max(walls):
        raise InputError(
            "mesh",
            "an axial end",
            "nothing holds the membrane along the axis, and any pressure pushes it out of the pipe in which that end slides; the other end "
            "may be clamped, radial or mirror, or this one a hub, on which the pressure acts too",
        )


def check_max_steps(max_steps: Any) -> None:
    """Raise InputError unless a largest number of steps is a whole number from 1 to MAX_STEPS."""
    whole("max_steps", max_steps, most=MAX_STEPS)


def check_ill_posed(ill_posed: Any) -> None:
    """Raise InputError unless ``ill_posed`` is a known word."""
    choice("ill_posed", ill_posed, ILL_POSED)


def check_increasing(key: str, values: Any, most: int | None = None) -> tuple[int, ...]:
    """Increasing whole numbers from 1 (to ``most``), or InputError."""
    allowed = "one or more increasing whole numbers" + (" >= 1 are allowed" if most is None else f" from 1 to {most} are allowed")
    try:
        numbers = tuple(values)
    except TypeError:
        raise InputError(key, values, allowed) from None
    if not numbers or not all(is_whole(v, most=most) for v in numbers) or any(b <= a for a, b in pairwise(numbers)):
        raise InputError(key, values, allowed)
    return tuple(int(v) for v in numbers)

"""The potential of a scene, built once."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from ..errors import InputError
from .potential import Potential

if TYPE_CHECKING:
    from ..scene import Scene


def potential_of(scene: Scene) -> Potential:
    """The potential of a scene, built once: scenes that differ only in what is done with it share one.

    Raises
    ------
    InputError
        While the mesh of the scene is still to be chosen.
    """
    require_elements(scene)
    return _potential_of(_plain(scene))


@lru_cache(maxsize=256)
def _plain(scene: Scene) -> Scene:
    """The scene without what makes no difference to its potential."""
    electric = scene.electricity
    if electric is None and scene.electric is not None and scene.electric.ends:  # elements end there
        electric = scene.electric.plain(scene.scales)
    ratio = scene.radius_to_thickness if scene.bending else 1.0  # no equilibrium knows it
    plain = {"radius_to_thickness": ratio, "scales": None, "electric": electric}
    return scene.replace(title="", follow_borders=_following(scene), run=None, analysis=type(scene.analysis)(), **plain)


def _following(scene: Scene) -> bool | None:
    """What decides whether elements follow borders: nothing where there are none."""
    return False if scene.bodies and scene.follow_borders is False else (scene.follows_zones or None)


def require_elements(scene: Scene) -> None:
    if scene.open:
        accuracy = getattr(scene.mesh, "accuracy", None)
        advice = "no mesh is chosen for it here; give elements and degree, or the scene of a branch from inflate, pressurize, trace or run"
        raise InputError("mesh.accuracy", accuracy, advice)


@lru_cache(maxsize=64)
def _potential_of(scene: Scene) -> Potential:
    if not scene.follows:
        return Potential(scene)
    from .contact import ContactPotential
    from .following import WrinklingPotential

    return ContactPotential(scene) if scene.bodies else WrinklingPotential(scene)

"""Remarks on numbers that were most often meant in other units: loads that no membrane of this size and stiffness holds, and scales of a
sheet that is no membrane.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..quantities import heading, readable
from .run import Run

if TYPE_CHECKING:
    from ..physics.scales import Scales
    from .value import Scene

#: a load is remarkable from so many times what the sheet holds: a pressure of mu T over its size, a stretch in all directions
BEYOND = 100.0
#: what loads are compared with
_LIMIT = {
    "pressure": "the modulus times the thickness over the size of the membrane",
    "volume": "the size of the membrane, in all directions",
    "center_height": "the size of the membrane",
}


#: thickness over radius of what is called a membrane, from films of 10 um on balloons of 10 m to a disc as thick as its radius
_THIN, _THICK = 1e-6, 1.0
#: shear moduli in Pa, from gels that hardly stand to steel
_SOFT, _STIFF = 1.0, 2e11
#: radii in m, from a cell to a balloon for the stratosphere
_SMALL, _LARGE = 1e-7, 200.0


def remarks_on_scales(scales: Scales | None) -> tuple[str, ...]:
    """What is remarkable about the scales of a scene: numbers in mm, in MPa or without a unit that are read as m and Pa."""
    if scales is None:
        return ()
    meant = 'numbers of [scales] without a unit are in m and Pa; "25 mm" and "0.4 MPa" are understood too'
    told = []
    if not _SMALL <= scales.radius <= _LARGE:
        told.append(f"scales.radius = {scales.radius:g} m")
    if not _THIN <= scales.thickness / scales.radius <= _THICK:
        told.append(
            f"scales.thickness = {scales.thickness:g} m is {scales.thickness / scales.radius:.3g} times the radius, {scales.radius:g} m"
        )
    if not _SOFT <= scales.shear_modulus <= _STIFF:
        told.append(f"scales.shear_modulus = {scales.shear_modulus:g} Pa")
    return (f"{'; '.join(told)}: no membrane is known like this; {meant}",) if told else ()


def remarks_on_loads(scene: Scene) -> tuple[str, ...]:
    """What is remarkable about the loads that a scene asks for, one remark at most.

    Pressures are compared with mu T over the size of the membrane, where it is thickest and stiffest; volumes and heights with the membrane
    blown up to 100 times its size.
    """
    if scene.run is None or scene.open:
        return ()
    size = _size(scene)
    limits = {"pressure": BEYOND * _stiffness(scene) / size, "volume": BEYOND**3 * size**3, "center_height": BEYOND * size}
    for key, quantity, load in _loads(scene.run):
        if abs(load) > limits.get(quantity, np.inf):
            return (_remark(scene, key, quantity, load),)
    return ()


def remarks_on_direction(scene: Scene) -> tuple[str, ...]:
    """A remark on a branch that sets out away from the only volume at which it is to end: it arrives there if it turns back, or never."""
    run = scene.run
    if run is None or run.control != "arc-length" or run.over or run.start is None or set(run.until or {}) != {"volume"}:
        return ()
    end, way = (run.until or {})["volume"], run.direction or 1
    if (end - run.start) * way >= 0:
        return ()
    begun = f"it sets out from V = {run.start:g}, away from run.until.volume = {end:g}"
    return (f"run.direction = {way}: {begun}; {-way} sets out the other way",)


def _loads(run: Run) -> Iterator[tuple[str, str, float]]:
    """Key, quantity and value of the loads at the ends of a run."""
    quantity = run.quantity or ("volume" if run.control == "arc-length" else "")
    for key in ("start", "stop"):
        if (load := getattr(run, key)) is not None:
            yield key, quantity, load
    if run.values is not None:
        yield "values", quantity, max(run.values, key=abs)
    yield from (("until", name, load) for name, load in (run.until or {}).items())


def _remark(scene: Scene, key: str, quantity: str, load: float) -> str:
    value = "" if scene.scales is None else f", that is {readable(quantity, load, scene.scales)}"
    how = 'units = "si" and [scales]' if scene.scales is None else 'units = "si"'
    return (
        f"run.{key} = {load:g} is {heading(quantity)} = {load:g}{value}: over {BEYOND:g} times {_LIMIT[quantity]}; "
        f"if the number is meant in SI units, give the scene file {how}"
    )


def _size(scene: Scene) -> float:
    """The larger of radius and half height of the membrane at rest."""
    R, Z = scene.mesh.position(scene.mesh.breakpoints())
    return float(max(np.max(R), np.ptp(Z) / 2))


def _stiffness(scene: Scene) -> float:
    """Thickness times modulus, over those of the scales, where it is largest."""
    s = scene.mesh.breakpoints()
    R, Z = scene.mesh.position(s)
    factors = [factor.at(R, Z, s) for factor in (scene.thickness, scene.modulus) if factor is not None]
    return float(np.max(np.prod(factors, axis=0))) if factors else 1.0

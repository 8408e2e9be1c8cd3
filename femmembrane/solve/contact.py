"""A membrane that comes to a source, in whose singular field no branch goes on, or to an edge of a body too sharp for its elements."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, cast

import numpy as np

from ..errors import SolveError, Status
from ..physics.obstacles import Arc
from ..potential import Array, Evaluation, Potential
from ..scene.toml import item_path

if TYPE_CHECKING:
    from ..potential.contact import ContactEvaluation, ContactPotential

#: distance to a source, over the size of the membrane, at which it counts as touching it
TOUCHING = 1e-3
#: distance to a source, over the size of the membrane, below which a branch that cannot be followed has run into it
NEARBY = 50 * TOUCHING
#: length of an element over the radius of an edge below which nodes do not jump around it
_SHORT = 0.125


def touches_source(distance: float, unit: float) -> str:
    """That a membrane touches a source; empty where it does not.

    Parameters
    ----------
    distance : float
        Smallest distance to a source.
    unit : float
        Size of the membrane.
    """
    return f"the membrane came within {TOUCHING * unit:g} of a source" if distance < TOUCHING * unit else ""


class Watch:
    """Whether a membrane touches a source along its way: the distance is measured again only where it may have come near since."""

    def __init__(self) -> None:
        self._measured: tuple[Potential, Array, float] | None = None

    def touches(self, potential: Potential, x: Array) -> str:
        """:func:`touches_source` of a state.

        Parameters
        ----------
        potential : Potential
        x : ndarray, shape (n_free,)
        """
        space = potential.space
        if self._measured is not None and self._measured[0] is potential:
            _, before, distance = self._measured
            if distance - space.reach * math.hypot(*potential.largest(x - before)) >= TOUCHING * space.unit:
                return ""
        distance = potential.distance_to_sources(x)
        self._measured = potential, x, distance
        return touches_source(distance, space.unit)


def stopped_by_source(error: SolveError, distance: float, unit: float) -> tuple[Status, str] | None:
    """Status and message of a failure next to a source; None where no source is near.

    Parameters
    ----------
    error : SolveError
        Why the branch could not be followed.
    distance : float
        Smallest distance to a source at the last state.
    unit : float
        Size of the membrane.
    """
    if distance >= NEARBY * unit:
        return None
    return Status.DIPOLE_CONTACT, f"{error}; the membrane is within {distance:.2g} of a source"


def coarse_at_edge(evaluation: Evaluation, *, edges: Literal["touched", "near", "all"] = "touched") -> str:
    """That elements are too long for a rounded edge of a body beside them, and what may help; empty where they are not.

    On an edge of radius r a force F pushes a node off with F/r for each length, and the elements beside it, of length h, draw it back with
    about F r/h^2. Where they are longer than the radius nodes jump from one side of the edge to the other.

    Parameters
    ----------
    evaluation : Evaluation
    edges : {"touched", "near", "all"}
        Which edges count: those that the membrane lies on, those within an element of it, or those of all bodies. Of edges that it does not
        lie on no more is said than how long elements are.
    """
    potential = evaluation.potential
    scene, space = potential.scene, potential.space
    ends = space.ends
    (R, Z), (u, _, w, _) = space.mesh.position(ends), space.displacement(evaluation.x, ends)
    rho, eta = R + u, Z + w
    length = np.hypot(np.diff(rho), np.diff(eta))
    found: list[tuple[float, float, int]] = []
    bodies = cast("ContactPotential", potential).bodies_at(evaluation.factor) if potential.obstacles else ()
    for k, body in enumerate(bodies):
        for piece in body.pieces():
            if not (isinstance(piece, Arc) and piece.side > 0 and piece.radius > 0):
                continue
            away = np.hypot(rho - piece.center[0], eta - piece.center[1]) - piece.radius
            near = np.minimum(away[:-1], away[1:]) < length
            if edges == "touched":
                near &= _lies_on(evaluation, piece, length)
            longest = float(length[near | (edges == "all")].max(initial=0.0))
            found.append((longest / piece.radius, piece.radius, k))
    ratio, radius, k = max(found, default=(0.0, 1.0, 0))
    if not ratio > _SHORT:
        return ""
    own = k < len(scene.obstacles)
    name = item_path("obstacle", k, len(scene.obstacles)) if own else "source.body"
    number = next((n for n in ("rounding", "radius") if own and getattr(scene.obstacles[k], n, None) == radius), "")
    what = f"{name}.{number} = {radius:.3g}" if number else f"{name}: a radius of {radius:.3g}"
    needed = math.ceil(ratio / _SHORT * space.n_elements)
    where = {"touched": "which the membrane lies on", "near": "next to the membrane", "all": "where the membrane may come to it"}[edges]
    may = "" if edges == "touched" else "may "
    return (
        f"elements {may or 'are '}{'be ' if may else ''}too long for the edge of the {bodies[k].label()} ({what}), {where}: "
        f"they are up to {ratio * radius:.3g} long, and nodes jump around an edge on which they are longer than an eighth of its radius; "
        f"{needed} even ones are shorter where the membrane is stretched as here, or fewer that are graded (mesh.ratio, mesh.radii)"
        f"{', or those of this mesh on a larger radius' if own else ''}"
    )


def _lies_on(evaluation: Evaluation, edge: Arc, length: Array) -> bool:
    """Whether a body holds nodes of the membrane on an edge, or within an element of it."""
    contact = cast("ContactEvaluation", evaluation)
    potential = cast("ContactPotential", evaluation.potential)
    rho, eta = (values[contact.held] for values in potential.positions(evaluation.x, evaluation.factor))
    element = potential.space.locate(potential.parameters[contact.held])[0]
    away = np.abs(np.hypot(rho - edge.center[0], eta - edge.center[1]) - edge.radius)
    return bool((away < length[element]).any())

"""A membrane that comes to a source, in whose singular field no branch goes on."""

from __future__ import annotations

import math

from ..errors import SolveError, Status
from ..potential import Array, Potential

#: distance to a source, over the size of the membrane, at which it counts as touching it
TOUCHING = 1e-3
#: distance to a source, over the size of the membrane, below which a branch that cannot be followed has run into it
NEARBY = 50 * TOUCHING


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

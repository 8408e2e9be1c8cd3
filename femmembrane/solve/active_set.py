"""Which nodes rigid bodies hold: sets are tried until one is right.

On a set of held nodes equilibrium is a smooth problem, solved as any other. The next set follows from its solution
(:meth:`.ContactPotential.judged`): a node that has come into a body is held, one that the body would have to pull is let go. This is a
semismooth Newton method, which ends after a few sets. Where sets would repeat, one node at a time changes, the worst one first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, cast

import numpy as np

from ..errors import Status
from ..potential import Array, Potential

if TYPE_CHECKING:
    from ..potential.contact import ContactEvaluation, ContactPotential, Mask
    from .newton import NewtonResult

#: sets of held nodes that are tried
MOST_SETS = 60


class Once(Protocol):
    """A corrector under a control on a smooth potential."""

    def __call__(self, potential: Potential, *, x: Array, pressure: float) -> NewtonResult: ...


def settled(once: Once, potential: Potential, x: Array, pressure: float, magnetic: float) -> NewtonResult:
    """Where a corrector ends on the set of held nodes that is right there.

    Parameters
    ----------
    once : callable
        The corrector on a fixed set.
    potential : Potential
        With bodies.
    x, pressure : ndarray, float
        Guess.
    magnetic : float
        Factor on the magnetic energy.
    """
    before = cast("ContactPotential", potential)
    x = np.ascontiguousarray(x, dtype=float)
    with np.errstate(over="ignore", invalid="ignore"):
        held = before.pressed(x, pressure, magnetic)
    tried: set[bytes] = set()
    spent = 0
    while True:
        tried.add(held.tobytes())
        result = once(before.holding(held), x=x, pressure=pressure)
        spent += result.iterations
        result.iterations = spent
        if result.status is not Status.CONVERGED:
            return result
        evaluation = cast("ContactEvaluation", result.evaluation)
        following = before.judged(evaluation._raw, evaluation.gaps, result.pressure)
        if (following == held).all():
            return result
        if following.tobytes() in tried:
            following = _one_changed(before, evaluation, held, following)
        if len(tried) == MOST_SETS or following.tobytes() in tried:
            result.status = Status.NOT_CONVERGED
            return result
        x, pressure, held = result.x, result.pressure, following


def _one_changed(potential: ContactPotential, evaluation: ContactEvaluation, held: Mask, following: Mask) -> Mask:
    """A set with one node changed: that which is deepest in a body, or else that which a body pulls most."""
    changed = np.flatnonzero(following != held)
    entering = changed[~held[changed]]
    worst = entering[evaluation.gaps.gap[entering].argmin()] if entering.size else changed[evaluation.forces[changed].argmin()]
    new = held.copy()
    new[worst] = not held[worst]
    return new

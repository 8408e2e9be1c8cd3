"""A run that goes on, on another mesh: where it stands, and the path that predicts its next state."""

from __future__ import annotations

import numpy as np

from ..discretization.space import Space, transferred
from ..errors import SolveError, Status
from ..potential import Array, Potential
from ..solve.branch import BranchProblem, tangent_at
from ..solve.continuation import BranchPoint
from ..solve.newton import NewtonResult
from ..solve.state import Predictor, State, joined


def carried_path(path: Predictor, space: Space, onto: Space) -> Predictor:
    """A path in another space."""
    return Predictor(list(path.sigma), [_carried(z, space, onto) for z in path.point], [_carried(z, space, onto) for z in path.slope])


def _carried(z: Array, space: Space, onto: Space) -> Array:
    return joined(transferred(space, z[:-1], onto), float(z[-1]))


def state_there(result: NewtonResult) -> State:
    """The state that was found on another mesh.

    Raises
    ------
    SolveError
        Where there is none.
    """
    if result.status is not Status.CONVERGED:
        raise SolveError("the equilibrium was not found on the mesh that its accuracy needs", status=result.status)
    return State.of(result)


def carried_point(point: BranchPoint, state: State, potential: Potential, onto: Potential) -> BranchPoint:
    """The point of a branch whose state was found in another space."""
    tangent = _carried(point.tangent, potential.space, onto.space)
    return tangent_at(onto, state, BranchProblem(onto).point(state, tangent, point.sigma))


def goes_alike(a: BranchPoint, b: BranchPoint, kinds: list[str]) -> bool:
    """Whether both lie on one side of the folds of all these quantities, so that none is lost or found twice between them."""
    return all(np.sign(a.rate(kind)) == np.sign(b.rate(kind)) for kind in kinds)

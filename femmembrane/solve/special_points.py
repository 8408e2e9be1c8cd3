"""Points of a branch where other branches cross: the number of negative eigenvalues changes there though no quantity turns."""

from __future__ import annotations

from dataclasses import replace

from ..errors import SolveError
from .continuation import BranchPoint, Point
from .segment import Located, Segment
from .wellposed import ill_posed


def branches_crossing(segment: Segment[BranchPoint]) -> int:
    """The least number of other branches that cross on a segment.

    A limit point changes the number of negative eigenvalues of K by one, and so does a crossing. Where the equations are ill-posed the
    number is that of the mesh's own short waves, and no more than its parity is looked at.
    """
    if segment.leaving:
        return 0
    turns = len(segment.folds("limit_point"))
    before, after = (point.state.evaluation.negative for point in (segment.a, segment.b))
    if before == after and turns % 2 == 0:  # asked first, for whether a state is ill-posed may need finer meshes
        return 0
    if any(ill_posed(segment.problem.potential, point.state.evaluation) for point in (segment.a, segment.b)):
        signs = [point.state.factor.determinant_sign() for point in (segment.a, segment.b)]
        return int((signs[0] != signs[1]) != (turns % 2 == 1))
    surplus = abs(after - before) - turns
    return surplus if surplus > 0 else surplus % 2


def branch_points(segment: Segment[BranchPoint], depth: int = 12) -> list[Located[BranchPoint]]:
    """The points of a segment where other branches cross, as many as could be located; several are told apart by halving the segment."""
    number = branches_crossing(segment)
    if number < 2 or not depth:
        found = branch_point(segment) if number % 2 else None
        return [] if found is None else [found]
    try:
        middle = segment.at(0.5)
    except SolveError:
        return []
    halves = Segment(segment.problem, segment.a, middle), Segment(segment.problem, middle, segment.b)
    return [point for half in halves for point in branch_points(half, depth - 1)]


def branch_point(segment: Segment[Point]) -> Located[Point] | None:
    """The point where another branch crosses: the bordered matrix of the arc-length system is singular, though no quantity turns.

    Bisection on the sign of its determinant, which a fold does not change; None when that sign does not change either.
    """
    problem, sign = segment.problem, segment.problem.determinant_sign
    if sign(segment.a) * sign(segment.b) > 0:
        return None
    low, high = segment.narrowed(sign, 0.0, 1.0)
    point, a, b = segment.at(low), segment.a, segment.b
    # at the crossing itself the equations have two tangents; that of this branch is known from its points on both sides
    tangent = (1 - low) * a.tangent + low * b.tangent
    tangent = tangent / problem.norm(tangent)
    point = replace(point, tangent=tangent, dual=problem.dual(tangent))
    return Located("branch_point", point, (high - low) * segment.length + segment.spread(low, high))

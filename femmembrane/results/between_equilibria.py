"""States between the equilibria of a branch, interpolated or solved for, and a branch with states evenly spread along it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..checks import number, only, switch, whole
from ..errors import InputError, SolveError, Status
from ..solve.between import across
from ..solve.branch import BranchProblem
from ..solve.controls import CONTROLS
from ..solve.newton import correct
from ..solve.state import State, joined
from ..threads import one_thread
from .curve import Array, BranchCurve, Piece
from .equilibrium import Equilibrium, recorded

if TYPE_CHECKING:
    from .branch import Branch

#: more crossings than a branch can have
MOST_CROSSINGS = 10**6


@one_thread
def state_at(branch: Branch, places: Mapping[str, float | None], refine: bool, crossing: int) -> Equilibrium:
    """See :meth:`.Branch.at`."""
    _of_one_scene(branch)
    quantity, value = only("at", places, "exactly one of volume, pressure and center_height is allowed")
    value, crossing, refine = number(quantity, value), whole("crossing", crossing, least=-MOST_CROSSINGS), switch("refine", refine)
    refine = refine or branch.scene.follows  # elements, and the nodes that a body holds, are not those between two states
    curve = branch.curve
    found = list(curve.crossings(quantity, value))
    if not found:
        raise InputError(quantity, value, _reach(curve, quantity))
    if not -len(found) <= crossing < len(found):
        raise InputError("crossing", crossing, f"the branch passes this {CONTROLS[quantity].words} {len(found)} time(s), counted from 0")
    piece, share = found[crossing]
    if share in (0.0, 1.0):
        return (piece.a if share == 0.0 else piece.b).equilibrium
    if not piece.resolved and not refine:
        message = "the branch is not resolved between the equilibria there; refine=True is allowed, or a run with smaller steps"
        raise InputError(quantity, value, message)
    return _held(piece, share, quantity, value) if refine else _between(piece, share, quantity, value)


def _of_one_scene(branch: Branch) -> None:
    if branch.over:
        message = "branches of one scene are allowed; vary finds equilibria at values of a number"
        raise InputError("over", branch.over, message)


def _reach(curve: BranchCurve, quantity: str) -> str:
    low, high = curve.span(quantity)
    return f"the branch goes from {low:.6g} to {high:.6g}" if low < high else f"the branch has {low:.6g} only"


def _between(piece: Piece, share: float, quantity: str, value: float) -> Equilibrium:
    """The interpolated state that has the value itself: its volume is that of its shape, which differs a little from the cubic."""
    state = interpolated(piece, share)
    if quantity != "volume":  # the cubic of a linear function of the unknowns is that of the state
        return state
    step = 1e-6
    for _ in range(6):
        off = state.volume - value
        slope = (piece.arc.places(np.array([share + step]))[0, 0] - piece.arc.places(np.array([share - step]))[0, 0]) / (2 * step)
        if off == 0 or not abs(off) < abs(slope):
            break
        share = min(max(share - off / slope, 0.0), 1.0)
        state = interpolated(piece, share)
    return state


def interpolated(piece: Piece, share: float) -> Equilibrium:
    """The state on the cubic at a share of a piece."""
    scene, potential = piece.a.equilibrium.scene, piece.a.equilibrium.potential
    z = piece.arc.unknowns(share)
    x, pressure = z[:-1], float(z[-1])
    return recorded(scene, potential, x, pressure, potential.evaluate(x, pressure), Status.INTERPOLATED)


def _held(piece: Piece, share: float, quantity: str, value: float) -> Equilibrium:
    potential = piece.a.equilibrium.potential
    z = piece.arc.unknowns(share)
    result = correct(potential, CONTROLS[quantity].at(value), z[:-1], float(z[-1]))
    if result.status is not Status.CONVERGED:
        raise SolveError(f"the equilibrium at {CONTROLS[quantity].words} {value:.9g} was not found", status=result.status)
    state = State.of(result)
    off = BranchProblem(potential).norm(joined(state.x - z[:-1], state.pressure - float(z[-1])))
    if off > piece.arc.length:
        message = f"what was found at {CONTROLS[quantity].words} {value:.9g} is not the state between these equilibria"
        raise SolveError(message, status=Status.NOT_CONVERGED)
    return _solved(piece, state)


def _solved(piece: Piece, state: State) -> Equilibrium:
    own = state.evaluation
    scene, potential = piece.a.equilibrium.scene, piece.a.equilibrium.potential
    if potential.follows:
        scene, potential = scene.bordered(own.potential.scene.borders), own.potential
    return recorded(scene, potential, own.x, state.pressure, own, Status.CONVERGED, state.residual, state.iterations)


@one_thread
def resampled(branch: Branch, count: int, refine: bool) -> Branch:
    """See :meth:`.Branch.resample`."""
    _of_one_scene(branch)
    count, refine = whole("count", count, least=2), switch("refine", refine) or branch.scene.follows
    runs = [run for run in branch.curve.runs if run]
    if len(runs) < len(branch.curve.runs) or count < 2 * len(runs):
        raise InputError("count", count, f"two for each part of the branch between snaps are needed, {2 * max(len(runs), 1)} or more")
    lengths = np.array([sum(piece.arc.length for piece in run) for run in runs])
    shares = _portions(lengths, count)
    states: list[Equilibrium] = []
    starts: list[int] = []
    for run, number_of_states in zip(runs, shares, strict=True):
        starts.append(len(states))
        states += _spread(run, number_of_states, refine)
    jumps = tuple(replace(jump, index=start, landing=states[start]) for jump, start in zip(branch.jumps, starts[1:], strict=False))
    return replace(branch, equilibria=tuple(states), memory=None, jumps=jumps)


def _portions(lengths: Array, count: int) -> list[int]:
    """How many states each part has: two, and the rest by length."""
    rest = count - 2 * len(lengths)
    ideal = rest * lengths / lengths.sum()
    portions = np.floor(ideal).astype(int)
    order = np.argsort(portions - ideal, kind="stable")
    portions[order[: rest - int(portions.sum())]] += 1
    return [2 + int(k) for k in portions]


def _spread(run: Sequence[Piece], count: int, refine: bool) -> list[Equilibrium]:
    ends = np.cumsum([piece.arc.length for piece in run])
    places = np.linspace(0.0, ends[-1], count)
    inner = []
    for place in places[1:-1]:
        piece = run[k := min(int(np.searchsorted(ends, place)), len(run) - 1)]
        share = 1.0 - float(ends[k] - place) / piece.arc.length
        inner.append(_across(piece, share) if refine else interpolated(piece, share))
    return [run[0].a.equilibrium, *inner, run[-1].b.equilibrium]


def _across(piece: Piece, share: float) -> Equilibrium:
    """The equilibrium across the curve at a share of a piece."""
    state = across(BranchProblem(piece.a.equilibrium.potential), piece.arc, share)
    if state is None:
        raise SolveError("an equilibrium between two neighbours was not found", status=Status.NOT_CONVERGED)
    return _solved(piece, state)

"""An equilibrium of a tension field on elements that end where zones of wrinkles begin and end.

The relaxed energy is smooth on both sides of the border of a zone, and its second derivative jumps there. A border inside an element costs
digits at any degree; where it is an end of elements, errors fall as for a smooth problem. So the ends are moved to the borders, and the
equilibrium is corrected there at the same load, until neither moves. An end that misses its border by d adds an error of order d^3 to what
the energy decides: the strains are off by d along a length of d.

Where a border is, the strain across beyond natural width is zero. That strain follows from the forces at the end
(:mod:`~femmembrane.stability.end_strains`), so that borders are exact to the same order as energies. Its zero is found by secants.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..discretization.curve import Curve
from ..discretization.meridian import on_borders as moved_mesh
from ..discretization.space import space_of_scene
from ..errors import InputError, SolveError, Status
from ..potential import Array, Potential, potential_of
from ..results.equilibrium import Equilibrium, recorded
from ..results.zones import KINDS
from ..scene import Scene
from ..solve.controls import Control
from ..solve.finer_space import solved_in
from ..solve.newton import NewtonResult
from ..solve.state import State
from ..solve.wellposed import ill_posed
from ..stability.end_strains import strains_at_ends
from ..stability.profile import profile_at
from ..stability.zones import find_zones

#: a move after which borders are at rest, over the length of the meridian: the next one would be smaller by some orders
_ARRIVED = 1e-8
#: most rounds of moving the ends, and most times that the zones themselves are looked for anew
_ROUNDS, _FRESH = 8, 3
#: zones narrower than this part of the meridian are left out, which changes the energy by its third power
_NARROW = 1e-5
#: bits of the kinds of zones, of the strains along both directions
_BITS = (2, 1)


#: from a potential and a state in another space to the equilibrium that it stands for
Solve = Callable[[Potential, State], NewtonResult]


def holding(held: Control) -> Solve:
    """What is solved for while a control holds its load."""
    return lambda onto, state: solved_in(onto, held, state.evaluation.potential, state.x, state.pressure, damped=True)


@dataclass(frozen=True, eq=False)
class OnBorders:
    """A state on its own mesh.

    Attributes
    ----------
    scene : Scene
        With elements that end on the borders.
    state : State
    moves : tuple of float
        How far the borders moved in each round, at most, over the length of the meridian.
    """

    scene: Scene
    state: State
    moves: tuple[float, ...]


def put_on_borders(base: Scene, scene: Scene, state: State, solve: Solve) -> OnBorders:
    """The equilibrium that a state stands for, at the same load, on elements that end on the borders of its zones.

    Parameters
    ----------
    base : Scene
        With the mesh whose ends are moved: as many elements.
    scene : Scene
        The scene of the state; of another mesh, or the same.
    state : State
    solve : callable
        Finds the equilibrium in another space from the state in one, with the same load: see :func:`holding`.

    Raises
    ------
    InputError
        Where the mesh has fewer elements than the membrane has zones.
    SolveError
        Where the equilibrium is lost on the way, or the borders do not come to rest.
    """
    moves: list[float] = []
    for _ in range(_FRESH):
        borders = _Borders.of(scene, state)
        if base is scene and borders.at_ends(scene):
            break
        while True:
            wanted = moved_mesh_of(base, borders.places)
            if wanted is not scene:
                scene, state = _solved(wanted, state, solve)
            if not len(borders.places):
                break
            step = borders.next(scene, state)
            moves.append(step)
            if step <= _ARRIVED:
                scene, state = _solved(moved_mesh_of(base, borders.places), state, solve)
                break
            if borders.rounds >= _ROUNDS:
                raise SolveError("the borders of its zones do not come to rest; more elements may help", status=Status.NOT_CONVERGED)
        if borders.kept and borders.explain(scene, state):
            break
    return OnBorders(scene, state, tuple(moves))


def moved_mesh_of(base: Scene, places: Array) -> Scene:
    """The scene with the mesh whose ends nearest to the places are moved there."""
    mesh = base.mesh
    fixed = (*(mesh.corners() if isinstance(mesh, Curve) else ()), *base.element_ends)
    moved = moved_mesh(mesh, places, fixed)
    return base if moved is mesh else base.replace(mesh=moved)


def _solved(scene: Scene, state: State, solve: Solve) -> tuple[Scene, State]:
    found = solve(potential_of(scene), state)
    if found.status is not Status.CONVERGED:
        raise SolveError("the equilibrium was not found on elements that end at the borders of its zones", status=found.status)
    return scene, State.of(found, state.iterations)


class _Borders:
    """Borders under way: where they are, which strain is zero there, and what was found before."""

    def __init__(self, places: Array, codes: Sequence[int], length: float) -> None:
        self.places, self.codes, self.length = places, list(codes), length
        self.rounds, self.kept = 0, True
        self._before: tuple[Array, Array] | None = None

    @classmethod
    def of(cls, scene: Scene, state: State) -> _Borders:
        """Those of a state, without zones that are too narrow to count and without borders at ends that no one moves."""
        zones = find_zones(scene, state.x, state.pressure, "mechanical").zones
        ends = state.evaluation.potential.space.ends
        length = float(ends[-1] - ends[0])
        known = [(KINDS.index(zone.kind), zone.s) for zone in zones if zone.s[1] - zone.s[0] > _NARROW * length]
        codes, places = [known[0][0]], []
        for code, (start, _) in known[1:]:
            if code != codes[-1]:
                codes.append(code)
                places.append(start)
        return cls(np.array(places), codes, length)

    def at_ends(self, scene: Scene) -> bool:
        """Whether all of them are ends of elements already."""
        return bool(np.isin(self.places, space_of_scene(scene).ends).all())

    def next(self, scene: Scene, state: State) -> float:
        """Move the borders towards where their strains are zero; the largest move, over the length of the meridian."""
        self.rounds += 1
        space = state.evaluation.potential.space
        which = [_BITS.index(_BITS[0] if (a ^ b) & _BITS[0] else _BITS[1]) for a, b in zip(self.codes[:-1], self.codes[1:], strict=True)]
        at = np.array([int(np.abs(space.ends - place).argmin()) for place in self.places])
        beyond = strains_at_ends(state.evaluation.potential, state.evaluation, state.pressure)
        values = (beyond[which, 1, at - 1] + beyond[which, 0, at]) / 2  # they agree to the order of the forces
        slopes = self._slopes(scene, state, which, at, values, beyond)
        if self._before is not None:
            places, old = self._before
            moved = np.abs(self.places - places) > 0
            secant = np.divide(values - old, self.places - places, out=slopes.copy(), where=moved)
            slopes = np.where(secant * slopes > 0, secant, slopes)  # one of the wrong sign is round-off
        self._before = self.places, values
        step = -values / slopes
        nearest = np.minimum(space.sizes[at - 1], space.sizes[at])
        step = np.clip(step, -nearest / 2, nearest / 2)
        self.places = self.places + step
        return float(np.abs(step).max()) / self.length

    def _slopes(self, scene: Scene, state: State, which: list[int], at: NDArray[np.int64], values: Array, beyond: Array) -> Array:
        """Of the strains at the borders, each on the side on which its zone still goes on: by a parabola over the element there."""
        space = state.evaluation.potential.space
        wrinkled_before = [bool(self.codes[k] & _BITS[bit]) for k, bit in enumerate(which)]
        back = np.array([before == bool(value < 0) for before, value in zip(wrinkled_before, values, strict=True)])
        element = np.where(back, at - 1, at)
        size = np.where(back, -1.0, 1.0) * space.sizes[element]  # the way from the border to the other end of that element
        found = profile_at(scene, state.x, state.pressure, space.ends[at] + size / 2).beyond
        middle = np.stack(found or ())[which, np.arange(at.size)]
        other = beyond[which, np.where(back, 0, 1), element]
        straight = (middle - values) / (size / 2)
        curved = (4 * middle - 3 * values - other) / size
        return np.where(curved * straight > 0, curved, straight)  # on the axis the strain is no number

    def explain(self, scene: Scene, state: State) -> bool:
        """Whether in the middle of each element the membrane is what the zones say."""
        space = state.evaluation.potential.space
        middles = (space.ends[1:] + space.ends[:-1]) / 2
        codes = np.array(self.codes)[np.searchsorted(self.places, middles)]
        beyond = np.stack(profile_at(scene, state.x, state.pressure, middles).beyond)  # type: ignore[arg-type]
        return bool((np.dot(_BITS, beyond < 0) == codes).all())


def equilibrium_on_borders(eq: Equilibrium, held: Control) -> Equilibrium:
    """See :meth:`.Equilibrium.on_borders`."""
    scene = eq.scene
    if not scene.tension_field:
        allowed = "true is needed: without it the energy feels no border of a zone"
        raise InputError("effects.tension_field", False, allowed)
    if eq.status.ill_posed:
        raise SolveError(f"the equilibrium is {eq.status.value}, and what a mesh finds depends on the mesh", status=eq.status)
    state = State(eq.state, eq.pressure, eq.potential.evaluate(eq.state, eq.pressure), eq.iterations, 0.0, eq.residual, 0.0)
    found = put_on_borders(scene, scene, state, holding(held))
    if found.scene is scene:
        return eq
    state = found.state
    bad = ill_posed(state.evaluation.potential, state.evaluation)
    status = Status.CONVERGED if bad is None else bad.status
    there = state.evaluation.potential, state.x, state.pressure, state.evaluation
    return recorded(found.scene, *there, status, state.residual, state.iterations, eq.gas)

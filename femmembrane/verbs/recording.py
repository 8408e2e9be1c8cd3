"""Between the solvers' states and the public records."""

from __future__ import annotations

import time
from collections.abc import Callable

from ..errors import InputError, SolveError, Status
from ..potential import Potential
from ..results.records import Equilibrium
from ..scene import Scene
from ..solve.controls import Gas, PressureControl, VolumeControl
from ..solve.newton import correct
from ..solve.state import State
from ..solve.wellposed import ill_posed
from ..stability.judge import judge
from ..stability.verdict import Verdict

OnStep = Callable[[int, int, Equilibrium], None]


def resume(potential: Potential, start: Equilibrium) -> State:
    """The solver's state of a recorded equilibrium, of this scene or of one with the same mesh and degree."""
    if not isinstance(start, Equilibrium):
        raise InputError("start", start, "an Equilibrium is allowed")
    if start.state.shape != (potential.space.n_free,):
        raise InputError("start", start, f"an equilibrium with {potential.space.n_free} unknowns (the same mesh and degree) is allowed")
    result = correct(potential, VolumeControl(start.volume), start.state, start.pressure)
    if result.status is not Status.CONVERGED:
        result = correct(potential, PressureControl(start.pressure), start.state, start.pressure)
    if result.status is not Status.CONVERGED:
        raise SolveError("the start is no equilibrium of this scene", status=result.status)
    return State.of(result)


def record(
    scene: Scene,
    potential: Potential,
    state: State,
    previous: Equilibrium | None = None,
    clock: float | None = None,
    gas: Gas | None = None,
) -> Equilibrium:
    """The public record of a solver's state, with the verdicts that the scene asks for.

    ``previous`` lends its modes as starting guesses; ``clock`` is the time at which work on this state began.
    """
    verdicts: dict[tuple[str | None, int], Verdict] = {}
    asked: list[tuple[str | None, int]] = [(control, 0) for control in scene.analysis.stability]
    for control, n in [*asked, *((None, n) for n in scene.analysis.azimuthal_modes)]:
        guess = previous.verdict(control, azimuthal=n).coefficients if previous is not None else None
        verdicts[control, n] = judge(potential, state.x, state.pressure, state.evaluation, control, n, guess=guess)
    bad = ill_posed(potential, state.evaluation)
    coefficients = state.x.copy()
    coefficients.flags.writeable = False
    return Equilibrium(
        pressure=float(state.pressure),
        volume=state.evaluation.volume,
        center_height=potential.space.center_height(state.x),
        elastic_energy=state.evaluation.elastic_energy,
        magnetic_energy=state.evaluation.magnetic_energy,
        residual=float(state.residual),
        iterations=state.iterations,
        status=state.status if bad is None else bad.status,
        scene=scene,
        state=coefficients,
        load_energy=state.evaluation.load_energy,
        seconds=0.0 if clock is None else time.perf_counter() - clock,
        gas=gas,
        _verdicts=verdicts,
    )

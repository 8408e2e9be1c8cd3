"""How a simple eigenvalue moves with numbers of the scene: dlambda/dm = phi.(dK/dm) phi for a mode of mass one.

K changes with the number, and with the state that follows it. Under volume control K phi - q V' = lambda M phi with the multiplier q, and
the derivative of -2 q V'.phi is added; a gas of compliance c is the case q = -(V'.phi)/c, where c changes as well.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..checks import choice, whole
from ..errors import InputError, SolveError, Status
from ..potential import Array, Evaluation, Potential, potential_of
from ..scene import MAX_WAVES, Scene
from ..solve.sensitivity import Rates, Sensitive, differentiated
from .azimuthal import azimuthal_verdict
from .azimuthal_operator import azimuthal_operator
from .bending import bending_form
from .spectrum import Pencil
from .verdict import CONTROLS, axisymmetric_pencil, axisymmetric_verdict

if TYPE_CHECKING:
    from ..results.equilibrium import Equilibrium
    from ..results.verdict import Verdict

#: distance of two eigenvalues, relative to the larger one, at which they count as one
_SIMPLE = 1e-6

#: scene and state after number k has changed by t
State = tuple[Scene, Array, float]
Moved = Callable[[int, float], State]
#: potential and evaluation of such a state, with the same nodes held by bodies
At = Callable[[State], tuple[Potential, Evaluation]]


def eigenvalue_rates(
    eq: Equilibrium,
    known: Sensitive,
    rates: Rates,
    control: str | None,
    azimuthal: int,
    moved: Moved,
    step: Callable[[int], float],
    at: At,
) -> Array:
    """Derivatives of the smallest eigenvalue with respect to the numbers, shape (m,).

    Parameters
    ----------
    eq : Equilibrium
    known, rates : Sensitive, Rates
        The numbers, and how the state moves with them.
    control : {"pressure", "volume", "gas"}, optional
        What is held against axisymmetric perturbations.
    azimuthal : int
        Number of waves around the axis.
    moved, step, at : callable
        The state after a small change of a number, how small, and the potential and its evaluation there.

    Raises
    ------
    InputError
        For arguments that do not go together, and for an eigenvalue that is not simple.
    SolveError
        Where there is no smallest eigenvalue.
    """
    n = whole("azimuthal", azimuthal, least=0, most=MAX_WAVES)
    evaluation = eq.potential.evaluate(eq.state, eq.pressure)
    if n:
        if control is not None:
            raise InputError("control", control, f"n = {n} waves do not change the volume: leave the control out")
        verdict = _known(azimuthal_verdict(eq.potential, eq.state, eq.pressure, n))
        operator = azimuthal_operator(eq.potential, eq.state, eq.pressure, n)
        require_simple(operator.pencil(), verdict)
        mode = operator.reduced(np.asarray(verdict.coefficients))
        return _differences(lambda state: azimuthal_operator(at(state)[0], *state[1:], n).pencil(), mode, verdict, known, moved, step)
    choice("control", control, CONTROLS)
    gas = eq.enclosed if control == "gas" else None
    if control == "gas" and gas is None:
        raise InputError("control", control, "no gas holds this equilibrium; a scene with chamber=fm.Chamber(volume=...) has one")
    compliance = None if gas is None else gas.compliance(eq.volume)
    verdict = _known(axisymmetric_verdict(eq.potential, evaluation, control or "", compliance=compliance))
    pencil = _pencil(eq.potential, evaluation, control, compliance)
    require_simple(pencil, verdict)
    mode, q = pencil.normalised(evaluation.reduced(np.asarray(verdict.coefficients)))[0], 0.0
    gradient = evaluation.reduced(evaluation.volume_gradient)
    along = float(gradient @ mode)
    if control == "volume":
        rest = pencil.stiffness(mode) - verdict.smallest_eigenvalue * pencil.times_mass(mode)
        q = float(rest @ gradient / (gradient @ gradient))
    extra = np.zeros(len(known.names))
    if gas is not None and compliance is not None:
        q = -along / compliance
        room = rates.volume + known.through("chamber.volume")
        push = rates.pressure + known.through("chamber.atmosphere")
        total, absolute = eq.volume + gas.chamber, eq.pressure + gas.atmosphere
        extra = -((along / compliance) ** 2) * (room / absolute - total / absolute**2 * push)
    if eq.scene.bodies:  # elements move with the borders of contact, and their mass with them

        def row_at(state: State) -> Array:
            there = at(state)[1]
            return 2 * q * there.reduced(there.volume_gradient)

        return extra + _differences(lambda state: _pencil(*at(state), "pressure", None), mode, verdict, known, moved, step, row_at)
    if evaluation.spring is not None or eq.scene.bending:
        return extra + _by_differences(mode, q, verdict, known, moved, step)
    state, pressure, numbers = known.form(eq.state, eq.pressure, mode, q)
    return extra + state @ rates.x + pressure * rates.pressure + numbers


def _known(verdict: Verdict) -> Verdict:
    if verdict.coefficients is None or not np.isfinite(verdict.smallest_eigenvalue):
        raise SolveError(f"no smallest eigenvalue has a derivative here: {verdict.reason}", status=Status.NOT_RESOLVED)
    return verdict


def require_simple(pencil: Pencil, verdict: Verdict) -> None:
    value = verdict.smallest_eigenvalue
    if pencil.count(value + _SIMPLE * abs(value) + verdict.error) > 1:
        raise InputError("of", "eigenvalue", f"a simple eigenvalue is allowed: {value:.9g} is a multiple one, which has no derivative")


def _pencil(potential: Potential, evaluation: Evaluation, control: str | None, compliance: float | None) -> Pencil:
    constraint = None if control == "pressure" else evaluation.volume_gradient
    form = bending_form(potential, evaluation.x)
    return axisymmetric_pencil(potential, evaluation, None if form is None else form.at(0), constraint, compliance or 0.0)


def _differences(
    pencil_at: Callable[[State], Pencil],
    mode: Array,
    verdict: Verdict,
    known: Sensitive,
    moved: Moved,
    step: Callable[[int], float],
    row_at: Callable[[State], Array] | None = None,
) -> Array:
    """Of phi.(K - lambda M) phi, less the product of a row with phi, at the fixed mode and eigenvalue: nothing is solved for."""
    value = verdict.smallest_eigenvalue
    mode = pencil_at(moved(0, 0.0)).normalised(mode)[0]

    def form(k: int, t: float) -> Array:
        state = moved(k, t)
        pencil = pencil_at(state)
        found = mode @ pencil.stiffness(mode) - value * (mode @ pencil.times_mass(mode))
        return np.array(found if row_at is None else found - row_at(state) @ mode)

    return np.array([float(differentiated(lambda t, k=k: form(k, t), step(k))) for k in range(len(known.names))])  # type: ignore[misc]


def _by_differences(mode: Array, q: float, verdict: Verdict, known: Sensitive, moved: Moved, step: Callable[[int], float]) -> Array:
    """With a total charge or bending: of phi.K phi - 2 q V'.phi at the fixed mode."""

    def form(k: int, t: float) -> Array:
        scene, x, pressure = moved(k, t)
        potential = potential_of(scene)
        evaluation, bending = potential.evaluate(x, pressure), bending_form(potential, x)
        bent = 0.0 if bending is None else bending.at(0).energy(mode)
        return np.array(evaluation.inner(mode, mode) + bent - 2 * q * float(evaluation.volume_gradient @ mode))

    return np.array([float(differentiated(lambda t, k=k: form(k, t), step(k))) for k in range(len(known.names))])  # type: ignore[misc]

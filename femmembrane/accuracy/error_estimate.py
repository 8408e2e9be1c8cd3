"""Errors of the numbers of an equilibrium, estimated by solving again in a finer space.

Values converge at order 2 p for elements of degree p, so that values of degree p + 1 are exact beside them. The difference of the two is
the error, to a few digits. The idea is Bank & Weiser's hierarchical one, with the nonlinear problem solved whole. This fails in a wrinkled
tension field where borders of zones lie inside elements: the errors that they cause fall with the size of the elements alone. There the
finer space has quartered elements of one degree more. It holds again where every border is an end of elements (:mod:`.borders`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..discretization.space import transferred
from ..errors import Status
from ..potential import Array, Evaluation, Potential, potential_of
from ..results.contact import contact_of
from ..results.error_estimate import ErrorEstimate, from_numbers
from ..results.verdict import Verdict
from ..scene import MAX_DEGREE, Scene
from ..solve.banded import negative_among
from ..solve.controls import CONTROLS, control_kind
from ..solve.finer_space import FAR, finer_scene, moved, solved_in, solved_past_folds
from ..solve.newton import NewtonResult
from ..solve.state import State, displacement, distance
from ..solve.state_resolution import unresolved
from ..solve.wellposed import ill_posed
from ..stability.profile import profile_at
from ..stability.spectrum import SpectrumError
from ..stability.verdict import axisymmetric_verdict
from ..stability.zones import on_its_borders

#: degrees whose stresses, from slopes that are recovered, are about as good as those of one degree more
_RECOVERED = (2, 3)


def estimate_errors(potential: Potential, x: Array, pressure: float, control: str, verdicts: Mapping[str, Verdict]) -> ErrorEstimate:
    """Estimate the discretisation errors of a state.

    Parameters
    ----------
    potential : Potential
    x, pressure : ndarray, shape (n_free,), float
        The state.
    control : {"volume", "pressure", "center_height"}
        What is held.
    verdicts : mapping of "pressure" and "volume" to Verdict
        Those of the state.

    Raises
    ------
    InputError
        For an unknown control.
    """
    control = control_kind(control).name
    evaluation = potential.evaluate(x, pressure)
    values = _numbers(potential, x, pressure, evaluation, verdicts)
    scene, method = finer_space(potential, evaluation, pressure)
    bad = ill_posed(potential, evaluation)
    if bad is not None:
        return _without(control, values, method, f"not estimated: {bad}, and what a mesh finds depends on the mesh")
    if lost := unresolved(potential, State(x, pressure, evaluation, 0, 0.0, 0.0, 0.0)):
        return _without(control, values, method, f"not estimated: {lost}")
    finer = potential_of(scene)
    found, reason = same_state(finer, potential, x, pressure, evaluation, control)
    if found is None:
        return _without(control, values, method, reason)
    own = found.evaluation.potential  # its elements may follow borders
    better, reason = _verdicts(own, found.evaluation, potential, verdicts)
    errors = _errors(control, values, _numbers(own, found.evaluation.x, found.pressure, found.evaluation, better))
    if potential.scene.degree in _RECOVERED and finer.scene.degree == potential.scene.degree + 1:
        errors |= _stress_errors(values, own, found, control)
    errors["displacement"] = finer.space.unit * distance(finer, found.x, transferred(potential.space, x, finer.space))
    return from_numbers(control, values, errors, method, reason)


def _numbers(potential: Potential, x: Array, pressure: float, evaluation: Evaluation, verdicts: Mapping[str, Verdict]) -> dict[str, float]:
    return {
        "pressure": float(pressure),
        "volume": evaluation.volume,
        "center_height": potential.space.center_height(x),
        "elastic_energy": evaluation.elastic_energy,
        "magnetic_energy": evaluation.magnetic_energy,
        "load_energy": evaluation.load_energy,
        "electric_energy": evaluation.electric_energy,
        "energy": evaluation.energy,
        "lambda_pressure": float(verdicts["pressure"].smallest_eigenvalue),
        "lambda_volume": float(verdicts["volume"].smallest_eigenvalue),
        "displacement": potential.space.unit * displacement(potential, x),
        **_end_stresses(potential, x, pressure),
    }


def finer_space(potential: Potential, evaluation: Evaluation, pressure: float) -> tuple[Scene, str]:
    """The scene on finer elements, and in words."""
    scene = potential.scene
    better = finer_scene(scene)
    inside = ""
    if scene.tension_field and (evaluation.stress <= 0).any() and not on_its_borders(scene, evaluation.x, pressure):
        inside = "wrinkled zones"
    elif potential.obstacles and not all(zone.followed and zone.smooth for zone in contact_of(evaluation).zones):
        inside = "contact, or edges of bodies,"
    if inside:
        better = scene.replace(mesh=scene.mesh.refined().refined(), degree=min(scene.degree + 1, MAX_DEGREE))
        what = f"quartered elements of degree {better.degree}, for borders of {inside} inside elements: rough"
    else:
        what = f"elements of degree {better.degree}" if better.degree > scene.degree else f"halved elements of degree {better.degree}"
    return better, f"hierarchical: against the same load on {what}"


def same_state(
    finer: Potential, potential: Potential, x: Array, pressure: float, evaluation: Evaluation, control: str
) -> tuple[NewtonResult | None, str]:
    """The equilibrium in the finer space that the state stands for, or None with the reason why it was not found."""
    kind = CONTROLS[control]
    held = kind.at(kind.value(potential.space, x, pressure, evaluation.volume))
    start = transferred(potential.space, x, finer.space)
    side = _side(potential, evaluation, control)

    def judged(result: NewtonResult) -> str:
        if result.status is not Status.CONVERGED:
            return f"the finer space has no equilibrium near at this {kind.words}"
        if _side(result.evaluation.potential, result.evaluation, control) != side:
            return "in the finer space the state lies beyond a fold"
        if (change := moved(finer, result.x, start)) > FAR:
            return f"the membrane of the finer space is {change:.0%} off, so the mesh is too coarse for an estimate"
        bad = ill_posed(result.evaluation.potential, result.evaluation)
        return f"in the finer space {bad}" if bad is not None else ""

    result = solved_in(finer, held, potential, x, pressure)
    if judged(result):
        state = State(x, pressure, evaluation, 0, 0.0, 0.0, 0.0)
        result = solved_past_folds(finer, held, potential, state)
    reason = judged(result)
    return (None, f"not estimated: {reason}") if reason else (result, "")


def _side(potential: Potential, evaluation: Evaluation, control: str) -> int:
    """On which side of a fold of the control a state lies: its number of negative directions, which changes there."""
    if control == "center_height":
        return 0
    constraint = evaluation.volume_gradient if control == "volume" else None
    return negative_among(evaluation, constraint)


def _verdicts(
    finer: Potential, evaluation: Evaluation, potential: Potential, verdicts: Mapping[str, Verdict]
) -> tuple[dict[str, Verdict], str]:
    """Verdicts in the finer space, started from the modes of the coarser one, and what went wrong."""
    better, reason = {}, ""
    for control, verdict in verdicts.items():
        mode = verdict.coefficients
        guess = None if mode is None else transferred(potential.space, mode, finer.space)
        try:
            better[control] = axisymmetric_verdict(finer, evaluation, control, guess)
        except SpectrumError as error:  # an eigenvalue that cannot be proved must not end the estimate of the rest
            better[control] = Verdict(None, np.nan, np.nan, control, 0, None, str(error))
        if not np.isfinite([verdict.smallest_eigenvalue, better[control].smallest_eigenvalue]).all():
            reason = f"no error of the eigenvalue under {control} control: it could not be proved to be the smallest"
    return better, reason


def _stress_errors(values: Mapping[str, float], finer: Potential, found: NewtonResult, control: str) -> dict[str, float]:
    """Errors of the stresses at the ends, against elements of one degree more than the finer ones."""
    kind = CONTROLS[control]
    x = found.evaluation.x
    held = kind.at(kind.value(finer.space, x, found.pressure, found.evaluation.volume))
    finest = potential_of(finer_scene(finer.scene))
    best = solved_in(finest, held, finer, x, found.pressure)
    if best.status is not Status.CONVERGED:
        return dict.fromkeys(("stress_first", "stress_last"), np.nan)
    stresses = _end_stresses(best.evaluation.potential, best.evaluation.x, best.pressure)
    return {name: values[name] - stresses[name] for name in stresses}


def _end_stresses(potential: Potential, x: Array, pressure: float) -> dict[str, float]:
    """Meridional stresses at the first and the last end."""
    first, last = profile_at(potential.scene, x, pressure, potential.space.ends[[0, -1]]).mechanical[0]
    return {"stress_first": float(first), "stress_last": float(last)}


def _errors(control: str, values: Mapping[str, float], better: Mapping[str, float]) -> dict[str, float]:
    return {name: 0.0 if name == control else value - better[name] for name, value in values.items()}


def _without(control: str, values: Mapping[str, float], method: str, reason: str) -> ErrorEstimate:
    return from_numbers(control, values, dict.fromkeys(values, np.nan), method, reason)

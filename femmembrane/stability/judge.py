"""One question for every class of perturbations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ..errors import InputError, Status
from ..potential import Array, Evaluation, Potential
from ..scene import MAX_WAVES
from ..solve.controls import PressureControl, VolumeControl
from ..solve.finer import solved_finer
from .azimuthal import azimuthal_verdict
from .spectrum import SpectrumError
from .verdict import CONTROLS, Verdict, axisymmetric_verdict

#: size of an eigenvalue below which its discretisation error is estimated before its sign is believed
SMALL = 1e-2


def judge(
    potential: Potential,
    x: Array,
    pressure: float,
    evaluation: Evaluation,
    control: str | None,
    azimuthal: int,
    *,
    guess: Array | None = None,
    compliance: float | None = None,
) -> Verdict:
    """Verdict on a state against axisymmetric perturbations under a control, or against n >= 1 waves around the axis.

    Raises
    ------
    InputError
        When neither or both of control and azimuthal are given, or one is unknown.
    """
    if isinstance(azimuthal, bool) or not isinstance(azimuthal, (int, np.integer)) or not 0 <= azimuthal <= MAX_WAVES:
        raise InputError("azimuthal", azimuthal, f"a whole number from 0 to {MAX_WAVES} is allowed")
    if azimuthal and control is not None:
        raise InputError("control", control, f"n = {azimuthal} waves do not change the volume: leave the control out")
    if not azimuthal and control is None:
        raise InputError("control", control, "one of " + ", ".join(CONTROLS) + " is allowed, or azimuthal=1, 2, ...")
    ask = partial(_verdict, control=control, azimuthal=int(azimuthal), compliance=compliance)
    try:
        verdict = ask(potential, x, pressure, evaluation, guess=guess)
    except SpectrumError as error:  # one verdict that cannot be proved must not cost the run that asked for it
        return Verdict(None, np.nan, np.nan, control, int(azimuthal), None, f"not decided: {error}")
    if abs(verdict.smallest_eigenvalue) < SMALL:  # never for NaN
        verdict = _with_discretisation_error(verdict, potential, x, pressure, ask)
    return verdict


def _verdict(
    potential: Potential,
    x: Array,
    pressure: float,
    evaluation: Evaluation,
    *,
    control: str | None,
    azimuthal: int,
    compliance: float | None,
    guess: Array | None = None,
) -> Verdict:
    if azimuthal or control is None:
        return azimuthal_verdict(potential, x, pressure, azimuthal, guess)
    return axisymmetric_verdict(potential, evaluation, control, guess, compliance)


def _with_discretisation_error(verdict: Verdict, potential: Potential, x: Array, pressure: float, ask: Callable[..., Verdict]) -> Verdict:
    """Solve again on elements of one degree more (or half the size): by how much an eigenvalue near zero moves decides its sign."""
    # held is what stays regular where this eigenvalue vanishes
    held = PressureControl(pressure) if verdict.control == "volume" else VolumeControl(potential.evaluate(x, pressure).volume)
    finer, result = solved_finer(held, potential, x, pressure)
    if result.status is not Status.CONVERGED:
        return verdict
    try:
        better = ask(finer, result.x, result.pressure, result.evaluation)
    except SpectrumError:
        return verdict
    error = verdict.error + abs(better.smallest_eigenvalue - verdict.smallest_eigenvalue)
    if not abs(verdict.smallest_eigenvalue) <= error:
        return replace(verdict, error=error)
    reason = f"marginal: the smallest eigenvalue {verdict.smallest_eigenvalue:.3g} is zero within its discretisation error {error:.1g}"
    return replace(verdict, stable=None, error=error, reason=reason)

"""One question for every class of perturbations."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..potential import Array, Evaluation, Potential
from .azimuthal import azimuthal_verdict
from .verdict import CONTROLS, Verdict, axisymmetric_verdict


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
    if isinstance(azimuthal, bool) or not isinstance(azimuthal, (int, np.integer)) or azimuthal < 0:
        raise InputError("azimuthal", azimuthal, "a whole number >= 0 is allowed")
    if azimuthal:
        if control is not None:
            raise InputError("control", control, f"n = {azimuthal} waves do not change the volume: leave the control out")
        return azimuthal_verdict(potential, x, pressure, int(azimuthal), guess)
    if control is None:
        raise InputError("control", control, "one of " + ", ".join(CONTROLS) + " is allowed, or azimuthal=1, 2, ...")
    return axisymmetric_verdict(potential, evaluation, control, guess, compliance)

"""One question for every class of perturbations."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..checks import whole
from ..discretization.space import transferred
from ..errors import InputError
from ..potential import Array, Evaluation, Potential
from ..results.verdict import Verdict
from ..scene import ALL, MAX_WAVES
from ..solve.finer_space import counterpart
from .azimuthal import azimuthal_verdict
from .azimuthal_operator import on_set
from .mode_resolution import small_eigenvalue
from .spectrum import SpectrumError
from .verdict import CONTROLS, against, axisymmetric_verdict, in_words
from .wave_unknowns import mode_in
from .worst_waves import worst_waves

#: an eigenvalue this many times the part of it that the mesh does not resolve has a sign that is believed at once
_CLEAR = 2.0
#: part of the way that is left after a step of the slowest convergence that is counted on
_SLOWEST = 0.1
#: what is said of a compression that a finer space contradicts
_FALSE = "stress is compressive on this mesh alone, not on finer elements"
#: discretisation errors are estimated to a factor of two or so: this many times the estimate contain them
SAFETY = 3.0
#: part of a small eigenvalue below which an eigenvalue counts as zero: for a marginal state of this mesh, and for a mesh on which zero
#: means zero
_ZERO = 0.1


def checked_verdict(
    potential: Potential,
    x: Array,
    pressure: float,
    evaluation: Evaluation,
    control: str | None,
    azimuthal: int | str,
    *,
    guess: Array | None = None,
    compliance: float | None = None,
) -> Verdict:
    """Verdict on a state against axisymmetric perturbations under a control, or against n >= 1 waves around the axis; with "all" against
    the number of waves that has the lowest eigenvalue, see :mod:`.worst_waves`.

    Raises
    ------
    InputError
        When neither or both of control and azimuthal are given, or one is unknown.
    """
    if azimuthal == ALL:
        return _worst_verdict(potential, x, pressure, evaluation, control)
    if azimuthal:
        azimuthal = whole("azimuthal", azimuthal, least=0, most=MAX_WAVES)
        if control is not None:
            raise InputError("control", control, f"n = {azimuthal} waves do not change the volume: leave the control out")
    elif control is None:
        raise InputError("control", control, "one of " + ", ".join(CONTROLS) + " is allowed, or azimuthal=1, 2, ...")
    asked = Question(control, int(azimuthal), compliance)
    try:
        verdict = _verdict(asked, potential, x, pressure, evaluation, guess)
    except SpectrumError as error:  # a verdict that cannot be proved must not end the run that asked for it
        return Verdict(None, np.nan, np.nan, control, asked.azimuthal, None, f"not decided: {error}")
    value = abs(verdict.smallest_eigenvalue)
    if value < max(small_eigenvalue(potential.space), _CLEAR * verdict._unresolved):  # never for NaN
        verdict = _with_discretisation_error(verdict, potential, pressure, evaluation, asked)
        if np.isinf(verdict._unresolved):
            verdict = replace(verdict, reason=f"{verdict.reason}; {_FALSE}")
    return verdict


def _worst_verdict(potential: Potential, x: Array, pressure: float, evaluation: Evaluation, control: str | None) -> Verdict:
    first = checked_verdict(potential, x, pressure, evaluation, control, 1)
    if first.coefficients is None:  # shorter waves are worse without end, or nothing can be said
        return first
    # where a body is touched without a force the lower bound counts
    touched = evaluation.touched()
    searched = potential if touched is None else on_set(potential, touched[0])
    try:
        n, limit = worst_waves(searched, x, pressure, evaluation if touched is None else touched[0])
    except SpectrumError as error:
        return Verdict(None, np.nan, np.nan, control, 1, None, f"not decided: {error}")
    verdict = first if n == 1 else checked_verdict(potential, x, pressure, evaluation, control, n)
    found = f"n = {n} has the lowest eigenvalue found among 1 to {limit} waves; with more, tension and bending outweigh what drives them"
    return replace(verdict, reason=f"{verdict.reason}; {found}")


class Question(NamedTuple):
    """Against what a state is judged."""

    control: str | None
    azimuthal: int
    compliance: float | None


def _verdict(
    asked: Question, potential: Potential, x: Array, pressure: float, evaluation: Evaluation, guess: Array | None = None
) -> Verdict:
    control, azimuthal, compliance = asked
    if azimuthal or control is None:
        return azimuthal_verdict(potential, x, pressure, azimuthal, guess)
    return axisymmetric_verdict(potential, evaluation, control, guess, compliance)


def _with_discretisation_error(verdict: Verdict, potential: Potential, pressure: float, evaluation: Evaluation, asked: Question) -> Verdict:
    """Solve again on elements of one degree more (or half the size). The change of an eigenvalue decides whether its sign is known.

    The sign may stay open although the mesh is too coarse to call the eigenvalue zero. A still finer space is then tried, and its answer is
    reported.
    """
    value, unknown = verdict.smallest_eigenvalue, _CLEAR * verdict._unresolved
    better = _finer_verdict(verdict, potential, pressure, evaluation, asked, 1)
    if better is None:  # there is nothing to compare with: the unresolved part stands for the error
        return verdict if abs(value) >= unknown else _open(verdict, unknown)
    change = abs(better.smallest_eigenvalue - value)
    error, hidden = verdict.error + SAFETY * change, abs(value) <= verdict._unresolved
    zero = _ZERO * small_eigenvalue(potential.space)
    if abs(value) > error and (not hidden or error <= zero):
        return replace(verdict, error=error)
    if abs(value) <= error and min(abs(value), error) <= zero:
        reason = f"marginal: the smallest eigenvalue {value:.3g} is zero within its discretisation error {error:.1g}"
        return replace(verdict, stable=None, error=error, reason=reason)
    best = _finer_verdict(verdict, potential, pressure, evaluation, asked, 2)
    if best is None:
        return _open(verdict, error)
    rest = abs(best.smallest_eigenvalue - better.smallest_eigenvalue)
    # changes that shrink slowly add up like a geometric series, and they may still grow where convergence has hardly begun
    error = verdict.error + 2 * SAFETY * max(change / max(1 - rest / change, _SLOWEST) if change else 0.0, change + rest)
    if abs(value) > error and np.isfinite(verdict._unresolved):
        return replace(verdict, error=error)
    left = best.error + SAFETY**2 * rest
    if abs(best.smallest_eigenvalue) <= left:
        return _open(verdict, max(error, SAFETY * abs(best.smallest_eigenvalue - value)))
    numbers = f"{best.smallest_eigenvalue:.6g} on finer elements; {value:.3g} on this mesh, which does not resolve it"
    stable = best.smallest_eigenvalue > 0
    reason = in_words(stable, best.negative_directions, against(verdict.control, verdict.azimuthal, potential.electric), numbers)
    return replace(best, stable=stable, error=left, reason=reason, _shape=verdict._shape, _unresolved=verdict._unresolved)


def _finer_verdict(
    verdict: Verdict, potential: Potential, pressure: float, evaluation: Evaluation, asked: Question, level: int
) -> Verdict | None:
    """The same question about the same state in a finer space, the mode interpolated; None where there is no answer."""
    # the volume is held, unless this eigenvalue vanishes at volume folds
    at_fold = verdict.control == "volume" and abs(verdict.smallest_eigenvalue) < small_eigenvalue(potential.space)
    found = counterpart(potential, evaluation, pressure, "pressure" if at_fold else "volume", level)
    if found is None:
        return None
    finer = found.evaluation.potential
    try:
        better = _verdict(asked, finer, found.evaluation.x, found.pressure, found.evaluation)
    except SpectrumError:
        return None
    if better.coefficients is None:
        return None
    spaces, n = (finer.space, potential.space), verdict.azimuthal
    mode = mode_in(spaces[0], n, better.coefficients, spaces[1]) if n else transferred(spaces[0], better.coefficients, spaces[1])
    return replace(better, coefficients=mode)


def _open(verdict: Verdict, error: float) -> Verdict:
    """The verdict where the mesh leaves the sign open."""
    error = max(error, abs(verdict.smallest_eigenvalue))
    what = "the sign of the smallest eigenvalue"
    number = f"{verdict.smallest_eigenvalue:.3g}, known within {error:.1g}" if np.isfinite(error) else f"{verdict.smallest_eigenvalue:.3g}"
    advice = "refine it where stretches change fastest (a graded mesh), or take more elements or a higher degree"
    return replace(verdict, stable=None, error=error, reason=f"not resolved: the mesh leaves {what} open ({number}); {advice}")

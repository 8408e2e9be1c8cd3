"""Verdicts on stability against axisymmetric perturbations, and their words."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..checks import choice
from ..discretization.space import Space
from ..errors import InputError
from ..physics.electric import Electric
from ..potential import Array, Evaluation, Potential
from ..results.verdict import Shape, Verdict
from ..solve.wellposed import IllPosed, apparent, ill_posed, stress_free
from .bending import Bending, bending_form, widened
from .mode_resolution import unresolved_axisymmetric
from .rigid_motions import pencil_of
from .spectrum import Pencil, SmallestEigenvalue, smallest_of

CONTROLS = ("pressure", "volume", "gas")
#: what is said of a membrane without any tension
SLACK_ALL_OVER = "the membrane is slack all over, its energy is zero, the least that there is, and its shape is not determined"


def axisymmetric_verdict(
    potential: Potential, evaluation: Evaluation, control: str, guess: Array | None = None, compliance: float | None = None
) -> Verdict:
    """Verdict against axisymmetric perturbations under pressure, volume or gas control.

    Parameters
    ----------
    compliance : float, optional
        Of an enclosed gas, -dV/dP at constant amount: required for "gas". Its pressure falls as the volume grows, which stiffens the
        second variation by V' V'^T/compliance: between pressure control (infinitely compliant) and volume control (rigid).

    Raises
    ------
    InputError
        For an unknown control, or "gas" without the gas.
    """
    if control not in CONTROLS:
        choice("control", control, CONTROLS)
    form = bending_form(potential, evaluation.x)
    bending = None if form is None else form.at(0)
    shown = apparent(potential, evaluation)
    if shown is not None and (bad := unbounded_below(potential, evaluation, bending)) is not None:
        if slack_all_over(evaluation):
            return slack_verdict(control, 0)
        return short_wave_verdict(f"{bad}, and the spectrum has no lower bound under refinement", bad.confirmed, control, 0)
    if control == "gas" and compliance is None:
        raise InputError("gas", None, 'a verdict under "gas" needs the gas: pass gas=Gas(amount=..., chamber=...)')
    constraint = None if control == "pressure" else evaluation.volume_gradient
    soft = compliance or 0.0 if control == "gas" else 0.0

    def smallest(held: Evaluation) -> SmallestEigenvalue:
        """With the nodes held that bodies hold in an evaluation."""
        start = None if guess is None else held.reduced(guess)
        found = smallest_of(axisymmetric_pencil(potential, held, bending, constraint, soft), start)
        found.mode = held.expanded(found.mode)
        return found

    shape = partial(mode_shape, potential.space)
    if (touched := evaluation.touched()) is not None:
        free, held = touched
        return between(smallest(held), smallest(free), against(control, 0, potential.electric), control, 0, shape)
    found = smallest(evaluation)
    # compression that finer meshes do not confirm says that the mesh cannot be trusted
    doubtful = shown is not None and not (bending is not None and bending.positive)
    unresolved = np.inf if doubtful else unresolved_axisymmetric(evaluation, found.mode, bending)
    return verdict_from(found, against(control, 0, potential.electric), control, 0, shape, unresolved)


def between(held: SmallestEigenvalue, free: SmallestEigenvalue, among: str, control: str | None, n: int, shape: Shape) -> Verdict:
    """The verdict where a body touches and does not press: perturbations may lift the membrane off it, and not push it in.

    The least second variation among these lies between those with the touched points free and held. Waves around the axis go both ways
    from a circle that is touched, so that they need a lift of the whole circle beside them: with the circle free they bound from below.
    """
    bounds = f"a body is touched without a force: the smallest eigenvalue is between {free.value:.6g} and {held.value:.6g}"
    if free.value > free.error:
        reason = f"stable: energy rises under all {among}; {bounds}"
        return Verdict(True, free.value, free.error, control, n, free.negative, reason, free.mode, shape, 0.0)
    if held.value < -held.error:
        reason = f"unstable: energy falls in {held.negative} direction(s) among {among}; {bounds}"
        return Verdict(False, held.value, held.error, control, n, held.negative, reason, held.mode, shape, 0.0)
    return Verdict(None, free.value, held.value - free.value, control, n, None, f"open among {among}: {bounds}", free.mode, shape, 0.0)


def axisymmetric_pencil(
    potential: Potential, evaluation: Evaluation, bending: Bending | None, constraint: Array | None, compliance: float
) -> Pencil:
    """K - lambda M of axisymmetric perturbations, with bending if given."""
    band, mass, kd = evaluation.band, evaluation.reduced_mass(potential.mass), potential.space.half_bandwidth
    constraint = None if constraint is None else evaluation.reduced(constraint)
    if bending is not None:
        wide = bending.half_bandwidth
        band = widened(band, kd, wide) + evaluation.reduced_form(bending.band, wide)
        mass, kd = widened(mass, kd, wide), wide
    spring = None if evaluation.spring is None else evaluation.reduced(evaluation.spring)
    return pencil_of(band, mass, kd, constraint, compliance, potential.rigid, spring)


def unbounded_below(potential: Potential, evaluation: Evaluation, bending: Bending | None) -> IllPosed | None:
    """Where axisymmetric waves have ever lower eigenvalues the shorter they are; with bending only where a field leaves no stiffness along
    the meridian, which bending does not replace.
    """
    shown = apparent(potential, evaluation)
    if shown is None or (bending is not None and bending.positive and not shown.pulled):
        return None
    return ill_posed(potential, evaluation)


def slack_all_over(evaluation: Evaluation) -> bool:
    """Whether a tension field carries no tension anywhere: many shapes have its relaxed energy then, which is the least."""
    return evaluation.potential.scene.tension_field and stress_free(evaluation)


def slack_verdict(control: str | None, n: int) -> Verdict:
    """The verdict on a membrane that is slack all over."""
    return Verdict(None, np.nan, np.nan, control, n, None, f"marginal: {SLACK_ALL_OVER}")


def short_wave_verdict(where: str, confirmed: bool, control: str | None, n: int) -> Verdict:
    """The verdict where shorter and shorter waves have lower and lower eigenvalues. It is open if only the scene's own mesh shows this."""
    wrinkling = " (wrinkling)" if n else ""
    kind = f"short-wave unstable{wrinkling}" if confirmed else "not confirmed: short-wave unstable if the membrane is as this mesh shows it"
    return Verdict(False if confirmed else None, np.nan, np.nan, control, n, None, f"{kind}: {where}")


#: what each control holds, in words
_HELD = {"pressure": "at constant pressure", "volume": "of constant volume", "gas": "with a constant amount of gas"}


def against(control: str | None, n: int, electric: Electric | None = None) -> str:
    """A class of perturbations in words; with what is held of voltage and charge, which waves around the axis do not tell apart."""
    if n:
        return f"perturbations with {n} wave{'s' if n > 1 else ''} around the axis"
    held = _HELD[control or "volume"]
    if electric is not None:
        held += {"voltage": ", the voltage held,", "total_charge": ", the total charge held,"}.get(electric.load, "")
    return f"axisymmetric perturbations {held}"


def verdict_from(found: SmallestEigenvalue, among: str, control: str | None, n: int, shape: Shape, unresolved: float) -> Verdict:
    """The verdict that follows from a smallest eigenvalue, for a class of perturbations named in words."""
    stable = None if abs(found.value) <= found.error else found.value > 0
    if stable is None:
        reason = f"marginal: the smallest eigenvalue among {among} is zero within {found.error:.1g}"
    else:
        reason = in_words(stable, found.negative, among, f"{found.value:.6g}")
    return Verdict(stable, found.value, found.error, control, n, found.negative, reason, found.mode, shape, unresolved)


def in_words(stable: bool, negative: int | None, among: str, value: str) -> str:
    """The reason of a verdict with a sign."""
    if stable:
        return f"stable: energy rises under all {among} (smallest eigenvalue {value})"
    return f"unstable: energy falls in {negative} direction(s) among {among} (smallest eigenvalue {value})"


def mode_shape(space: Space, mode: Array) -> dict[str, Array]:
    """Reference radius and displacements at the nodes from the coefficients of an axisymmetric mode."""
    s = space.node_parameters()
    u, _, w, _ = space.evaluate(mode, s)
    return {"r": space.mesh.position(s)[0], "u": u, "w": w}

"""Stability against perturbations with n waves around the axis: wobbling, tipping sideways, wrinkling.

The lowest eigenvalues of the operator of :mod:`.azimuthal_operator` decide, unless a stress is compressive: then ever shorter waves have
ever lower eigenvalues, and none is the lowest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..checks import choice, whole
from ..discretization.space import Space
from ..errors import InputError
from ..potential import Array, Evaluation, Potential
from ..results.verdict import Verdict
from ..solve.pull_in import shears_in
from ..solve.wellposed import UNCONFIRMED, compressed, ill_posed, interval, least_stress
from ..threads import one_thread
from .acoustic import elliptic_in_plane, supporting_all
from .azimuthal_operator import AzimuthalOperator, azimuthal_operator, check_waves, on_set
from .bending import Bending
from .mode_resolution import unresolved, unresolved_bending, unresolved_stress
from .second_variation import pairs_of
from .spectrum import SmallestEigenvalue, lowest_of, smallest_of
from .verdict import against, between, short_wave_verdict, slack_all_over, slack_verdict, verdict_from
from .wave_unknowns import azimuthal_shape, wave_unknowns

#: smallest eigenvalue at a located onset, over the terms that cancel in it
_AT_ONSET = 1e-5


@one_thread
def azimuthal_eigenvalue(potential: Potential, x: Array, pressure: float, n: int, guess: Array | None = None) -> SmallestEigenvalue:
    """Smallest eigenvalue against n waves around the axis, proved by inertia to be the smallest.

    ``guess`` is the ``mode`` of a neighbouring state at the same n. See :func:`azimuthal_verdict` for states with a compressive stress,
    where no eigenvalue has a meaning.

    Raises
    ------
    InputError, SpectrumError
    """
    return _smallest(azimuthal_operator(potential, x, pressure, n), guess)


def _smallest(operator: AzimuthalOperator, guess: Array | None) -> SmallestEigenvalue:
    if not operator.band.shape[1]:
        raise InputError("mesh.elements", 1, "one linear element has no unknowns with waves around the axis; two, or degree 2, are allowed")
    pencil = operator.pencil()
    found = smallest_of(pencil, pencil.block_iterations() if guess is None else operator.reduced(guess))
    return found if operator.reduction is None else replace(found, mode=operator.expanded(found.mode))


def onset_mode(potential: Potential, x: Array, pressure: float, n: int) -> tuple[NDArray[np.int64], Array]:
    """The numbers of (a, c, b) at the nodes, and the coefficients of the mode with n waves around the axis that sets in at a state.

    Raises
    ------
    InputError
        Where none sets in.
    SpectrumError
    """
    operator = azimuthal_operator(potential, x, pressure, n)
    found = _smallest(operator, None)
    if not abs(found.value) <= _AT_ONSET * operator.pencil().noise(found.mode)[0]:
        message = f"states with {n} wave(s) around the axis are not computed from there, where none set in: the smallest eigenvalue is"
        raise InputError("start", "azimuthal_onset", f"{message} {found.value:.3g}; a special point of a branch of this scene is allowed")
    return operator.numbering, found.mode


@one_thread
def lowest_eigenvalues(
    potential: Potential, x: Array, pressure: float, n: int, count: int = 4, control: str = "pressure"
) -> list[tuple[float, Array]]:
    """The lowest eigenvalues and modes against n waves around the axis, proved complete by inertia.

    An eigenvalue is a squared natural frequency, omega = sqrt(lambda), in units of sqrt(mu/rho_m)/R0 with rho_m the mass density.

    Parameters
    ----------
    potential, x, pressure, n : as in :func:`azimuthal_operator`
    count : int
        How many, each counted with its multiplicity.
    control : {"pressure", "volume"}
        Makes a difference for n = 0 only: other perturbations leave the volume unchanged to first order.

    Returns
    -------
    list of (float, ndarray of shape (n_free,))
        In increasing order; modes are normalised in M, and :meth:`AzimuthalOperator.shape` gives them at the nodes.

    Raises
    ------
    InputError
    SpectrumError
        When the eigenvalues found cannot be proved to be the lowest.
    """
    choice("control", control, ("pressure", "volume"))
    operator = azimuthal_operator(potential, x, pressure, n)
    size = operator.band.shape[1]
    count = whole("count", count, most=size - 2)
    constraint = operator.reduced(potential.evaluate(x, pressure).volume_gradient) if n == 0 and control == "volume" else None
    return [(value, mode) for value, mode, _ in lowest_of(operator.pencil(constraint), count)]


@one_thread
def azimuthal_verdict(potential: Potential, x: Array, pressure: float, n: int, guess: Array | None = None) -> Verdict:
    """Verdict against n >= 1 waves around the axis; the same under pressure and volume control.

    Parameters
    ----------
    potential, x, pressure, n : as in :func:`azimuthal_operator`
    guess : ndarray, optional
        ``coefficients`` of the verdict of a neighbouring state at the same n.

    Raises
    ------
    InputError
        For n that is no whole number >= 1.
    SpectrumError
    """
    check_waves(n, 1)
    operator = azimuthal_operator(potential, x, pressure, n)
    evaluation = potential.evaluate(np.asarray(x, dtype=float), pressure)
    wrinkles = short_waves(potential, evaluation, operator.bending)
    if wrinkles and slack_all_over(evaluation):
        return slack_verdict(None, operator.n)
    if wrinkles:
        where = "; ".join(wrinkle.where for wrinkle in wrinkles)
        return short_wave_verdict(where, any(wrinkle.confirmed for wrinkle in wrinkles), None, operator.n)
    shape = partial(azimuthal_shape, potential.space, operator.n)
    if (touched := evaluation.touched()) is not None:
        free, held = (_smallest(azimuthal_operator(on_set(potential, state), x, pressure, n), guess) for state in touched)
        return between(held, free, against(None, operator.n), None, operator.n, shape)
    found = _smallest(operator, guess)
    # compression that is the mesh's alone says that the mesh is not to be trusted
    sharp = not potential.scene.tension_field and operator.bending is None
    false = sharp and any(least_stress(evaluation, component, supporting_all) for component in (0, 1))
    part = np.inf if false else _unresolved(potential.space, operator, found.mode)
    verdict = verdict_from(found, against(None, operator.n), None, operator.n, shape, part)
    return verdict if operator.bending is None else replace(verdict, wavelength=_wavelength(operator, found.mode))


def _wavelength(operator: AzimuthalOperator, mode: Array) -> float:
    """The length of a wave on the circle where the normal displacement of a mode is largest, as deformed."""
    r = operator.response
    local = wave_unknowns(operator.space, min(operator.n, 2)).local(mode).reshape(3, operator.space.degree + 1, -1)
    a, _, b = operator.space.shape_functions(operator.space.points)[0] @ local
    largest = np.argmax(np.abs(r.t_rho * b - r.t_z * a))
    return float(2 * np.pi * r.rho.ravel()[largest] / operator.n)


def _unresolved(space: Space, operator: AzimuthalOperator, mode: Array) -> float:
    """:func:`.mode_resolution.unresolved` of a mode."""
    layout = wave_unknowns(space, min(operator.n, 2))
    local = space.table[: 2 * space.n_quadrature, : space.degree + 1] @ layout.local(mode).reshape(3, space.degree + 1, -1)
    local = local.reshape(6, *space.R.shape)
    stress = np.stack([operator.response.s1, operator.response.s2])
    of_state = unresolved_stress(space, stress)
    part = unresolved(space, operator.density, pairs_of(operator.density), local, of_state)
    return part if operator.bending is None else part + unresolved_bending(space, *operator.bending.densities(mode), of_state)


@dataclass(frozen=True)
class ShortWaves:
    """Where in words ever shorter waves have ever lower eigenvalues, and whether more than one mesh says so."""

    where: str
    confirmed: bool


def short_waves(potential: Potential, evaluation: Evaluation, bending: Bending | None = None) -> list[ShortWaves]:
    """Where ever shorter waves with n >= 1 waves around the axis have ever lower eigenvalues; empty if nowhere.

    A principal mechanical stress is compressive, or does not hold the sheet against a field that turns it, so that the Legendre-Hadamard
    condition fails. In a tension field no stress is compressive. There the meridional stress may vanish; without hoop stress the operator
    of one n is as good as any. Bending puts an end to waves out of the surface, and leaves those in the plane of the sheet, of which a
    stress says nothing.
    """
    if bending is not None and bending.positive:
        return _in_plane(potential, evaluation)
    if potential.scene.tension_field:
        bad = ill_posed(potential, evaluation)
        return [] if bad is None else [ShortWaves(str(bad), bad.confirmed)]
    found = []
    for component, (name, lines) in enumerate((("meridional", "circles"), ("hoop", "meridians"))):
        zone = compressed(potential, evaluation, component, supporting_all)
        if zone is not None:
            doubt = "" if zone.confirmed else f" ({UNCONFIRMED})"
            if zone.pulled:
                found.append(ShortWaves(str(zone), zone.confirmed))
                continue
            what = f"{name} stress not held against the field" if zone.turned else f"{name} stress compressive"
            found.append(ShortWaves(f"{what} at {zone.where}{doubt}: wrinkles along {lines}", zone.confirmed))
    return found or _in_plane(potential, evaluation)


def _in_plane(potential: Potential, evaluation: Evaluation) -> list[ShortWaves]:
    """Where a field takes the stiffness of the sheet in its plane."""
    pulled = shears_in(potential, evaluation)
    if not pulled.size and potential.tilts:
        pulled = potential.space.R[~elliptic_in_plane(evaluation)]
    where = "the field leaves no stiffness in the plane at "
    return [ShortWaves(where + interval(float(pulled.min()), float(pulled.max())), True)] if pulled.size else []

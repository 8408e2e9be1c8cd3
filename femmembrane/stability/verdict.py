"""A verdict on stability that says against what.

"Stable" has a meaning only for a control (what is held while the membrane is perturbed) and a class of perturbations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..checks import choice
from ..discretization.space import Space
from ..errors import InputError
from ..potential import Evaluation, Potential
from ..solve.wellposed import apparent, ill_posed
from .mode_resolution import unresolved_axisymmetric
from .rigid_motions import pencil_of
from .spectrum import SmallestEigenvalue, smallest_of

Array = NDArray[np.float64]

#: from the coefficients of a mode to its components at the nodes
Shape = Callable[[Array], Mapping[str, Array]]

CONTROLS = ("pressure", "volume", "gas")


@dataclass(frozen=True, eq=False)
class Verdict:
    """Stability of one equilibrium against one class of perturbations.

    Attributes
    ----------
    stable : bool or None
        None when the smallest eigenvalue is zero within its error, be it a marginal state or one whose sign the mesh does not resolve, or
        (with NaN) could not be proved to be the smallest, or when a compression that the mesh shows was not confirmed on finer elements.
    smallest_eigenvalue : float
        lambda of K phi = lambda M phi, a squared natural frequency in units of mu/(rho_m R0^2); NaN where no eigenvalue has a meaning.
    error : float
        Of the eigenvalue: a bound on the algebraic error. Where the discretisation error could change the sign, that is where the mesh does
        not clearly resolve the mode and its state or the eigenvalue is small, three times the discretisation error as well, estimated on
        elements of one degree more. Where finer elements settle a sign that the scene's own mesh leaves open, value and error are theirs.
    control : str or None
        "pressure", "volume" or "gas"; None for azimuthal perturbations, where both agree.
    azimuthal : int
        Number of waves around the axis; 0 for axisymmetric perturbations.
    negative_directions : int or None
        Number of negative eigenvalues, by inertia.
    reason : str
    coefficients : ndarray or None
        Coefficients of the mode on the free degrees of freedom, normalised in the mass of the reference area.
    """

    stable: bool | None
    smallest_eigenvalue: float
    error: float
    control: str | None
    azimuthal: int
    negative_directions: int | None
    reason: str
    coefficients: Array | None = field(default=None, repr=False)
    _shape: Shape | None = field(default=None, repr=False)
    _unresolved: float = field(default=0.0, repr=False)

    @property
    def mode(self) -> Mapping[str, Array] | None:
        """The shape of the perturbation at the nodes: r (reference radius), u, w, and c around the axis for azimuthal ones.

        Of a membrane that nothing holds it is known up to a motion of the whole.
        """
        return None if self._shape is None or self.coefficients is None else self._shape(self.coefficients)

    @property
    def word(self) -> str:
        """stable, unstable or marginal."""
        return {True: "stable", False: "unstable", None: "marginal"}[self.stable]


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
    choice("control", control, CONTROLS)
    shown = apparent(potential, evaluation)
    bad = ill_posed(potential, evaluation) if shown else None
    if bad is not None:
        return short_wave_verdict(f"{bad}, and the spectrum has no lower bound under refinement", bad.confirmed, control, 0)
    if control == "gas" and compliance is None:
        raise InputError("gas", None, 'a verdict under "gas" needs the gas: pass gas=Gas(amount=..., chamber=...)')
    constraint = None if control == "pressure" else evaluation.volume_gradient
    soft = compliance or 0.0 if control == "gas" else 0.0
    found = smallest_of(
        pencil_of(evaluation.band, potential.mass, potential.space.half_bandwidth, constraint, soft, potential.rigid), guess
    )
    shape = partial(mode_shape, potential.space)
    # compression that is the mesh's alone says that the mesh is not to be trusted
    unresolved = np.inf if shown else unresolved_axisymmetric(potential.space, evaluation, found.mode)
    return verdict_from(found, against(control, 0), control, 0, shape, unresolved)


def short_wave_verdict(where: str, confirmed: bool, control: str | None, n: int) -> Verdict:
    """The verdict where ever shorter waves have ever lower eigenvalues, or may have: a mesh alone that shows it leaves it open."""
    wrinkling = " (wrinkling)" if n else ""
    kind = f"short-wave unstable{wrinkling}" if confirmed else "not confirmed: short-wave unstable if the membrane is as this mesh shows it"
    return Verdict(False if confirmed else None, np.nan, np.nan, control, n, None, f"{kind}: {where}")


def against(control: str | None, n: int) -> str:
    """A class of perturbations in words."""
    if n:
        return f"perturbations with {n} wave{'s' if n > 1 else ''} around the axis"
    held = {"pressure": "at constant pressure", "volume": "of constant volume", "gas": "with a constant amount of gas"}[control or "volume"]
    return f"axisymmetric perturbations {held}"


def verdict_from(found: SmallestEigenvalue, among: str, control: str | None, n: int, shape: Shape, unresolved: float) -> Verdict:
    """The verdict that a smallest eigenvalue means for a class of perturbations, named in words."""
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

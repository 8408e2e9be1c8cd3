"""Where the equations of a membrane are ill-posed: what a mesh finds there depends on the mesh.

The plain membrane is in compression along the meridian: the Legendre-Hadamard condition fails. In a tension field no stress is
compressive, but where the meridional one vanishes nothing holds the meridian against the pressure: it folds on a circle there.

A magnetic energy that depends on the slope pulls at the meridian like a stress: a normal field compresses a sheet with self-field, and a
tangential one supports it. In place of the meridional stress stands the *supporting* one then, the force that a turn of the meridian meets,
:func:`supporting`.

A stress that a mesh does not resolve has a sign of the mesh's: slopes of a layer or a needle swing about the true ones within an element.
What a body presses flat is held by that against short waves, whatever its stress.
Compression is pronounced where it exceeds the variation of the stress from element to element, or holds in finer spaces too. Finer
spaces may contradict it. Where the state is not found in them, nothing is known of the membrane but what the one mesh shows.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..discretization.space import HESSIAN_PAIRS
from ..errors import SolveError, Status
from ..physics.kinematics import hencky_strains
from ..potential import Array, Evaluation, Potential
from .finer_space import confirmed
from .pull_in import pulled_in
from .state import State

#: stress relative to the largest one that counts as none
NO_STRESS = 1e-8
#: stress over the shear modulus that is round-off
STRESS_FREE = 1e-14
#: what is said of a compression or a slack zone that finer spaces could contradict
UNCONFIRMED = "on this mesh; not confirmed, since the state was not found on finer elements"

#: tension in a finer space, relative to the largest stress, that contradicts a coarser one in which none is left
_LITTLE = 0.05


@dataclass(frozen=True)
class IllPosed:
    """Interval of reference radii in which a membrane is compressed, or slack in a tension field.

    Attributes
    ----------
    low, high : float
    slack : bool
    confirmed : bool
        Whether it is more than this mesh alone says: False where the state was not found in finer spaces, which could contradict.
    turned : bool
        Whether a magnetic energy that depends on the slope counts as well.
    pulled : bool
        Whether the sheet has no stiffness along the meridian there: a field took it, see :mod:`.pull_in`. With ``turned`` it is stress and
        field together that leave none.
    """

    low: float
    high: float
    slack: bool
    confirmed: bool = True
    turned: bool = False
    pulled: bool = False

    @property
    def status(self) -> Status:
        if self.pulled:
            return Status.PULLED_IN
        return Status.SLACK if self.slack else Status.LEGENDRE_FAILURE

    @property
    def where(self) -> str:
        return interval(self.low, self.high)

    def __str__(self) -> str:
        doubt = "" if self.confirmed else f" ({UNCONFIRMED})"
        if self.pulled:
            who = "stress and field leave" if self.turned else "the field leaves"
            return f"{who} no stiffness along the meridian at {self.where}: the sheet is pulled in there{doubt}"
        if self.slack:
            return f"the meridional tension vanishes at {self.where}: the membrane is slack and folds there{doubt}"
        if self.turned:
            return f"stress and field do not hold the meridian at {self.where}: the Legendre-Hadamard condition fails there{doubt}"
        return f"the meridional stress is compressive at {self.where}: the Legendre-Hadamard condition fails there{doubt}"


def ill_posed(potential: Potential, evaluation: Evaluation) -> IllPosed | None:
    """Where the equilibrium of an evaluation is ill-posed. None if it is well-posed, or if a finer space does not confirm what this space
    shows.
    """
    if potential.follows:  # a state whose elements follow borders has a mesh of its own
        potential = evaluation.potential
    found = apparent(potential, evaluation)
    if found is None or (found.pulled and not found.turned):
        return found
    if found.slack:
        sure = confirmed(lambda finer: _nearly_slack(finer.evaluation), potential, evaluation)
        return None if sure is False else replace(found, confirmed=bool(sure))
    return compressed(potential, evaluation, 0)


def _nearly_slack(evaluation: Evaluation) -> bool:
    """Whether some point has little meridional tension left. A mesh folds before the membrane does, and a coarse mesh first."""
    return apparent(evaluation.potential, evaluation) is not None or bool(evaluation.stress[0].min() < _LITTLE * stress_scale(evaluation))


def apparent(potential: Potential, evaluation: Evaluation) -> IllPosed | None:
    """Where the state of an evaluation, an equilibrium or not, is ill-posed on its own mesh."""
    if potential.follows:
        potential = evaluation.potential
    slack = potential.scene.tension_field
    taut = not slack and evaluation.once("least meridional stress", _least_meridional) >= 0
    if taut and potential.electric is None:  # the usual case needs no scale
        return None
    pulled = pulled_in(potential, evaluation)
    if pulled.size:
        return IllPosed(float(pulled.min()), float(pulled.max()), False, pulled=True)
    if taut:
        return None
    scale = stress_scale(evaluation)
    if not slack and scale <= STRESS_FREE:
        return None
    if not scale and not potential.strained:  # the unloaded membrane is not slack but at rest, where its ends do not bring it closer
        return None
    r = potential.space.R.ravel()[unsupported(supporting(evaluation)[0], scale, slack) | (not scale)]
    if slack:
        r = np.append(r, _folds(potential, evaluation, scale))
    if not r.size:
        return None
    soft = np.zeros(0) if slack else softened(evaluation)
    return _pulled_apart(soft) if soft.size else IllPosed(float(r.min()), float(r.max()), slack, turned=potential.tilts)


def _pulled_apart(soft: Array, sure: bool = True) -> IllPosed:
    """Where nothing is left of the stiffness along the meridian of a sheet whose magnetic energy depends on the slope."""
    return IllPosed(float(soft.min()), float(soft.max()), False, sure, turned=True, pulled=True)


def softened(evaluation: Evaluation) -> Array:
    """Reference radii at which a sheet whose magnetic energy depends on the slope has no stiffness along the meridian; none of others."""
    potential = evaluation.potential
    return potential.space.R[_along_meridian(evaluation)[0] <= 0] if potential.tilts else np.zeros(0)


def supporting(evaluation: Evaluation) -> Array:
    """The stresses that hold the sheet against short waves, shape (2, n_points): the mechanical ones.

    Where an energy depends on the slope, the first is ``lambda_1^2`` times what is left of the density's second derivative with respect to
    a turn of the meridian when its stretch gives way, per thickness: the density is elliptic along the meridian where it is positive, as
    long as the one with respect to the stretch is.
    """
    potential = evaluation.potential
    pressed = None if potential.scene.tension_field else evaluation.pressed_flat()
    if pressed is not None and not potential.tilts:
        stress = evaluation.stress.reshape(2, *potential.space.R.shape)
        return np.where(pressed, np.maximum(stress, 0.0), stress).reshape(2, -1)
    if not potential.tilts:
        return evaluation.stress
    along, mixed, across = _along_meridian(evaluation)
    left = np.where(along > 0, across - mixed**2 / np.where(along > 0, along, 1.0), np.minimum(along, across))
    return np.stack([left.ravel(), evaluation.stress[1]])


def _along_meridian(evaluation: Evaluation) -> tuple[Array, Array, Array]:
    """Second derivatives of the density with respect to the stretch of the meridian, to stretch and turn, and to its turn; times the square
    of the slope.
    """
    potential, space = evaluation.potential, evaluation.potential.space
    _, u_x, _, w_x = space.displacement_at_quadrature(evaluation.x)
    rho_x, eta_x, stiffness = space.R_x + u_x, space.Z_x + w_x, evaluation.stiffness_density.reshape(-1, *space.R.shape)
    uu, uw, ww = (stiffness[HESSIAN_PAIRS.index(pair)] for pair in ((1, 1), (1, 3), (3, 3)))
    along = (rho_x**2 * uu + 2 * rho_x * eta_x * uw + eta_x**2 * ww) / potential.bulk  # the weights taken out
    mixed = ((rho_x**2 - eta_x**2) * uw + rho_x * eta_x * (ww - uu)) / potential.bulk
    across = (eta_x**2 * uu - 2 * rho_x * eta_x * uw + rho_x**2 * ww) / potential.bulk
    return along, mixed, across


def stress_scale(evaluation: Evaluation) -> float:
    """The largest stress of a state; with voltage or charge also that of Maxwell, with which the stress of the material may balance."""
    return evaluation.once("stress scale", _stress_scale)


def stress_free(evaluation: Evaluation) -> bool:
    """Whether nothing acts on a membrane, and no stress is left in it but round-off: its energy is zero, the least that there is."""
    return not evaluation.potential.surrounded and stress_scale(evaluation) <= STRESS_FREE


def _stress_scale(evaluation: Evaluation) -> float:
    largest = float(np.abs(evaluation.stress).max(initial=0.0))
    potential = evaluation.potential
    return largest if potential.electric is None else max(largest, potential.largest_field(evaluation.x, evaluation.factor) ** 2)


def _least_meridional(evaluation: Evaluation) -> float:
    return float(supporting(evaluation)[0].min(initial=0.0))


#: the two stresses at the points of a state whose signs decide, shape (2, n_points)
Supporting = Callable[[Evaluation], Array]


def compressed(potential: Potential, evaluation: Evaluation, component: int, stresses: Supporting = supporting) -> IllPosed | None:
    """Where a principal stress (0 meridional, 1 hoop) is compressive, on any mesh; None where it is nowhere.

    A compression that finer spaces contradict is left out, see :func:`.finer_space.confirmed`.
    """
    if not least_stress(evaluation, component, stresses):
        return None
    stress = stresses(evaluation)[component]
    sure: bool | None = _plain(stress.reshape(potential.space.R.shape))
    if not sure:
        sure = confirmed(lambda found: least_stress(found.evaluation, component, stresses) < 0, potential, evaluation)
    if sure is False:
        return None
    soft = np.zeros(0) if component else softened(evaluation)
    if soft.size:
        return _pulled_apart(soft, bool(sure))
    r = potential.space.R.ravel()[unsupported(stress, stress_scale(evaluation), False)]
    return IllPosed(float(r.min()), float(r.max()), False, bool(sure), potential.tilts)


def least_stress(evaluation: Evaluation, component: int, stresses: Supporting = supporting) -> float:
    """The most compressive value of a principal stress (0 meridional, 1 hoop) on the mesh of a state; 0 where it is nowhere compressive."""
    least = float(stresses(evaluation)[component].min(initial=0.0))
    if least >= 0 or stress_scale(evaluation) <= STRESS_FREE:  # the usual case needs no scale
        return 0.0
    return least if unsupported(np.array(least), stress_scale(evaluation), False) else 0.0


def _plain(stress: Array) -> bool:
    """Whether an element and its neighbours are compressed by more than the stress varies in them."""
    low, high = stress.min(axis=0), stress.max(axis=0)
    low, high = np.pad(low, 1, mode="edge"), np.pad(high, 1, mode="edge")
    low, high = (pick([part[:-2], part[1:-1], part[2:]], axis=0) for pick, part in ((np.min, low), (np.max, high)))
    return bool((high < low - high).any())


def _folds(potential: Potential, evaluation: Evaluation, scale: float) -> Array:
    """Reference radii where two elements meet at so sharp an angle that a smooth meridian between them would be slack."""
    space = potential.space
    s = space.ends[1:-1]
    (R, Z), (R_s, Z_s) = space.mesh.position(s), space.mesh.tangent(s)
    u, u_s, _, w_s = space.at_inner_ends(evaluation.x)
    stress, _ = potential.response_at(evaluation.x, R, Z, s, evaluation.factor).stress(*hencky_strains(R, R_s, Z_s, u, u_s, w_s))
    if potential.sheet is not None:
        stress = stress * potential.sheet.factors(R, Z, s)[1]
    return R[unsupported(stress, scale, True)]


def unresolved_source(potential: Potential, x: Array) -> str:
    """That a source is nearer to the pole than the nodes there are to each other, so that its field is not resolved; empty if none is."""
    for near, length in poles_by_sources(potential, x):
        if near < (spacing := length / potential.scene.degree):
            return f"the pole is {near:.2g} from a source, where nodes are {spacing:.2g} apart: its field is not resolved"
    return ""


def poles_by_sources(potential: Potential, x: Array) -> list[tuple[float, float]]:
    """For each pole its distance from the nearest singular point and the length of the element there, deformed; nothing without sources."""
    if not potential.sources:
        return []
    space, found = potential.space, []
    for k in (0, -1):
        if space.on_axis[k]:
            (_, pole), (rho, eta) = space.end_position(x, k), space.end_position(x, 1 if k == 0 else -2)
            near = math.sqrt(min(float(source.singular_squared(0.0, pole)) for source in potential.sources))
            found.append((near, math.hypot(rho, eta - pole)))
    return found


def is_slack(potential: Potential, state: State) -> bool:
    """Whether a state is the end of a tension field."""
    return potential.scene.tension_field and ill_posed(potential, state.evaluation) is not None


def slackness(potential: Potential, state: State, accepted: list[State] | None = None) -> SolveError:
    """The error that ends a path at an ill-posed state, slack or compressed, with the states accepted before and it."""
    where = f"V = {state.volume:.6g}, P = {state.pressure:.6g}"
    found = ill_posed(potential, state.evaluation) or apparent(potential, state.evaluation)
    status = found.status if found else Status.SLACK if potential.scene.tension_field else Status.LEGENDRE_FAILURE
    return SolveError(f"at {where} {found}", status=status, result=accepted)


def unsupported(stress: Array, scale: float, tension_field: bool) -> NDArray[np.bool_]:
    """Whether a principal stress is compressive, or in a tension field absent."""
    return stress < (NO_STRESS if tension_field else -NO_STRESS) * scale


def interval(low: float, high: float) -> str:
    """Reference radii in words."""
    return f"r = {low:.3g}" if f"{low:.3g}" == f"{high:.3g}" else f"r in [{low:.3g}, {high:.3g}]"

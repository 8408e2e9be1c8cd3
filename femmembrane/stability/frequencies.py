"""Natural frequencies: small oscillations of the membrane about an equilibrium.

A perturbation phi exp(s t) obeys s^2 M phi = -K phi, with K the second variation and M the mass of the reference area. So the eigenvalues
lambda of a verdict are squared frequencies. Each gives a pair of roots s = +- sqrt(-lambda)::

    lambda > 0     s = +- i omega             oscillation, omega = sqrt(lambda)
    lambda < 0     s = +- growth_rate         departure, growth_rate = sqrt(-lambda)

The gas has no inertia of its own here, and there is no damping. Verdicts say whether a state is stable: they know how far an eigenvalue
near zero can be trusted.
"""

from __future__ import annotations

from functools import partial

from ..errors import SolveError, Status
from ..potential import Array, Potential
from ..results.vibration import Vibration
from .azimuthal import lowest_eigenvalues, short_waves
from .azimuthal_operator import azimuthal_operator
from .spectrum import SpectrumError
from .verdict import SLACK_ALL_OVER, slack_all_over, unbounded_below
from .wave_unknowns import azimuthal_shape


def natural_frequencies(
    potential: Potential, x: Array, pressure: float, n: int = 0, count: int = 3, control: str = "pressure"
) -> tuple[Vibration, ...]:
    """The lowest modes with n waves around the axis in order of their eigenvalues, proved by inertia to be the lowest.

    Parameters
    ----------
    potential : Potential
    x : ndarray, shape (n_free,)
        Displacement coefficients of the equilibrium.
    pressure : float
    n : int
        Number of waves around the axis; 0 for axisymmetric modes.
    count : int
        How many modes, each counted with its multiplicity; for n >= 1 a mode and itself turned by a quarter wave count as one.
    control : {"pressure", "volume"}
        What is held during the motion. Makes a difference for n = 0 only.

    Raises
    ------
    InputError
        For a number of waves, a count or a control that is not allowed.
    SolveError
        Where a stress is compressive, so that ever shorter waves have ever lower eigenvalues and none is the lowest; or when the modes
        found cannot be proved to be the lowest.
    """
    operator = azimuthal_operator(potential, x, pressure, n)
    evaluation = potential.evaluate(x, pressure)
    bad = unbounded_below(potential, evaluation, operator.bending)
    # a hoop stress sets no axisymmetric wave in motion
    wrinkles = (
        [wrinkle.where for wrinkle in short_waves(potential, evaluation, operator.bending)] if operator.n else [str(bad)] if bad else []
    )
    if wrinkles and slack_all_over(evaluation):
        raise SolveError(f"no natural frequencies: {SLACK_ALL_OVER}", status=Status.SLACK)
    if wrinkles:
        where = "; ".join(wrinkles)
        raise SolveError(f"no natural frequencies: short-wave unstable, {where}", status=bad.status if bad else Status.LEGENDRE_FAILURE)
    try:
        found = lowest_eigenvalues(potential, x, pressure, n, count, control)
    except SpectrumError as error:
        raise SolveError(f"no natural frequencies: {error}", status=Status.NOT_CONVERGED) from error
    constraint = operator.reduced(evaluation.volume_gradient) if n == 0 and control == "volume" else None
    pencil = operator.pencil(constraint)
    shape = partial(_shape_at_nodes, potential, operator.n)
    vibrations = []
    for _, mode in found:
        value, error_bound = pencil.quotient(mode, pencil.times_mass(mode))
        mode = operator.expanded(mode)
        mode.flags.writeable = False
        vibrations.append(Vibration(value, error_bound, operator.n, None if n else control, mode, shape))
    return tuple(vibrations)


def _shape_at_nodes(potential: Potential, n: int, mode: Array) -> dict[str, Array]:
    shape = azimuthal_shape(potential.space, n, mode)
    return {key: values for key, values in shape.items() if n or key != "c"}

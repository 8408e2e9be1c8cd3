"""What comes after an azimuthal onset, to leading order: Koiter's coefficient.

At an onset the second variation has one mode f with n waves around the axis and U2[f, f] = 0. A turn by half a wave changes the sign of f,
so that no cubic term exists. With x = x_0 + xi f + xi^2 w the potential of the state is, to the fourth order in the amplitude ::

    U(xi) = U_0 + lambda/2 xi^2 + b xi^4,      b = U4[f,f,f,f]/24 + U3[f,f,w]/2 + U2[w,w]/2

where Uk is the k-th derivative, and w, with 0 and 2n waves, makes b stationary. The part with 2n waves gives
-U3[f,f,.] U2^-1 U3[f,f,.]/8. The part with 0 waves is subject to what is held: V'.w + V''[f,f]/2 is 0 at constant volume, free at constant
pressure, and has the spring of the gas between the two. f has mass 1 over the surface, so that lambda is the eigenvalue of the verdict.

A state next to the onset has lambda + 4 b xi^2 = 0. For b > 0 the membrane leans over gradually (supercritical). For b < 0 it jumps
(subcritical): the branch of the other states leads back to where the axisymmetric one is stable, and is unstable itself.

The potential is a trigonometric polynomial of degree 4n at this order, so that three angles in half a wave integrate it exactly.

Source: W. T. Koiter, On the stability of elastic equilibrium, thesis, Delft 1945; B. Budiansky, Adv. Appl. Mech. 14 (1974).
"""

from __future__ import annotations

import numpy as np

from ..discretization.space import Space
from ..errors import SolveError
from ..kernels.bordered import SpringFactor
from ..potential import Array, Evaluation, Potential
from ..potential.surface import SurfaceSeries, refusal
from ..results.postbuckling import Postbuckling, Reduced
from ..solve.banded import BandFactor, BorderedFactor
from ..solve.controls import Gas
from ..threads import one_thread
from .azimuthal import _smallest
from .azimuthal_operator import AzimuthalOperator, azimuthal_operator
from .rigid_motions import pencil_of
from .second_variation import pairs_of
from .spectrum import Pencil, SpectrumError
from .wave_unknowns import wave_unknowns

#: angles at which the potential is evaluated, as shares of half a wave
_ANGLES = (np.arange(3) + 0.5) / 3
#: an eigenvalue this small beside the terms that cancel in it may be zero at the same point, on another mesh or beyond its error
_NEAR = 1e-3
#: a coupling this small beside the terms that cancel in it vanishes by a symmetry
_UNCOUPLED = 1e-4


@one_thread
def postbuckling(potential: Potential, x: Array, pressure: float, n: int, gas: Gas | None = None) -> Postbuckling:
    """Koiter's coefficient at an onset with n waves around the axis.

    Parameters
    ----------
    potential : Potential
    x : ndarray, shape (n_free,)
    pressure : float
        Of the axisymmetric state at the onset.
    n : int
        Number of waves, >= 1.
    gas : Gas, optional
        The gas that holds the state, if one is enclosed.
    """
    reason = refusal(potential)
    if reason:
        return Postbuckling(n, reason)
    try:
        return _Onset(potential, np.asarray(x, dtype=float), pressure, n).answer(gas)
    except (SpectrumError, SolveError, np.linalg.LinAlgError) as error:
        return Postbuckling(n, str(error))


class _Onset:
    """An axisymmetric state with its mode of n waves."""

    def __init__(self, potential: Potential, x: Array, pressure: float, n: int) -> None:
        self.potential, self.n, self.x, self.pressure = potential, n, x, pressure
        self.space = potential.space
        operator = azimuthal_operator(potential, x, pressure, n)
        pencil = operator.pencil()
        found = _smallest(operator, None)
        self.scale = _terms(self.space, operator, found.mode)
        self.mode = found.mode * np.sqrt(2)  # mass 1 over the surface, where the operator has 2 pi in place of pi
        self._alone(pencil, n, abs(found.value))
        for other in (n - 1, n + 1):
            if other and other != 2 * n:
                self._alone(azimuthal_operator(potential, x, pressure, other).pencil(), other)

    def _alone(self, pencil: Pencil, n: int, own: float = 0.0) -> None:
        """Refuse an onset at which another mode sets in as well: amplitudes then act on each other, and one coefficient says too little."""
        near = own + _NEAR * self.scale
        if pencil.count(near) - pencil.count(-near) > int(n == self.n):
            pair = f"two modes with n = {n}" if n == self.n else f"modes with n = {self.n} and n = {n}"
            raise SpectrumError(f"{pair} set in at once, and act on each other")

    def answer(self, gas: Gas | None) -> Postbuckling:
        space = self.space
        series = SurfaceSeries(self.potential, self.x, self.pressure)
        fourth, third, volume = (part / len(_ANGLES) for part in series.along(_displaced(space, self.n, self.mode)))
        bend = float(volume.sum())
        mean = third.sum(axis=1)
        density = np.stack([mean[0] + mean[7], mean[3], mean[2], mean[5]]).reshape(-1, space.n_elements)
        force = space.assemble_vector(density)  # U3[f, f, .] in displacements without waves
        rest = float(fourth.sum()) / 24 - self._doubled(third) / 4
        evaluation = self.potential.evaluate(self.x, self.pressure)
        factor = self._regular(evaluation, force, space.assemble_magnitude(np.abs(density)))
        under = {}
        for control in ("volume", "pressure", *(["gas"] if gas is not None else [])):
            if control == "pressure":
                w, tangent, p, rate = factor.solve(-force / 2), factor.solve(evaluation.volume_gradient), 0.0, 1.0
            else:
                spring = 0.0 if gas is None or control == "volume" else gas.compliance(evaluation.volume)
                bordered = BorderedFactor(factor, -evaluation.volume_gradient, evaluation.volume_gradient, spring)
                w, p = bordered.solve(-force / 2, -bend / 2)
                tangent, rate = bordered.solve(np.zeros_like(force), 1.0)
            slope = float(force @ tangent) - rate * bend
            if gas is not None and control == "gas":
                slope /= self.pressure + gas.atmosphere  # the amount changes by so much for each unit of volume
            under[control] = Reduced(rest + float(force @ w) / 4 - p * bend / 4, slope, self._negative(evaluation, control, gas))
        return Postbuckling(self.n, "", under)

    def _negative(self, evaluation: Evaluation, control: str, gas: Gas | None) -> int:
        """Number of axisymmetric perturbations in which the energy falls; that of a pear that is at its own onset counts as none."""
        row = None if control == "pressure" else evaluation.volume_gradient
        softness = gas.compliance(evaluation.volume) if gas is not None and control == "gas" else 0.0
        held = pencil_of(evaluation.band, self.potential.mass, self.space.half_bandwidth, row, softness, None)
        return held.count(-_NEAR * self.scale)

    def _doubled(self, third: Array) -> float:
        """r . K^-1 r with r = U3[f, f, .] in displacements of 2n waves, K their second variation over 2 pi in place of pi."""
        n = 2 * self.n
        layout = wave_unknowns(self.space, 2)
        operator = azimuthal_operator(self.potential, self.x, self.pressure, n)
        cos, sin = (part[:, None, None] for part in (np.cos(2 * np.pi * _ANGLES), np.sin(2 * np.pi * _ANGLES)))
        even, odd = (third * cos).sum(axis=1), (third * sin).sum(axis=1)
        slopes = np.stack([even[3], odd[4], even[5]])
        values = np.stack([even[0] + even[7] - n * odd[6], odd[1] - odd[6] + n * even[7], even[2] - n * odd[8]])
        force = layout.integrate(values, slopes)
        self._alone(operator.pencil(), n)
        return float(force @ BandFactor(operator.band).solve(force))

    def _regular(self, evaluation: Evaluation, force: Array, size: Array) -> BandFactor | SpringFactor:
        """Factors of K for displacements without waves. On a sphere, whose pears point anywhere, one of them is at its own onset; no force
        acts on it, and it is left out.
        """
        space, factor = self.space, BandFactor.of(evaluation)
        pencil = pencil_of(evaluation.band, self.potential.mass, space.half_bandwidth, evaluation.volume_gradient, 0.0, None)
        try:
            self._alone(pencil, 0)
        except SpectrumError:
            soft = pencil.inverse_iterations(0.0)
            if self.n > 1 or not space.spins or abs(force @ soft) > _UNCOUPLED * float(size @ np.abs(soft)):
                raise
            return SpringFactor(factor, np.sqrt(self.scale) * pencil.times_mass(soft))  # type: ignore[arg-type]
        return factor


def _terms(space: Space, operator: AzimuthalOperator, mode: Array) -> float:
    """Sum of the sizes of the terms that cancel in the second variation along a mode, at the points: what a small eigenvalue is beside."""
    layout = wave_unknowns(space, min(operator.n, 2))
    table = space.table[: 2 * space.n_quadrature, : space.degree + 1]
    local = (table @ layout.local(mode).reshape(3, space.degree + 1, -1)).reshape(6, *space.R.shape)
    pairs = zip(operator.density, pairs_of(operator.density), strict=True)
    return float(sum(np.abs(row * local[i] * local[j]).sum() * (1 if i == j else 2) for row, (i, j) in pairs))


def _displaced(space: Space, n: int, mode: Array) -> Array:
    """The local variables of a mode at the angles, shape (9, 3, n_quadrature, n_elements)."""
    layout = wave_unknowns(space, min(n, 2))
    table = space.table[: 2 * space.n_quadrature, : space.degree + 1]
    local = (table @ layout.local(mode).reshape(3, space.degree + 1, -1)).reshape(3, 2, *space.R.shape)
    (a, a_x), (c, c_x), (b, b_x) = local
    cos, sin = (part[:, None, None] for part in (np.cos(np.pi * _ANGLES), np.sin(np.pi * _ANGLES)))
    return np.stack([a * cos, c * sin, b * cos, a_x * cos, c_x * sin, b_x * cos, -(n * a + c) * sin, (a + n * c) * cos, -n * b * sin])

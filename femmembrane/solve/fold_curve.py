"""Curves of folds: a limit point or a volume fold followed while one number of the scene changes.

With z = (x, P), R = E' - P V' and a number m, a fold is a root of the minimally extended system (Govaerts, 2000)::

    R(x, P, m) = 0,    g(x, P, m) = 0,        [ A   c ] [ v ]   [ 0 ]        limit point:  A = K = E'' - P V''
                                              [ c^T 0 ] [ g ] = [ 1 ]        volume fold:  A = [ K  -V' ; -V'^T  0 ]

g vanishes where A is singular. A is symmetric, so g_z = -(v.A v)_z, an exact third derivative. The system stays regular where two folds
merge (the curve turns in m: a cusp) and where a limit point meets a volume fold, so that pseudo-arc length in (x, P, m) passes both.
The border c is the mass times a mode close to the null vector, renewed at every point. Arc length is measured by

    mean of |u|^2 over the reference area + P^2 + (m/scale)^2,

the inner product of :mod:`.state` with the number in units of ``scale``: the same on every mesh.

K is singular along a curve of limit points, so no system is ever solved with it: all of them, of whatever border, are reduced to
[K, b; b^T, 0] with a mode b of K, which is regular, and a dense matrix of three or four rows. Cost is linear in the elements.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq

from ..errors import SolveError, Status
from ..potential import Array, Evaluation, Family, FoldDerivatives
from .banded import BandFactor, BorderedFactor, WideBorder, band_product
from .continuation import StepControl
from .newton import TOLERANCE, relative_residual, relative_size
from .state import Predictor, hermite

#: kinds of folds that can be followed
KINDS = ("limit_point", "volume_fold")
_MAX_ITERATIONS = 12
#: smallest change of the number, relative to its scale, that is told from round-off
_RESOLUTION = 1e-13


@dataclass(frozen=True, eq=False)
class FoldSystem:
    """Which fold of which scenes, and the unit of the number in arc length."""

    family: Family
    kind: str
    scale: float

    def inner(self, y: Array, z: Array) -> float:
        """Mesh-independent inner product of (x, P, m)."""
        return float(self.dual(y) @ z)

    def dual(self, z: Array) -> Array:
        """The inner product with z as a row."""
        return np.concatenate([self.weigh(z[:-2]), [z[-2] * self.family.space.unit**2, z[-1] / self.scale**2]])

    def weigh(self, x: Array) -> Array:
        """Mass of the reference area times a displacement, over the area and the square of the membrane's own size."""
        family = self.family
        return band_product(family.mass, family.space.half_bandwidth, x) / (family.area * family.space.unit**2)

    def norm(self, z: Array) -> float:
        return float(np.sqrt(max(self.inner(z, z), 0.0)))


@dataclass(frozen=True, eq=False)
class Borders:
    """Reference modes of unit length, as rows: ``deflation`` of K, and ``mode`` (with its pressure) of the singular matrix."""

    deflation: Array
    mode: Array
    mode_pressure: float


@dataclass(slots=True)
class FoldPoint:
    """A point of a fold curve; ``z`` is (x, P, m), ``tangent`` its unit derivative along the curve and ``dual`` that as a row."""

    z: Array
    evaluation: Evaluation
    factor: BandFactor
    borders: Borders
    tangent: Array
    dual: Array
    sigma: float
    iterations: int
    correction: float
    residual: float

    @property
    def x(self) -> Array:
        return self.z[:-2]

    @property
    def pressure(self) -> float:
        return float(self.z[-2])

    @property
    def number(self) -> float:
        return float(self.z[-1])

    @property
    def number_rate(self) -> float:
        """dm/dsigma: zero where the curve turns."""
        return float(self.tangent[-1])


class _Equations:
    """Residuals, borders and the bordered Jacobian at one (x, P, m)."""

    def __init__(self, system: FoldSystem, z: Array, borders: Borders) -> None:
        family = system.family
        self.system, self.z, self.borders = system, z, borders
        self.evaluation = family.evaluate(z[:-2], float(z[-2]), float(z[-1]))
        self.force = self.evaluation.gradient - z[-2] * self.evaluation.volume_gradient
        self.finite = bool(np.isfinite(self.force).all() and np.isfinite(self.evaluation.stiffness_density).all())

    def factorise(self) -> None:
        """The null vector of the bordered singular matrix, g, and the derivatives of both."""
        system, borders, z = self.system, self.borders, self.z
        self.factor = BandFactor(self.evaluation.band)
        self._deflated = BorderedFactor(self.factor, borders.deflation, borders.deflation, 0.0)
        if system.kind == "limit_point":
            self.mode, self.g = self._deflated.solve(np.zeros_like(self.force), 1.0)
            self.q, self._null = 0.0, self.mode
        else:
            edges = [-self.evaluation.volume_gradient, borders.mode]
            corner = np.array([[0.0, borders.mode_pressure], [borders.mode_pressure, 0.0]])
            self.mode, rest = WideBorder(self._deflated, edges, edges, corner).solve(None, [0.0, 1.0])
            self.q, self.g = (float(r) for r in rest)
            self._null = self._deflated.solve(np.zeros_like(self.force), 1.0)[0]
        self._third: FoldDerivatives = system.family.fold_derivatives(z[:-2], float(z[-2]), float(z[-1]), self.mode, self.q)

    def jacobian(self, row: Array) -> WideBorder:
        """Of (R, g, row . z) with respect to (x, P, m)."""
        t = self._third
        corner = np.array([[-t.cubic_pressure, -t.cubic_number], [row[-2], row[-1]]])
        return WideBorder(self._deflated, [-self.evaluation.volume_gradient, t.force_number], [-t.cubic, row[:-2]], corner)

    def renewed(self) -> Borders:
        """Borders made from the null vectors here: one step of inverse iteration each."""
        deflation = _unit(self.system, self._null, 0.0)[0]
        return Borders(deflation, *_unit(self.system, self.mode, self.q))


def _unit(system: FoldSystem, v: Array, q: float) -> tuple[Array, float]:
    weighed = system.weigh(v)
    size = np.sqrt(v @ weighed + q * q)
    return weighed / size, q / float(size)


def _correct(system: FoldSystem, z: Array, borders: Borders, row: Array, *, turn_from: Array | None = None) -> FoldPoint | None:
    """Newton's method for (R, g, row . (z - guess)) = 0; None when it does not converge.

    ``row`` fixes the hyperplane; the tangent there is oriented so that ``turn_from`` (a row, default ``row``) is positive on it.
    """
    guess, previous = z, np.inf
    for iteration in range(_MAX_ITERATIONS + 1):
        equations = _Equations(system, z, borders)
        if not equations.finite:
            return None
        equations.factorise()
        try:
            jacobian = equations.jacobian(row)
            dx, rest = jacobian.solve(-equations.force, [-equations.g, -float(row @ (z - guess))])
        except np.linalg.LinAlgError:
            return None
        size = max(
            relative_size(system.family, dx, z[:-2]),
            abs(rest[0]) / (system.family.space.units["pressure"] + abs(z[-2])),
            abs(rest[1]) / max(system.scale, abs(z[-1])),
        )
        if size <= TOLERANCE:
            tangent, dual = _tangent(system, jacobian, row if turn_from is None else turn_from)
            residual = relative_residual(system.family, equations.force, equations.evaluation, float(z[-2]))
            borders = equations.renewed()
            return FoldPoint(z, equations.evaluation, equations.factor, borders, tangent, dual, 0.0, iteration, float(size), residual)
        if not np.isfinite(size) or (size > 0.5 * previous and size > 1e3 * TOLERANCE):
            return None
        previous = size
        z = z + np.concatenate([dx, rest])
    return None


def _tangent(system: FoldSystem, jacobian: WideBorder, orientation: Array) -> tuple[Array, Array]:
    dx, rest = jacobian.solve(None, [0.0, 1.0])
    tangent = np.concatenate([dx, rest])
    tangent /= system.norm(tangent)
    if orientation @ tangent < 0:
        tangent = -tangent
    return tangent, system.dual(tangent)


def first_fold(system: FoldSystem, x: Array, pressure: float, number: float, direction: int) -> FoldPoint:
    """The fold next to a guess at the same value of the number, oriented towards larger ones for direction +1.

    Raises
    ------
    SolveError
        When the guess is no fold of this kind, or one where the curve turns.
    """
    z = np.concatenate([x, [pressure, number]])
    borders = _first_borders(system, z)
    row = np.zeros_like(z)
    row[-1] = 1.0
    point = _correct(system, z, borders, row, turn_from=direction * row)
    if point is None or system.norm(point.z - z) > 0.1 * (1 + system.norm(z)):
        raise SolveError(f"the start is not near a {system.kind} of this scene", status=Status.NOT_CONVERGED)
    return point


def _first_borders(system: FoldSystem, z: Array, sweeps: int = 6) -> Borders:
    """Modes of K and of the singular matrix closest to zero, by inverse iteration from the shape of the volume gradient."""
    equations = _Equations(system, z, Borders(np.zeros(0), np.zeros(0), 0.0))
    if not equations.finite:
        raise SolveError("the start lies outside the domain of the energy", status=Status.NOT_CONVERGED)
    gradient = equations.evaluation.volume_gradient
    factor = BandFactor(equations.evaluation.band)
    bordered = BorderedFactor(factor, -gradient, -gradient, 0.0)
    k_mode, mode, q = gradient, gradient, 0.0
    for _ in range(sweeps):
        k_mode = factor.solve(_unit(system, k_mode, 0.0)[0])
        mode, q = bordered.solve(*_unit(system, mode, q))
    deflation = _unit(system, k_mode, 0.0)[0]
    return Borders(deflation, deflation, 0.0) if system.kind == "limit_point" else Borders(deflation, *_unit(system, mode, q))


@dataclass(slots=True)
class FoldTracer:
    """Where a fold curve stands: the memory that predicts, and the length of the next step."""

    control: StepControl
    path: Predictor = field(default_factory=Predictor)
    step: float = 0.0


def fold_points(system: FoldSystem, point: FoldPoint, bounds: tuple[float, float], control: StepControl) -> Iterator[FoldPoint]:
    """Points of the curve beyond ``point``, one a step; the last one lies exactly on a bound of the number.

    Raises
    ------
    SolveError
        With status STEP_UNDERFLOW when no step of the smallest length converges.
    """
    tracer = FoldTracer(control, step=control.first)
    _remember(tracer.path, point)
    while not (point.sigma > 0 and point.number in bounds):
        while True:
            new, quality = _attempt(system, point, tracer, bounds)
            if new is not None:
                break
            tracer.step /= 2
            if tracer.step < control.smallest:
                raise SolveError(
                    f"no step longer than {control.smallest:g} converges from {point.number:.9g} "
                    f"(V = {point.evaluation.volume:.6g}, P = {point.pressure:.6g})",
                    status=Status.STEP_UNDERFLOW,
                )
        _remember(tracer.path, new)
        tracer.step = float(np.clip(tracer.step * np.clip(quality, 0.5, 2.0), control.smallest, control.largest))
        point = new
        yield new


def _remember(path: Predictor, point: FoldPoint) -> None:
    path.append(point.sigma, point.z[:-1], point.number, point.tangent[:-1], point.number_rate)


def _predict(path: Predictor, sigma: float) -> Array:
    return np.append(*path.predict(sigma))


def _attempt(system: FoldSystem, point: FoldPoint, tracer: FoldTracer, bounds: tuple[float, float]) -> tuple[FoldPoint | None, float]:
    """One step of the current length, or the shorter one that ends on a bound: the point or None, and the factor for the next step."""
    control, step, row = tracer.control, tracer.step, point.dual
    guess = _predict(tracer.path, point.sigma + step)
    if not bounds[0] < guess[-1] < bounds[1]:
        # values beyond a bound may not exist (a negative strength): the step ends on it, with the number fixed
        bound = bounds[0] if guess[-1] <= bounds[0] else bounds[1]
        if (point.number - bound) * (guess[-1] - bound) < 0:
            step = brentq(lambda s: _predict(tracer.path, point.sigma + s)[-1] - bound, 0.0, step, xtol=1e-15)
            guess = _predict(tracer.path, point.sigma + step)
        guess[-1] = bound
        row = np.zeros_like(guess)
        row[-1] = 1.0
    new = _correct(system, guess, point.borders, row, turn_from=point.dual)
    if new is None:
        return None, 0.5
    miss = system.norm(new.z - guess) / max(step, control.smallest)
    angle = float(np.arccos(np.clip(point.dual @ new.tangent, -1.0, 1.0)))
    if angle > 2 * control.turn or miss > 50 * control.deviation:
        return None, 0.5
    if row[-1] == 1.0 and not row[:-1].any():
        new.z[-1] = guess[-1]
    chord = system.norm(new.z - point.z)
    new.sigma = point.sigma + float(chord / np.sinc(angle / (2 * np.pi)))
    return new, min((control.deviation / max(miss, 1e-12)) ** 0.25, control.turn / max(angle, 1e-12))


class FoldSegment:
    """The fold curve between two neighbouring points: the cubic through both predicts, the corrector puts points on the curve."""

    def __init__(self, system: FoldSystem, a: FoldPoint, b: FoldPoint) -> None:
        self.system, self.a, self.b, self.length = system, a, b, b.sigma - a.sigma
        self._known = {0.0: a, 1.0: b}

    def at(self, share: float) -> FoldPoint:
        """The point at a share of the arc length between the ends.

        Raises
        ------
        SolveError
            When the corrector does not converge there.
        """
        if share not in self._known:
            a, b = self.a, self.b
            guess = hermite(a.z, a.tangent * self.length, b.z, b.tangent * self.length, share)
            row = (1 - share) * a.dual + share * b.dual
            point = _correct(self.system, guess, a.borders if share < 0.5 else b.borders, row)
            if point is None:
                raise SolveError("the fold curve between two neighbouring points could not be resolved", status=Status.NOT_CONVERGED)
            point.sigma = a.sigma + share * self.length
            self._known[share] = point
        return self._known[share]

    def turns(self) -> list[tuple[FoldPoint, float]]:
        """Where the number is stationary along the curve, in order, each with the estimated relative error of its position."""
        shares = self._brackets()
        rates = [self.at(s).number_rate for s in shares]
        pairs = zip(shares, shares[1:], rates, rates[1:], strict=False)
        found = [self._turn(low, high) for low, high, r0, r1 in pairs if r0 * r1 < 0 or (r0 == 0 and low == 0.0 and r1 != 0)]
        # where the number hardly moves at all, at the end of a curve that approaches a value, its sign of motion is round-off
        unit = _RESOLUTION * max(self.system.scale, abs(self.a.number))
        return [t for t in found if max(abs(t[0].number - self.a.number), abs(t[0].number - self.b.number)) > unit]

    def _brackets(self) -> list[float]:
        """0, 1, and between them the extremum of the rate where the cubic says that the rate changes sign twice."""
        a, b = self.a, self.b
        r0, r1, rise = a.number_rate * self.length, b.number_rate * self.length, b.number - a.number
        a2, a1 = 3 * (r0 + r1 - 2 * rise), -4 * r0 - 2 * r1 + 6 * rise
        top = -a1 / (2 * a2) if a2 else 0.5
        twice = r0 * r1 > 0 and 0.02 < top < 0.98 and (r0 + top * (a1 + top * a2)) * r0 < 0.02 * r0 * r0
        return [0.0, float(top), 1.0] if twice else [0.0, 1.0]

    def _turn(self, low: float, high: float) -> tuple[FoldPoint, float]:
        share = brentq(lambda s: self.at(s).number_rate, low, high, xtol=1e-14, rtol=8.9e-16, maxiter=60)
        point, h = self.at(share), 1e-3 * (high - low)
        near = self.at(share + h if share + h < high else share - h)
        slope = (near.number_rate - point.number_rate) / (near.sigma - point.sigma)
        # to first order nothing of the number moves there; the position does
        offset = abs(point.number_rate / slope) if slope else self.length
        return point, float(offset / (1 + self.system.norm(point.z)) + point.correction)

    def crossing(self, bound: float, until: float = 1.0) -> FoldPoint:
        """The point at which the number takes a value, exactly."""
        share = brentq(lambda s: self.at(s).number - bound, 0.0, until, xtol=1e-10)
        near = self.at(share)
        row = np.zeros_like(near.z)
        row[-1] = 1.0
        guess = near.z.copy()
        guess[-1] = bound
        point = _correct(self.system, guess, near.borders, row, turn_from=near.dual)
        if point is None:
            return near
        point.z[-1], point.sigma = bound, near.sigma
        return point

    def passes(self, start: FoldPoint) -> bool:
        """Whether the curve comes back to its first point here."""
        before, after = start.dual @ (self.a.z - start.z), start.dual @ (self.b.z - start.z)
        if self.a.sigma == start.sigma or not before < 0 <= after:
            return False
        share = float(before / (before - after))
        guess = hermite(self.a.z, self.a.tangent * self.length, self.b.z, self.b.tangent * self.length, share)
        return self.system.norm(guess - start.z) < 0.05 * self.length

"""An independent way to a state that certainly exists: Newton's method on dense matrices, along paths of small steps.

Nothing here uses the solvers of the package: of it only the potential is taken (values, gradients and the Hessian of E and V). A walk
begins where a state certainly exists, at the shape that an elastic foundation holds in place; the foundation is taken away at constant
volume, then sources and loads are turned on, and the branch is followed by arc length. It is as slow as it likes to be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femmembrane.potential import Potential

Array = NDArray[np.float64]

#: smallest meridional stress over the largest stress with which a state counts as held by tension
TAUT = 1e-4


@dataclass
class Spot:
    """A solved state: unknowns, pressure, factor on sources and loads, and the evaluation there."""

    x: Array
    pressure: float
    factor: float
    evaluation: Any

    @property
    def volume(self) -> float:
        return float(self.evaluation.volume)


def dense(band: Array, kd: int) -> Array:
    """The full matrix of LAPACK band storage with kd rows of room for pivoting."""
    n = band.shape[1]
    full = np.zeros((n, n))
    for d in range(-min(kd, n - 1), min(kd, n - 1) + 1):
        j = np.arange(max(0, -d), n - max(0, d))
        full[j + d, j] = band[2 * kd + d, j]
    return full


class Walker:
    """Paths on one potential.

    Lengths are measured by the size of the membrane, and pressures by that size too, so that a step means the same in every unit.
    """

    def __init__(self, potential: Potential) -> None:
        self.potential, self.space = potential, potential.space
        space = self.space
        self.kd, self.n = space.half_bandwidth, space.n_free
        self.mass = dense(potential.mass, self.kd) / potential.area
        R, Z = space.mesh.position(space.node_parameters())
        extent = float(np.hypot(np.ptp(R), np.ptp(Z))) * (0.5 if space.closed else 1.0)
        self.size = min(float(np.hypot(R, Z - Z.mean()).max()), extent)
        self.rest = space.reference_volume

    # --- norms

    def rms(self, x: Array) -> float:
        return float(np.sqrt(max(x @ (self.mass @ x), 0.0)))

    def _weights(self, x: Array, pressure: float) -> tuple[float, float]:
        """1/length^2 and 1/pressure^2 by which a step is measured: large deformations and pressures by themselves."""
        length = self.size + self.rms(x)
        return length**-2, (self.size / (1 + abs(pressure) * self.size)) ** 2

    def evaluate(self, x: Array, pressure: float, factor: float) -> Any:
        with np.errstate(all="ignore"):
            return self.potential.evaluate(x, pressure, factor)

    def hessian(self, evaluation: Any) -> Array:
        return dense(evaluation.band, self.kd)

    # --- one solve

    def newton(
        self,
        x: Array,
        pressure: float,
        factor: float,
        equation: Callable[[Array, float, Any], tuple[float, Array, float]],
        *,
        foundation: tuple[float, Array] = (0.0, np.zeros(0)),
        damped: bool = False,
        most: int = 12,
    ) -> Spot | None:
        """Solve E' - P V' + k M (x - x0) = 0 beside one scalar equation; None where the iteration fails."""
        k, anchor = foundation
        previous = np.inf
        x, evaluation = x.copy(), self.evaluate(x, pressure, factor)
        for _ in range(most):
            step = self._step(x, pressure, evaluation, equation, k, anchor)
            if step is None:
                return None
            dx, dp, solve = step
            size = self._relative(x, dx, pressure, dp)
            if not np.isfinite(size) or (not damped and size > 2 * previous and size > 1e-6):
                return None
            length = 1.0
            while damped and length > 1e-3:
                trial = self.evaluate(x + length * dx, pressure + length * dp, factor)
                simplified = solve(x + length * dx, pressure + length * dp, trial)
                if simplified is not None:
                    new = self._relative(x, simplified[0], pressure, simplified[1])
                    if new <= (1 - length / 2) * size or size < 1e-6:
                        break
                length /= 2
            x, pressure = x + length * dx, pressure + length * dp
            evaluation = self.evaluate(x, pressure, factor)
            if not np.isfinite(evaluation.gradient).all():
                return None
            # at the floor of round-off, which is high where stiffnesses differ by many orders, corrections shrink no more
            if length == 1 and (size < 1e-9 or (previous < 1e-6 and 0.2 * previous < size < 1e-6)):
                return Spot(x, float(pressure), factor, evaluation)
            previous = size
        return None

    def _relative(self, x: Array, dx: Array, pressure: float, dp: float) -> float:
        a, b = self._weights(x, pressure)
        largest = float(np.sqrt(a) * np.abs(dx).max(initial=0.0) + np.sqrt(b) * abs(dp))
        for index in self.space.fields:
            change, size = np.abs(dx[index]).max(initial=0.0), np.abs(x[index]).max(initial=0.0)
            if size > 1e-9 * self.size:
                largest = max(largest, float(change / size))
        return largest

    def _step(self, x: Array, pressure: float, evaluation: Any, equation: Any, k: float, anchor: Array) -> Any:
        def residual(y: Array, p: float, at: Any) -> Array:
            force = at.gradient - p * at.volume_gradient
            if k:
                force = force + k * (self.mass @ (y - anchor))
            return np.append(force, equation(y, p, at)[0])

        if not (np.isfinite(evaluation.gradient).all() and np.isfinite(evaluation.stiffness_density).all()):
            return None
        n = self.n
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n] = self.hessian(evaluation)
        if k:
            matrix[:n, :n] += k * self.mass
        matrix[:n, n] = -evaluation.volume_gradient
        _, matrix[n, :n], matrix[n, n] = equation(x, pressure, evaluation)
        rows = 1 / np.maximum(np.abs(matrix).max(axis=1), 1e-300)
        try:
            inverse = np.linalg.inv(matrix * rows[:, None])
        except np.linalg.LinAlgError:
            return None

        def solve(y: Array, p: float, at: Any) -> tuple[Array, float] | None:
            right = residual(y, p, at)
            if not np.isfinite(right).all():
                return None
            d = inverse @ (-right * rows)
            return d[:n], float(d[n])

        first = solve(x, pressure, evaluation)
        return None if first is None else (*first, solve)

    # --- controls

    def at_volume(self, volume: float) -> Any:
        return lambda x, p, e: (e.volume - volume, e.volume_gradient, 0.0)

    def at_pressure(self, pressure: float) -> Any:
        return lambda x, p, e: (p - pressure, np.zeros(self.n), 1.0)

    def at_height(self, height: float) -> Any:
        row = np.zeros(self.n)
        if self.space.pole < self.n:
            row[self.space.pole] = 1.0
        return lambda x, p, e: (self.space.center_height(x) - height, row, 0.0)

    def at_gas(self, amount: float, chamber: float, atmosphere: float) -> Any:
        return lambda x, p, e: (
            (p + atmosphere) * (e.volume + chamber) - amount,
            (p + atmosphere) * e.volume_gradient,
            e.volume + chamber,
        )

    # --- what a state is like

    def taut(self, spot: Spot, margin: float = TAUT) -> bool:
        stress = spot.evaluation.stress
        return bool(stress[0].min() > margin * np.abs(stress).max())

    def clear(self, spot: Spot, distance: float = 0.1) -> bool:
        return bool(self.potential.distance_to_sources(spot.x) > distance * self.size)

    def is_minimum(self, spot: Spot, control: str) -> bool:
        """No negative direction under pressure or volume control, by all eigenvalues of the (bordered) Hessian."""
        stiffness = self.hessian(self.evaluate(spot.x, spot.pressure, spot.factor))
        scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(stiffness)), 1e-12 * np.abs(np.diag(stiffness)).max()))
        stiffness = stiffness * scale[:, None] * scale
        if control == "pressure":
            return bool(np.linalg.eigvalsh(stiffness)[0] > 0)
        v = spot.evaluation.volume_gradient * scale
        v = v / np.linalg.norm(v)
        bordered = np.block([[stiffness, v[:, None]], [v[None, :], np.zeros((1, 1))]])
        return int((np.linalg.eigvalsh(bordered) < 0).sum()) == 1

    def residual(self, spot: Spot) -> float:
        """Out-of-balance force over the largest force that meets at a node, u and w apart."""
        at = self.evaluate(spot.x, spot.pressure, spot.factor)
        force = at.gradient - spot.pressure * at.volume_gradient
        scales = self.potential.force_scale(at, spot.pressure)
        parts = [np.abs(force[i]).max(initial=0.0) / s for i, s in zip(self.space.fields, scales, strict=True) if s > 1e-12 * max(scales)]
        return float(max(parts, default=0.0))

    # --- paths

    def from_foundation(self, guess: Array, factor: float = 0.0) -> Spot | None:
        """The state at the volume of a shape that an elastic foundation holds: taken away step by step, at that volume."""
        volume = float(self.evaluate(guess, 0.0, factor).volume)
        control = self.at_volume(volume)
        straight = self.newton(guess, 0.0, factor, control, damped=True, most=60)
        if straight is not None and self.taut(straight) and self.is_minimum(straight, "volume"):
            return straight
        k = 30 * self.potential.area / self.size**2
        spot = self.newton(guess, 0.0, factor, control, foundation=(k, guess), damped=True, most=40)
        ratio, least = 0.3, 1e-9 * k
        while spot is not None and k > least:
            new = self.newton(spot.x, spot.pressure, factor, control, foundation=(k * ratio, guess), damped=True, most=25)
            if new is None:
                ratio = np.sqrt(ratio)
                if ratio > 0.98:
                    return None
                continue
            spot, k, ratio = new, k * ratio, max(ratio**1.5, 0.1)
        if spot is None:
            return None
        return self.newton(spot.x, spot.pressure, factor, control, damped=True, most=60)

    def turn_on(self, spot: Spot, upto: float = 1.0, first: float = 0.02) -> Spot:
        """The state with the largest factor on sources and loads that small steps at its volume reach, at most ``upto``."""
        control, step, before = self.at_volume(spot.volume), first, None
        while spot.factor < upto:
            there = min(spot.factor + step, upto)
            guess, p = spot.x, spot.pressure
            if before is not None:
                t = (there - spot.factor) / (spot.factor - before.factor)
                guess, p = guess + t * (guess - before.x), p + t * (p - before.pressure)
            new = self.newton(guess, p, there, control, most=8)
            if new is None or self.rms(new.x - spot.x) > 0.1 * self.size or not (self.taut(new) and self.clear(new)):
                step /= 2
                if step < 1e-3:
                    return spot
                continue
            before, spot, step = spot, new, min(step * 1.5, 0.1)
        return spot

    def branch(self, spot: Spot, direction: int, steps: int, length: float = 0.05) -> Iterator[Spot]:
        """States one after the other by arc length, at first towards larger (+1) or smaller volume."""
        tangent: tuple[Array, float] | None = None
        for _ in range(steps):
            found = self._tangent(spot, tangent, direction)
            if found is None:
                return
            tangent = found
            new = None
            while length > 1e-5:
                new = self._along(spot, tangent, length)
                if new is not None:
                    break
                length /= 2
            if new is None:
                return
            yield new
            spot, length = new, min(1.4 * length, 0.15)

    def _tangent(self, spot: Spot, before: tuple[Array, float] | None, direction: int) -> tuple[Array, float] | None:
        a, b = self._weights(spot.x, spot.pressure)
        e, n = spot.evaluation, self.n
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n] = self.hessian(e)
        matrix[:n, n] = -e.volume_gradient
        row, corner = (e.volume_gradient, 0.0) if before is None else (a * (self.mass @ before[0]), b * before[1])
        matrix[n, :n], matrix[n, n] = row, corner
        scale = 1 / np.maximum(np.abs(matrix).max(axis=1), 1e-300)
        try:
            t = np.linalg.solve(matrix * scale[:, None], np.append(np.zeros(n), scale[n]))
        except np.linalg.LinAlgError:
            return None
        if before is None:
            t = direction * t
        size = np.sqrt(a * t[:n] @ (self.mass @ t[:n]) + b * t[n] ** 2)
        return t[:n] / size, float(t[n] / size)

    def _along(self, spot: Spot, tangent: tuple[Array, float], length: float) -> Spot | None:
        a, b = self._weights(spot.x, spot.pressure)
        x, p = spot.x + length * tangent[0], spot.pressure + length * tangent[1]
        row, corner = a * (self.mass @ tangent[0]), b * tangent[1]
        new = self.newton(x, p, spot.factor, lambda y, q, e: (float(row @ (y - x) + corner * (q - p)), row, corner), most=7)
        if new is None:
            return None
        moved = np.sqrt(a) * self.rms(new.x - x) + np.sqrt(b) * abs(new.pressure - p)
        if moved > 0.2 * length or self.potential.passed_source(spot.x, new.x):
            return None
        after = self._tangent(new, tangent, 1)
        if after is None:
            return None
        a, b = self._weights(new.x, new.pressure)
        cosine = a * after[0] @ (self.mass @ tangent[0]) + b * after[1] * tangent[1]
        return new if cosine > 0.93 else None

    def moved_to(self, spot: Spot, other: Walker, control: Any) -> Spot | None:
        """The same state on another mesh of the same scene, at the same load."""
        points = other.space.interpolation_points()
        u, _, w, _ = self.space.evaluate(spot.x, points.ravel())
        x = other.space.interpolate(u.reshape(points.shape), w.reshape(points.shape))
        return other.newton(x, spot.pressure, spot.factor, control, damped=True, most=30)

"""An independent solver for the clamped disc with and without a tension field: shooting from the pole, accurate to about ten digits.

Nothing of the package is used. With F = r W*_1 (rho', eta')/lambda_1 the tension of the meridian (a force over the angle 1),

    F_rho' = W*_2 + 3 chi M r rho (rho^2 + 5 z^2)/s^10 + P rho eta',        F_eta' = 12 chi M r z^3/s^10 - P rho rho',
    (rho', eta') = lambda_1 F/|F|,      where W*_1(lambda_1, lambda_2) = |F|/r,      s^2 = rho^2 + z^2,  z = eta - h,

which is paper eq. 39 as a system of first order. W* = W where the membrane is taut; where it is narrower than its natural width,
lambda_2 < lambda_1^(-1/2), W*_1 belongs to simple tension and W*_2 = 0. The integration stops and starts again at each border between
the two, so that its order is not lost there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

#: radius at which the regular solution at the pole is started; what is left out is of relative order 1e-8 there and decays
START = 1e-4


@dataclass(frozen=True)
class Membrane:
    """Ogden's material (moduli and exponents), a dipole on the axis, and whether the membrane wrinkles."""

    mu: tuple[float, ...]
    alpha: tuple[float, ...]
    chi: float = 0.0
    strength: float = 0.0
    height: float = 0.0
    tension_field: bool = True
    clamped: bool = True

    def W1(self, l1, l2):
        return sum(m * (l1**a - (l1 * l2) ** -a) / l1 for m, a in zip(self.mu, self.alpha, strict=True))

    def W(self, l1, l2):
        return sum(m / a * (l1**a + l2**a + (l1 * l2) ** -a - 3) for m, a in zip(self.mu, self.alpha, strict=True))

    def W11(self, l1, l2):
        terms = zip(self.mu, self.alpha, strict=True)
        return sum(m * ((a - 1) * l1**a + (a + 1) * (l1 * l2) ** -a) / l1**2 for m, a in terms)

    def stretch(self, tension, l2, wrinkled):
        """lambda_1 at a tension W*_1, by Newton's method on a monotone function."""
        l1 = 1.0 + max(tension, -0.5) / 3
        for _ in range(100):
            width = l1**-0.5 if wrinkled else l2
            value, slope = self.W1(l1, width) - tension, self.W11(l1, width)
            if wrinkled:  # d/dl1 of W1(l1, l1^-1/2): the mixed derivative comes in
                slope -= 0.5 * l1**-1.5 * self.W12(l1, width)
            step = value / slope
            l1 = max(l1 - step, l1 / 3)
            if abs(step) < 1e-15 * l1:
                break
        return l1

    def W12(self, l1, l2):
        return sum(m * a * (l1 * l2) ** -a / (l1 * l2) for m, a in zip(self.mu, self.alpha, strict=True))

    def excess(self, r, y):
        """lambda_2 minus the natural width at the tension: negative where the membrane wrinkles."""
        tension = math.hypot(y[2], y[3]) / r
        return y[0] / r - self.stretch(tension, 0.0, True) ** -0.5

    def rates(self, r, y, pressure, wrinkled):
        rho, eta, f, g = y[:4]
        size = math.hypot(f, g)
        l2 = rho / r
        l1 = self.stretch(size / r, l2, wrinkled)
        rho_r, eta_r = l1 * f / size, l1 * g / size
        z = eta - self.height
        magnet = 3 * self.chi * self.strength * r / (rho * rho + z * z) ** 5
        w2 = 0.0 if wrinkled else self.W1(l2, l1)
        energy = self.W(l1, l1**-0.5 if wrinkled else l2)
        field = self.chi * self.strength / 2 * (rho * rho + 4 * z * z) / (rho * rho + z * z) ** 4
        return [
            rho_r,
            eta_r,
            w2 + magnet * rho * (rho * rho + 5 * z * z) + pressure * rho * eta_r,
            4 * magnet * z**3 - pressure * rho * rho_r,
            2 * math.pi * rho * rho_r * eta,
            2 * math.pi * r * energy,
            -2 * math.pi * r * field,
        ]

    def shoot(self, center_height, stretch, pressure):
        """The meridian from the pole to the rim, as far as it goes: final (rho, eta, F_rho, F_eta, V, E_elastic, E_magnetic), borders."""
        r, z = START, center_height - self.height
        w1 = self.W1(stretch, stretch)
        pull = 12 * self.chi * self.strength / z**7 if self.strength else 0.0
        lift = (pull - pressure * stretch**2) / 2
        area = math.pi * r * r
        field = -self.chi * self.strength / 2 * 4 / z**6 if self.strength else 0.0
        energies = [stretch**2 * center_height * area, self.W(stretch, stretch) * area, field * area]
        y = np.array([stretch * r, center_height + stretch * lift / w1 * r * r / 2, w1 * r, lift * r * r, *energies])
        wrinkled, borders, pieces = False, [], []
        while r < 1:

            def border(r, y):
                return self.excess(r, y)

            border.terminal, border.direction = True, 1.0 if wrinkled else -1.0
            found = solve_ivp(
                lambda r, y, wrinkled=wrinkled: self.rates(r, y, pressure, wrinkled),
                (r, 1.0),
                y,
                "DOP853",
                rtol=1e-12,
                atol=1e-14,
                events=border if self.tension_field else None,
                dense_output=True,
            )
            pieces.append(found.sol)
            r, y = found.t[-1], found.y[:, -1]
            if not found.success:
                raise ArithmeticError(f"the integration ended at r = {r}")
            if r < 1:
                wrinkled = not wrinkled
                borders.append(r)
        return y, borders, pieces


@dataclass(frozen=True)
class Solution:
    """One equilibrium of the disc; ``borders`` are the reference radii at which zones of wrinkles begin or end."""

    pressure: float
    volume: float
    center_height: float
    stretch: float
    elastic_energy: float
    magnetic_energy: float
    borders: tuple[float, ...]
    pieces: tuple = ()
    miss: float = 0.0

    def at(self, r):
        """(rho, eta, F_rho, F_eta) at reference radii, shape (4, n)."""
        ends = np.array([*self.borders, 1.0])
        return np.array([self.pieces[int(np.searchsorted(ends[:-1], s))](s)[:4] for s in np.atleast_1d(r)]).T


def solve(membrane: Membrane, center_height: float, stretch: float, pressure: float) -> Solution:
    """The equilibrium of a pole height near a guess of the stretch at the pole and the pressure, by Newton's method."""
    u = np.array([stretch, pressure])
    for _ in range(12):
        y, borders, pieces = membrane.shoot(center_height, *u)
        miss = _miss(membrane, y)
        if np.abs(miss).max() < 1e-12:
            break
        jacobian = np.empty((2, 2))
        for k in range(2):
            h = 1e-6 * max(abs(u[k]), 0.1)
            high, low = (_miss(membrane, membrane.shoot(center_height, *(u + s * h * np.eye(2)[k]))[0]) for s in (1, -1))
            jacobian[:, k] = (high - low) / (2 * h)
        step = np.linalg.solve(jacobian, -miss)
        u = u + step
        if np.abs(step / u).max() < 1e-13:
            break
    return Solution(
        float(u[1]),
        float(y[4]),
        center_height,
        float(u[0]),
        float(y[5]),
        float(y[6]),
        tuple(borders),
        tuple(pieces),
        float(np.abs(miss).max()),
    )


def _miss(membrane: Membrane, y: np.ndarray) -> np.ndarray:
    """At a clamped rim the position is given, at one that slides in its plane the radial force is zero."""
    return np.array([y[0] - 1 if membrane.clamped else y[2], y[1]])

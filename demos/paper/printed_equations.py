"""The paper's equations (60) as they are printed, which are not its equations of equilibrium (39).

For the integration from the pole to the rim the paper solves (39) for the second derivatives. That needs the derivative of the meridional
stress along the radius,

    d/dr dW/dlambda_1 = W_11 lambda_1' + W_12 lambda_2',   dW/dlambda_1 = sum_k mu_k (lambda_1^(alpha_k - 1) - lambda_3^alpha_k/lambda_1).

The abbreviations b_k and c_k of (60m), however, have lambda_2 where the last term has lambda_1: together with (60i-l) they are the
derivative of sum_k mu_k (lambda_1^(alpha_k - 1) - lambda_3^alpha_k/lambda_2), while dW/dlambda_1 itself, (60n), is right. Both agree where
the stretches are equal, at the pole, and nearly so where lambda_3^alpha is small (the neo-Hookean disc of figure 3). But the third
term of the paper's material has alpha = -2: in a well inflated membrane it is large.

Here are these equations in two ways: as a material whose tangent is changed, for the collocation of the package; and written out, with
the paper's symbols, for the integration from the pole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

import femmembrane as fm
from femmembrane.accuracy.collocation import collocate
from femmembrane.accuracy.strong_form import Guess, Solution

#: where the paper's integration begins
_START = 1e-5


@dataclass(frozen=True)
class AsPrinted(fm.Ogden):
    """Ogden's material with stresses as they are, and with the derivatives of (60i-m) for them: no potential has both."""

    #: 0 for the right derivatives, 1 for the printed ones
    part: float = 1.0

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        right = super().tangent(e1, e2)
        s11 = s12 = 0.0
        ratio = np.exp(e1 - e2)
        for mu, alpha in zip(self.mu, self.alpha, strict=True):
            third = np.exp(-alpha * (e1 + e2))
            s11 = s11 + mu * (alpha * np.exp(alpha * e1) + (alpha * ratio - 1) * third)
            s12 = s12 + mu * (alpha + 1) * ratio * third
        return (1 - self.part) * right[0] + self.part * s11, (1 - self.part) * right[1] + self.part * s12, right[2]


def as_printed(of: fm.Scene, heights: Sequence[float], states: Sequence[fm.Equilibrium]) -> list[Solution]:
    """Solutions of (60) at heights of the pole by collocation, given the equilibria there; an AssertionError where none is found."""
    found: list[Solution] = []
    for height, eq in zip(heights, states, strict=True):
        guess = Guess.of(found[-1]) if found else Guess.of(eq)
        solution = _printed(of, height, 1.0, guess)
        if not solution.converged:  # from the equilibrium, step by step
            solution = Guess.of(eq)  # type: ignore[assignment]
            for part in np.linspace(0, 1, 11):
                solution = _printed(of, height, float(part), solution if isinstance(solution, Guess) else Guess.of(solution))
        if not solution.converged:
            raise AssertionError(f"no solution at pole height {height}: {solution.message}")
        found.append(solution)
    return found


def _printed(of: fm.Scene, height: float, part: float, guess: Guess) -> Solution:
    material = of.material if isinstance(of.material, fm.Ogden) else fm.Ogden(mu=(1.0,), alpha=(2.0,))
    changed = of.replace(material=AsPrinted(material.mu, material.alpha, part))
    return collocate(changed, guess=guess, center_height=height, tolerance=1e-5, max_nodes=4000)


def integrate(of: fm.Scene, height: float, guess: Guess) -> tuple[float, float]:
    """Stretch at the pole and pressure by integration of (59-61) from r = 1e-5, symbol by symbol as printed."""

    def miss(unknown: Any) -> Any:
        stretch, pressure = unknown
        x = (_START * stretch, 0.0, height, 0.0)
        rim = solve_ivp(_rates, (_START, 1.0), x, args=(pressure, of), rtol=1e-7, atol=1e-9).y[:, -1]
        return rim[0] - 1, rim[2]

    found = root(miss, (guess.stretch, guess.pressure), options={"xtol": 1e-10})
    return float(found.x[0]), float(found.x[1])


def _rates(r: float, x: Any, P: float, of: fm.Scene) -> Any:
    """X' of (59): A X' = E with X = (u, v, eta, w) = (rho, r lambda_2', eta, eta')."""
    u, v, eta, w = x
    source, material = of.sources[0], of.material
    mu, alpha = np.array(material.mu), np.array(material.alpha)  # type: ignore[attr-defined]
    chi_m, z = of.susceptibility * source.strength, eta - source.height  # type: ignore[attr-defined, operator]
    l2 = u / r
    slope = l2 + v
    l1 = np.hypot(slope, w)
    l3 = 1 / (l1 * l2)
    W1, W2 = (np.sum(mu * (stretch ** (alpha - 1) - l3**alpha / stretch)) for stretch in (l1, l2))  # (60n)
    a, b, c = mu * (alpha - 1) * l1 ** (alpha - 2), mu * alpha / l2 * l3 ** (alpha - 1), mu * l3**alpha / l2**2  # (60m)
    d, e = np.sum(a / l1 + b / (l2 * l1**3)), np.sum(a * r * w / l1 + b * r * w / (l2 * l1**3))  # (60l)
    W11, W12, W13 = d * slope * r, e, d * slope * v + np.sum((b / (l1 * l2**2) + c) * v)  # (60j-k)
    E1 = slope / l1 * (W1 + W13) + W1 * v / l1**2 * (l1 - slope**2 / l1)  # (60h)
    F1 = w / l1 * (W1 + W13) - W1 * w / l1**3 * slope * v  # (60i)
    A, B = r / l1**2 * (l1 - slope**2 / l1) * W1 + slope / l1 * W11, -r * w / l1**3 * slope * W1 + slope / l1 * W12  # (60c-d)
    C, D = -r * w / l1**3 * slope * W1 + w / l1 * W11, r / l1**2 * (l1 - w**2 / l1) * W1 + w / l1 * W12  # (60e)
    square = u**2 + z**2
    E = -E1 + W2 + 3 * chi_m * r * u * (u**2 + 5 * z**2) / square**5 + P * u * w  # (60f)
    F = -F1 + 12 * chi_m * r * z**3 / square**5 - P * u * slope  # (60g)
    v_r, w_r = np.linalg.solve([[A, B], [C, D]], [E, F])
    return slope, v_r, w, w_r

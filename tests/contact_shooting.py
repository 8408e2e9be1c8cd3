"""An independent solver for a neo-Hookean disc below a rigid, frictionless plate: shooting from the border of contact.

Nothing of the package is used. Against the plate the membrane is flat and stretched alike in both directions, by l0: there is no friction,
and a disc under a uniform tension is in balance. From the border, at the reference radius A and the deformed radius a = l0 A, with the
horizontal and vertical force of the meridian over the angle 1, F_rho and F_z,

    F_rho' = W_2 - P rho l1 sin(phi),     F_z = -P (rho^2 - a^2)/2,     (rho', eta') = l1 (F_rho, F_z)/|F|,     W_1(l1, l2) = |F|/R,

with l2 = rho/R. The unknowns P and l0 follow from the rim, rho(1) = 1 and eta(1) = 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve


class Plate(NamedTuple):
    """A state: pressure, volume, stretch in contact, reference radius of its border."""

    pressure: float
    volume: float
    stretch: float
    reference_radius: float


def _stretch(tension: float, l2: float) -> float:
    """l1 with l1 - 1/(l1^3 l2^2) = W_1."""
    l1 = max(tension, 1.0)
    for _ in range(60):
        step = (l1 - 1 / (l1**3 * l2**2) - tension) / (1 + 3 / (l1**4 * l2**2))
        l1 -= step
        if abs(step) < 1e-15 * l1:
            break
    return l1


def under_plate(height: float, radius: float, guess: tuple[float, float]) -> Plate:
    """The state with a deformed radius of contact, from a guess of pressure and stretch."""

    def integrated(pressure: float, stretch: float):
        A = radius / stretch

        def rates(R, y):
            rho, _, f_rho, _ = y
            f_z = -pressure * (rho**2 - radius**2) / 2
            force = math.hypot(f_rho, f_z)
            l1, l2 = _stretch(force / R, rho / R), rho / R
            cosine, sine = f_rho / force, f_z / force
            return [l1 * cosine, l1 * sine, l2 - 1 / (l1**2 * l2**3) + pressure * rho * l1 * sine, l1 * cosine * rho]

        start = [radius, height, A * (stretch - stretch**-5), 0.0]

        def with_volume(R, y):
            rates_ = rates(R, y)
            return [*rates_[:3], 2 * math.pi * y[0] * rates_[0] * y[1]]

        start[3] = math.pi * radius**2 * height
        return A, solve_ivp(with_volume, (A, 1.0), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]

    def missed(unknown):
        _, end = integrated(*unknown)
        return [end[0] - 1.0, end[1]]

    pressure, stretch = fsolve(missed, guess, xtol=1e-13)
    A, end = integrated(pressure, stretch)
    assert np.abs(missed((pressure, stretch))).max() < 1e-9
    return Plate(float(pressure), float(end[3]), float(stretch), A)


class WrinkledPlate(NamedTuple):
    """A state whose rim slides on a plate: as :class:`Plate`, with the reference radius from which on the membrane is wrinkled."""

    pressure: float
    volume: float
    stretch: float
    reference_radius: float
    wrinkled_from: float


def _simple(tension: float) -> float:
    """l1 with l1 - 1/l1^2 = W_1: simple tension, with the natural width l2 = l1^(-1/2)."""
    l1 = max(tension, 1.0)
    for _ in range(60):
        step = (l1 - 1 / l1**2 - tension) / (1 + 2 / l1**3)
        l1 -= step
        if abs(step) < 1e-15 * l1:
            break
    return l1


def wrinkled_under_plate(height: float, radius: float, guess: tuple[float, float]) -> WrinkledPlate:
    """The tension field of a disc whose rim slides without force, rho F_rho = 0: around the contact it is taut, and wrinkled at the rim.

    Where the membrane is narrower than its natural width no hoop stress is left, and the meridian is in simple tension.
    """

    def force(pressure, rho, f_rho):
        f_z = -pressure * (rho**2 - radius**2) / 2
        size = math.hypot(f_rho, f_z)
        return size, f_rho / size, f_z / size

    def integrated(pressure: float, stretch: float):
        A = radius / stretch

        def rates(R, y, taut):
            size, cosine, sine = force(pressure, y[0], y[2])
            l2 = y[0] / R
            l1 = _stretch(size / R, l2) if taut else _simple(size / R)
            hoop = l2 - 1 / (l1**2 * l2**3) if taut else 0.0
            return [l1 * cosine, l1 * sine, hoop + pressure * y[0] * l1 * sine, 2 * math.pi * y[0] * l1 * cosine * y[1]]

        def narrow(R, y, taut):
            return math.log(y[0] / R) + 0.5 * math.log(_simple(force(pressure, y[0], y[2])[0] / R))

        narrow.terminal = True
        narrow.direction = -1
        start = [radius, height, A * (stretch - stretch**-5), math.pi * radius**2 * height]
        options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
        found = solve_ivp(rates, (A, 1.0), start, args=(True,), events=narrow, **options)
        border, end = float(found.t[-1]), found.y[:, -1]
        if border < 1:
            end = solve_ivp(rates, (border, 1.0), end, args=(False,), **options).y[:, -1]
        return A, border, end

    def missed(unknown):
        end = integrated(*unknown)[2]
        return [end[2], end[1]]

    pressure, stretch = fsolve(missed, guess, xtol=1e-13)
    A, border, end = integrated(pressure, stretch)
    assert np.abs(missed((pressure, stretch))).max() < 1e-11
    return WrinkledPlate(float(pressure), float(end[3]), float(stretch), A, border)


class Rod(NamedTuple):
    """A wrinkled tube on a rod: volume, stretch along the contact, its reference half length, and that of the wrinkled zone."""

    volume: float
    stretch: float
    contact: float
    wrinkled: float


def tube_on_a_rod(radius: float, pressure: float, guess: tuple[float, float], half: float = 1.0, drawn: float = 1.5) -> Rod:
    """The tension field of a tube of radius 1 that is drawn from a length to another one and sucked onto a rigid rod.

    On the rod it is wrinkled and straight: no hoop stress, the force l0 - l0^-2 along it, and the pressure of contact -P. Beyond contact
    F_rho' = W_2 - P rho eta' and F_z' = P rho rho', with W_2 = 0 up to where the tube is as wide as it would be by itself.
    """

    def integrated(stretch: float, contact: float):
        first = stretch - stretch**-2

        def force(rho, f_rho):
            f_z = first + pressure * (rho**2 - radius**2) / 2
            size = math.hypot(f_rho, f_z)
            return size, f_rho / size, f_z / size

        def rates(_, y, taut):
            size, cosine, sine = force(y[0], y[2])
            l1 = _stretch(size, y[0]) if taut else _simple(size)
            hoop = y[0] - 1 / (l1**2 * y[0] ** 3) if taut else 0.0
            return [l1 * cosine, l1 * sine, hoop - pressure * y[0] * l1 * sine, math.pi * y[0] ** 2 * l1 * sine]

        def wide(_, y, taut):
            return math.log(y[0]) + 0.5 * math.log(_simple(force(y[0], y[2])[0]))

        wide.terminal = True
        start = [radius, stretch * contact, 0.0, math.pi * radius**2 * stretch * contact]
        options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
        found = solve_ivp(rates, (contact, half), start, args=(False,), events=wide, **options)
        border = float(found.t[-1])
        return border, solve_ivp(rates, (border, half), found.y[:, -1], args=(True,), **options).y[:, -1]

    def missed(unknown):
        end = integrated(*unknown)[1]
        return [end[0] - 1.0, end[1] - drawn]

    stretch, contact = fsolve(missed, guess, xtol=1e-13)
    border, end = integrated(stretch, contact)
    assert np.abs(missed((stretch, contact))).max() < 1e-11
    return Rod(2 * float(end[3]), float(stretch), float(contact), border)

"""Work of the inflating pressure."""

from __future__ import annotations

from typing import Any


def volume_density(rho: Any, rho_s: Any, eta: Any) -> Any:
    """Integrand of the enclosed volume over 2 pi: V = 2 pi Int rho rho_s eta ds, signed (paper eq. 17).

    It is that between the membrane and the plane z = 0, where every end is a pole or stays in that plane.
    """
    return rho * rho_s * eta


def lidded_volume_density(rho: Any, eta_s: Any) -> Any:
    """Integrand over 2 pi of the volume between the membrane and flat lids across its ends, wherever these are.

    By parts 2 pi Int rho rho_s eta ds + pi [-rho^2 eta] = -pi Int rho^2 eta_s ds; a shift along the axis changes nothing of it. The force
    of the pressure on a lid, pi rho^2 P, acts on the end, along the axis.
    """
    return -(rho**2) * eta_s / 2


def wall_density(wall: Any, wall_s: Any, w: Any, w_s: Any) -> Any:
    """Integrand over 2 pi of pi [wall w]: what takes the lid of an end that slides along a wall back to where the end was at rest."""
    return (wall * w_s + wall_s * w) / 2

"""Work of the inflating pressure."""

from __future__ import annotations

from typing import Any


def volume_density(rho: Any, rho_s: Any, eta: Any) -> Any:
    """Integrand of the enclosed volume over 2 pi: V = 2 pi Int rho rho_s eta ds, signed (paper eq. 17)."""
    return rho * rho_s * eta

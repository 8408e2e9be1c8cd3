"""An uneven sheet: thickness and modulus that vary along the meridian.

With the thickness T t and the shear modulus mu m, whatever is an energy of the bulk is multiplied by t per reference area (strain energy,
magnetic energy, weight), and the strain energy by m as well. Principal Cauchy stresses are m lambda_i W_i in units of mu; forces per
length are t times that (Green and Adkins 1960, chapter 4: the energy of a membrane is that of its bulk times its thickness).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .along import Along

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sheet:
    """Thickness and modulus along the meridian, each over its reference value; None where it is 1 everywhere."""

    thickness: Along | None
    modulus: Along | None

    @classmethod
    def of(cls, scene: Any) -> Self | None:
        """The sheet of a scene; None where it is even."""
        if scene.thickness is None and scene.modulus is None:
            return None
        return cls(scene.thickness, scene.modulus)

    def columns(self, R: Array, Z: Array, s: Array) -> dict[str, Array]:
        """The factors that are not 1 at points of the meridian, by their names."""
        factors = {"thickness": self.thickness, "modulus": self.modulus}
        return {name: np.array(factor.at(R, Z, s)) for name, factor in factors.items() if factor is not None}

    def factors(self, R: Array, Z: Array, s: Array) -> tuple[Any, Any]:
        """Thickness and modulus at points of the meridian, 1.0 where they are even."""
        found = self.columns(R, Z, s)
        return found.get("thickness", 1.0), found.get("modulus", 1.0)

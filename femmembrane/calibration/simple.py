"""Homogeneous tests: nominal stress of an incompressible material in uniaxial, planar and equibiaxial tension.

With the strain energy W(e1, e2) of logarithmic strains and s_i = dW/de_i, the nominal stress along 1 is s_1/lambda (Treloar 1944)::

    uniaxial      e2 = -e/2        planar      e2 = 0        equibiaxial      e2 = e

Derivatives by numbers are central differences of these closed forms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .bulge import _STEP, neighbours
from .laws import Law

Array = NDArray[np.float64]

KINDS = {"uniaxial": -0.5, "planar": 0.0, "equibiaxial": 1.0}


class Simple:
    """Predictions of a homogeneous test.

    Parameters
    ----------
    law : Law
    kind : {"uniaxial", "planar", "equibiaxial"}
    """

    def __init__(self, law: Law, kind: str) -> None:
        self.law, self.kind, self.why = law, kind, ""
        if hasattr(law.scene.material, "volume_ratio") and kind != "equibiaxial":
            raise InputError("data", kind, f"an incompressible material is allowed, not {type(law.scene.material).__name__}")

    def stress(self, values: Array, stretch: Array) -> Array:
        """Nominal stress in units of the shear modulus of the scene at the start."""
        factor, scene = self.law.split(values)
        e = np.log(stretch)
        found: Array = factor * np.asarray(scene.material.stress(e, KINDS[self.kind] * e)[0], dtype=float) / stretch
        return found

    def predict(self, values: Array, stretch: Array) -> tuple[Array, Array] | None:
        """Stress, and its derivatives by the numbers and the stretch, shape (m, p + 1)."""
        try:
            with np.errstate(all="ignore"):
                own = self.stress(values, stretch)
                columns = []
                for k in range(len(values)):
                    sides = neighbours(values, k, lambda beside: self.stress(beside, stretch))
                    columns.append(sum(weight * (side - own) for weight, side in sides))
                step = _STEP * stretch
                columns.append((self.stress(values, stretch + step) - self.stress(values, stretch - step)) / (2 * step))
        except (InputError, ArithmeticError) as error:
            self.why = str(error)
            return None
        derivatives = np.stack(columns, axis=1)
        if not (np.isfinite(own).all() and np.isfinite(derivatives).all()):
            self.why = "the material is stretched beyond what it can bear"
            return None
        return own, derivatives

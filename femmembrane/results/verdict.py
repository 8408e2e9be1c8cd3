"""A verdict on stability that says against what.

"Stable" has a meaning only for a control (what is held while the membrane is perturbed) and a class of perturbations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


#: from the coefficients of a mode to its components at the nodes
Shape = Callable[[Array], Mapping[str, Array]]


@dataclass(frozen=True, eq=False)
class Verdict:
    """Stability of one equilibrium against one class of perturbations.

    Attributes
    ----------
    stable : bool or None
        None where the verdict is open. The smallest eigenvalue may be zero within its error: the state is marginal, or the mesh does not
        resolve the sign. It may be NaN, since it could not be proved to be the smallest. Or the mesh shows a compression that finer
        elements did not confirm.
    smallest_eigenvalue : float
        lambda of K phi = lambda M phi, a squared natural frequency in units of mu/(rho_m R0^2); NaN where no eigenvalue has a meaning.
    error : float
        Of the eigenvalue: a bound on the algebraic error. The error of the mesh is added where it could change the sign: where the
        eigenvalue is small, or the mesh does not clearly resolve the mode and its state. It counts three times, estimated on elements of
        one degree more. Where finer elements settle a sign that the scene's own mesh leaves open, value and error come from the finer
        elements.
    control : str or None
        "pressure", "volume" or "gas"; None for azimuthal perturbations, for which it makes no difference.
    azimuthal : int
        Number of waves around the axis; 0 for axisymmetric perturbations.
    negative_directions : int or None
        Number of negative eigenvalues, by inertia.
    reason : str
        What the verdict rests on, in words.
    wavelength : float
        Over R0, for waves around the axis of a sheet with bending: the length of a wave on the circle where the mode is largest, as
        deformed. NaN elsewhere.
    coefficients : ndarray or None
        Coefficients of the mode on the free degrees of freedom, normalised in the mass of the reference area.
    """

    stable: bool | None
    smallest_eigenvalue: float
    error: float
    control: str | None
    azimuthal: int
    negative_directions: int | None
    reason: str
    coefficients: Array | None = field(default=None, repr=False)
    _shape: Shape | None = field(default=None, repr=False)
    _unresolved: float = field(default=0.0, repr=False)
    wavelength: float = field(default=np.nan, repr=False, kw_only=True)

    @property
    def mode(self) -> Mapping[str, Array] | None:
        """The shape of the perturbation at the nodes: r (reference radius), u, w, and c around the axis for azimuthal ones.

        For a membrane that nothing holds, the shape is known up to a motion of the whole.
        """
        return None if self._shape is None or self.coefficients is None else self._shape(self.coefficients)

    @property
    def word(self) -> str:
        """stable, unstable or marginal."""
        return {True: "stable", False: "unstable", None: "marginal"}[self.stable]

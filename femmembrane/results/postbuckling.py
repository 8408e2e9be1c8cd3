"""What comes after an azimuthal onset: gradual or a jump."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..checks import choice, number
from ..errors import InputError

#: the kinds of onsets, and the word for one that is not known
SUPERCRITICAL, SUBCRITICAL, UNKNOWN = "supercritical", "subcritical", "unknown"


@dataclass(frozen=True)
class Reduced:
    """The potential lambda/2 xi^2 + b xi^4 of the amplitude at an onset, while something is held.

    Attributes
    ----------
    coefficient : float
        b, in units of mu T R0^2, of a mode of mass 1 over the reference area, Int |f|^2 dA = 1.
    slope : float
        d lambda/d load along the axisymmetric branch.
    negative_directions : int
        Number of axisymmetric perturbations in which the energy falls at the onset already, with the same held.
    """

    coefficient: float
    slope: float
    negative_directions: int = 0


@dataclass(frozen=True)
class Postbuckling:
    """The states beyond an azimuthal onset to leading order (Koiter 1945), as :attr:`.SpecialPoint.postbuckling` has them.

    The membrane moves by xi f in the mode f with n waves. Beside that of the axisymmetric state its potential is lambda/2 xi^2 + b xi^4.
    The cubic term vanishes, since half a wave around the axis turns f into -f. Where b > 0 the membrane leans over gradually; where b < 0
    it jumps. What is held matters: second-order changes of the volume are free at a held pressure.

    Attributes
    ----------
    azimuthal : int
        n, the number of waves.
    reason : str
        Why nothing is known; empty where something is.
    under : mapping of str to Reduced
        By what is held: volume, pressure and, with a chamber, gas.
    control : str
        What is held for the attributes without an argument.
    """

    azimuthal: int
    reason: str = ""
    under: Mapping[str, Reduced] = field(default_factory=dict)
    control: str = "volume"

    @property
    def coefficient(self) -> float:
        """b while :attr:`control` is held; NaN where it is not known."""
        return self.under[self.control].coefficient if self.control in self.under else math.nan

    @property
    def kind(self) -> str:
        """ "supercritical" (gradual, b > 0), "subcritical" (a jump, b < 0), or "unknown"."""
        b = self.coefficient
        return SUPERCRITICAL if b > 0 else SUBCRITICAL if b < 0 else UNKNOWN

    @property
    def slope(self) -> float:
        """d lambda/d load along the axisymmetric branch: the load is the volume, the pressure or the amount of gas."""
        return self.under[self.control].slope if self.control in self.under else math.nan

    def held(self, control: str) -> Postbuckling:
        """The same onset while something else is held.

        Parameters
        ----------
        control : {"volume", "pressure", "gas"}
            What is held.

        Raises
        ------
        InputError
            For a control of which nothing is known here.
        """
        return Postbuckling(self.azimuthal, self.reason, self.under, choice("control", control, tuple(self.under) or (self.control,)))

    def amplitude(self, change: float) -> float:
        """xi^2 = -(d lambda/d load) change/(4 b): of the state beside the axisymmetric one; NaN on the side where there is none.

        Parameters
        ----------
        change : float
            Of the load since the onset: of the volume, the pressure or the amount of gas, whichever :attr:`control` is.
        """
        square = -self.slope * number("change", change) / (4 * self.coefficient) if self.coefficient else math.nan
        return math.sqrt(square) if square >= 0 else math.nan

    def reduction(self, imperfection: float) -> float:
        """How far before the onset, in load, a small imperfection lets the membrane jump: (27 |b| e^2)^(1/3)/|d lambda/d load|.

        This is Koiter's law of 2/3 for an onset without a cubic term. (His law of 1/2 belongs to one with it.) It is 0 for a gradual onset,
        where no load capacity is lost, and NaN where nothing is known.

        Parameters
        ----------
        imperfection : float
            e, the work of the small force that the imperfection stands for, in a displacement xi = 1 of the mode.
        """
        e = number("imperfection", imperfection)
        if self.kind == SUPERCRITICAL:
            return 0.0
        return (27 * abs(self.coefficient) * e * e) ** (1 / 3) / abs(self.slope) if self.slope else math.nan

    @property
    def words(self) -> str:
        """In a sentence."""
        waves = f"{self.azimuthal} wave{'s' if self.azimuthal != 1 else ''} around the axis"
        held = {"volume": "constant volume", "pressure": "constant pressure", "gas": "a constant amount of gas"}[self.control]
        if self.kind == UNKNOWN:
            return f"whether the onset of {waves} is gradual or a jump is not known: {self.reason or 'b is zero or no number'}"
        what = "the waves grow gradually beyond it"
        if self.kind == SUBCRITICAL:
            what = "the membrane jumps there, and before it the axisymmetric states are stable against small perturbations only"
        if self.under[self.control].negative_directions:
            what = "the state there is unstable under axisymmetric perturbations already"
        return f"at {held} the onset of {waves} is {self.kind} (b = {self.coefficient:.4g}): {what}"


def not_an_onset(kind: str) -> InputError:
    """The error for a special point of another kind."""
    return InputError("postbuckling", kind, "an azimuthal_onset is allowed; other special points have no waves around the axis")

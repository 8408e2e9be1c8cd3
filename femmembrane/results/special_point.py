"""Special points of a branch, and the snaps that start there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import door
from .equilibrium import Equilibrium
from .error_estimate import PlaceEstimate
from .postbuckling import Postbuckling, not_an_onset
from .zones import ZoneChange

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class SpecialPoint:
    """A point of a branch where something changes.

    Attributes
    ----------
    kind : str
        limit_point (dP = 0), volume_fold (dV = 0), height_fold, branch_point, azimuthal_onset; over a number of the scene number_fold,
        where that is stationary; with bodies in the way touch and release; in a tension field zone_opens and zone_closes, where a zone of
        wrinkles, or of taut membrane between wrinkles, appears or vanishes. Such a zone is listed where finer elements confirm it.
    volume, pressure, center_height : float
        Of its equilibrium.
    error : float
        Estimated relative distance of the located point from the exact point of the discrete branch.
    equilibrium : Equilibrium
    azimuthal : int
        For an azimuthal onset: the number of waves against which stability is lost or regained there.
    over : str
        Over a number of the scene: its name, and :attr:`number` is its value.
    tangent : ndarray, shape (n_free + 1,), or None
        For a branch point of one scene: the direction in (x, P) of the branch on which it was found. It tells this branch from the
        crossing one.
    zone : ZoneChange or None
        Which zone of a tension field opens or closes there, and where along the meridian.
    """

    kind: str
    volume: float
    pressure: float
    center_height: float
    error: float
    equilibrium: Equilibrium = field(repr=False)
    azimuthal: int = field(default=0, kw_only=True)
    over: str = field(default="", repr=False, kw_only=True)
    tangent: Array | None = field(default=None, repr=False, kw_only=True)
    zone: ZoneChange | None = field(default=None, repr=False, kw_only=True)

    @property
    def number(self) -> float | None:
        """Value of the number of the scene over which the branch was traced; None for a branch of one scene."""
        return self.equilibrium.number(self.over) if self.over else None

    def error_estimate(self) -> PlaceEstimate:
        """By how much the mesh moves this point, from locating it again in a finer space.

        Limit points, folds and azimuthal onsets have an estimate; others say why they have none.

        Examples
        --------
        >>> import femmembrane as fm
        >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(6), degree=2)
        >>> branch = fm.trace(scene, start=0.5, until={"center_height": 3.0})
        >>> point = next(point for point in branch.special_points if point.kind == "limit_point")
        >>> estimate = point.error_estimate()
        >>> print(f"P = {point.pressure:.6f}, off by {estimate.pressure.error:.0e}")
        P = 1.879247, off by 7e-05
        """
        return door.estimate_place(self)

    def sensitivity(
        self,
        of: str | Sequence[str] = "pressure",
        to: str | Sequence[str] = (),
        *,
        r: ArrayLike | None = None,
        control: str | None = None,
        azimuthal: int = 0,
    ) -> Any:
        """How the place of a limit point or of a volume fold moves with numbers of the scene; exact on the mesh.

        Parameters
        ----------
        of, to, r, control, azimuthal
            As for :meth:`.Equilibrium.sensitivity`; nothing is held, as the point remains a fold.

        Returns
        -------
        float, ndarray or dict
            As for :meth:`.Equilibrium.sensitivity`.

        Raises
        ------
        InputError
            For a point of another kind, an unknown quantity or number, and with a total charge.
        SolveError
            Where two folds meet.

        Examples
        --------
        >>> import femmembrane as fm
        >>> branch = fm.trace(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), until={"center_height": 2.0})
        >>> limit = next(point for point in branch.special_points if point.kind == "limit_point")
        >>> print(f"P = {limit.pressure:.4f}, dP/dp = {limit.sensitivity('pressure', 'membrane.prestretch'):.4f}")
        P = 1.8792, dP/dp = -1.3409
        """
        from .sensitivities import Along, sensitivity_of_point

        return sensitivity_of_point(self, of, to, Along(r, control, azimuthal))

    @property
    def postbuckling(self) -> Postbuckling:
        """Of an azimuthal onset: whether the membrane leans over gradually beyond it or jumps; found when first asked for.

        Raises
        ------
        InputError
            For a special point of another kind.

        Examples
        --------
        A strong dipole below the membrane: below a certain height of the pole the membrane tips over to one side, and jumps.

        >>> import femmembrane as fm
        >>> rubber = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
        >>> dipole, asked = fm.Dipole(strength=600, height=-3.5), fm.Analysis(azimuthal_modes=(1,))
        >>> scene = fm.Scene(material=rubber, sources=[dipole], susceptibility=2.5, mesh=fm.disc(8), degree=6, analysis=asked)
        >>> branch = fm.trace(scene, start=0.5, direction=-1, until={"center_height": 0.3})
        >>> onset = next(point for point in branch.special_points if point.kind == "azimuthal_onset")
        >>> onset.postbuckling.kind, round(onset.postbuckling.coefficient, 2), onset.postbuckling.held("pressure").kind
        ('subcritical', -43.18, 'supercritical')
        """
        if self.kind != "azimuthal_onset":
            raise not_an_onset(self.kind)
        return self.equilibrium.remembered(("postbuckling", self.azimuthal), lambda: door.postbuckling(self.equilibrium, self.azimuthal))

    def __repr__(self) -> str:
        over = {self.over: self.number} if self.over else {}
        shown = {f.name: getattr(self, f.name) for f in fields(self) if f.repr}
        if self.zone is not None:
            shown["zone"] = self.zone
        pairs = {"kind": shown.pop("kind"), **over, **shown}
        return f"SpecialPoint({', '.join(f'{name}={value!r}' for name, value in pairs.items())})"


@dataclass(frozen=True, eq=False)
class Jump:
    """A snap of a run from one part of the branch to another, or to another branch.

    Attributes
    ----------
    index : int
        Position in the branch of the equilibrium landed on.
    limit : SpecialPoint or None
        The fold at which the branch turned back before the load, or the branch point at which it lost its stability. From a branch point
        another branch leads to the landing.
    landing : Equilibrium
    held : str
        What the run prescribed: pressure, volume or center_height; empty where that was not noted, or is none of them.
    """

    index: int
    limit: SpecialPoint | None
    landing: Equilibrium
    held: str = ""

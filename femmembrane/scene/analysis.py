"""The questions asked of every equilibrium: the table [analysis]."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..checks import choice, sequence, store, switch, whole
from ..errors import InputError

VERDICTS = ("pressure", "volume", "gas")
WRINKLING = ("total", "mechanical")
#: largest number of waves around the axis, a thousand times more than a mesh resolves
MAX_WAVES = 10**6
#: in place of a number of waves: the one with the lowest eigenvalue
ALL = "all"


@dataclass(frozen=True)
class Perturbations:
    """A class of perturbations against which a verdict is given.

    Attributes
    ----------
    control : str or None
        What is held against axisymmetric perturbations; None for azimuthal ones, which do not change the volume.
    azimuthal : int or "all"
        Number of waves around the axis; 0 for axisymmetric perturbations; "all" for whichever number is the worst.
    """

    control: str | None
    azimuthal: int | str = 0

    @property
    def tag(self) -> str:
        """With what the names of its columns end: pressure, volume, n1, n2, ..., all."""
        if self.azimuthal == ALL:
            return ALL
        return f"n{self.azimuthal}" if self.azimuthal else str(self.control)

    @property
    def brief(self) -> str:
        """The class in a word or two."""
        if self.azimuthal == ALL:
            return "any n"
        return f"n = {self.azimuthal}" if self.azimuthal else str(self.control)

    @property
    def held(self) -> str:
        """The class by what is held."""
        return self.brief if self.azimuthal else f"{self.control} held"

    @property
    def against(self) -> str:
        """The class as it goes on from a verdict: stable ..."""
        return f"against {self.brief}" if self.azimuthal else f"under {self.control} control"

    @property
    def words(self) -> str:
        """The class in full."""
        if self.azimuthal == ALL:
            return "any number of waves around the axis"
        return f"{self.brief} waves around the axis" if self.azimuthal else f"axisymmetric, {self.held}"


@dataclass(frozen=True)
class Analysis:
    """Questions asked of every equilibrium; only what is asked for is computed.

    Parameters
    ----------
    stability : sequence of {"pressure", "volume", "gas"}
        Controls under which the verdict on axisymmetric perturbations is given; with gas its amount in the chamber of the scene is held.
    azimuthal_modes : sequence of int, or "all"
        Circumferential wave numbers n >= 1 for which the verdict is given; "all" for the one whose eigenvalue is the lowest, which is
        looked for in every equilibrium.
    wrinkling : {"total", "mechanical"}, optional
        The principal stresses whose signs divide the membrane into taut and wrinkled zones; left out: no zones are looked for.
    error_estimates : bool
        Whether discretisation errors are estimated, by solving again in a finer space.
    extra : sequence of str
        Names of further analyses, of those registered in ``femmembrane.results.analyses.EXTRA``. Whoever runs the scene looks them up.

    Raises
    ------
    InputError
        For a value outside these sets or given twice.
    """

    stability: tuple[str, ...] = ()
    azimuthal_modes: tuple[int | str, ...] = ()
    wrinkling: str | None = None
    error_estimates: bool = False
    extra: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        stability = sequence("analysis.stability", self.stability, 'a list is allowed, of "pressure", "volume" and "gas"')
        given = (ALL,) if isinstance(self.azimuthal_modes, str) and self.azimuthal_modes == ALL else self.azimuthal_modes
        modes = sequence("analysis.azimuthal_modes", given, _MODES)
        extra = sequence("analysis.extra", self.extra, _NAMES)
        for k, name in enumerate(stability):
            choice(f"analysis.stability[{k}]", name, VERDICTS)
        modes = tuple(_waves(f"analysis.azimuthal_modes[{k}]", n) for k, n in enumerate(modes))
        for k, name in enumerate(extra):
            if not isinstance(name, str) or not name:
                raise InputError(f"analysis.extra[{k}]", name, _NAMES)
        for key, values in (("stability", stability), ("azimuthal_modes", modes), ("extra", extra)):
            _unique(f"analysis.{key}", values)
        if self.wrinkling is not None:
            choice("analysis.wrinkling", self.wrinkling, WRINKLING)
        estimates = switch("analysis.error_estimates", self.error_estimates)
        store(self, stability=stability, azimuthal_modes=modes, error_estimates=estimates, extra=extra)

    @cached_property
    def verdicts(self) -> tuple[Perturbations, ...]:
        """The classes of perturbations against which verdicts are asked for, the axisymmetric ones first."""
        return (*map(Perturbations, self.stability), *(Perturbations(None, n) for n in self.azimuthal_modes))

    @property
    def zone_criterion(self) -> str:
        """The stresses that tell zones apart: those asked for, else the total ones."""
        return self.wrinkling or "total"


def _waves(key: str, n: Any) -> int | str:
    return n if isinstance(n, str) and n == ALL else whole(key, n, most=MAX_WAVES)


_MODES = 'a list of whole numbers >= 1 is allowed, or "all"'
_NAMES = "a list of names of registered analyses is allowed"


def _unique(key: str, values: tuple[Any, ...]) -> None:
    if len(set(values)) < len(values):
        raise InputError(key, list(values), "each entry once is allowed")

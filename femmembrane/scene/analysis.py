"""The questions asked of every equilibrium: the table [analysis]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..checks import choice, sequence, store, switch, whole
from ..errors import InputError

VERDICTS = ("pressure", "volume")
WRINKLING = ("total", "mechanical")
#: largest number of waves around the axis, a thousand times more than a mesh resolves
MAX_WAVES = 10**6


@dataclass(frozen=True)
class Analysis:
    """Questions asked of every equilibrium; only what is asked for is computed.

    Parameters
    ----------
    stability : sequence of {"pressure", "volume"}
        Controls under which the verdict on axisymmetric perturbations is given.
    azimuthal_modes : sequence of int
        Circumferential wave numbers n >= 1 for which the verdict is given.
    wrinkling : {"total", "mechanical"}, optional
        The principal stresses whose signs divide the membrane into taut and wrinkled zones; left out: no zones are looked for.
    error_estimates : bool
        Whether discretisation errors are estimated, by solving again in a finer space.

    Raises
    ------
    InputError
        For a value outside these sets or given twice.
    """

    stability: tuple[str, ...] = ()
    azimuthal_modes: tuple[int, ...] = ()
    wrinkling: str | None = None
    error_estimates: bool = False

    def __post_init__(self) -> None:
        stability = sequence("analysis.stability", self.stability, 'a list is allowed, of "pressure" and "volume"')
        modes = sequence("analysis.azimuthal_modes", self.azimuthal_modes, "a list of whole numbers >= 1 is allowed")
        for k, name in enumerate(stability):
            choice(f"analysis.stability[{k}]", name, VERDICTS)
        modes = tuple(whole(f"analysis.azimuthal_modes[{k}]", n, most=MAX_WAVES) for k, n in enumerate(modes))
        _unique("analysis.stability", stability)
        _unique("analysis.azimuthal_modes", modes)
        if self.wrinkling is not None:
            choice("analysis.wrinkling", self.wrinkling, WRINKLING)
        estimates = switch("analysis.error_estimates", self.error_estimates)
        store(self, stability=stability, azimuthal_modes=modes, error_estimates=estimates)


def _unique(key: str, values: tuple[Any, ...]) -> None:
    if len(set(values)) < len(values):
        raise InputError(key, list(values), "each entry once is allowed")

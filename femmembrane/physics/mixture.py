"""The susceptibility of a rubber filled with iron, by Maxwell Garnett's rule for spherical grains.

Grains of susceptibility chi_i that take the share f of the volume give ::

    chi = 3 f chi_i/(3 + (1 - f) chi_i)

Every grain is polarised by the field in a spherical hole around it. The result is the susceptibility for the field inside the material, so
it holds for a body of any shape. For grains of iron it is nearly 3 f/(1 - f). The rule is made for few grains, and not to be trusted beyond
f = 0.3, where they touch. A rubber that was cured in a field has chains of grains, for which it does not hold.

Sources: J. C. Maxwell Garnett, Phil. Trans. R. Soc. A 203 (1904); A. Sihvola, Electromagnetic Mixing Formulas and Applications (1999).
"""

from __future__ import annotations

import math

from ..checks import as_float, between
from ..errors import InputError

#: of carbonyl iron, by its order of magnitude: more makes no difference
IRON = 1000.0


def maxwell_garnett(percent: float, grains: float = IRON) -> float:
    """The susceptibility of a material with iron, by Maxwell Garnett's rule (:mod:`~femmembrane.physics.mixture`).

    Parameters
    ----------
    percent : float
        Iron in per cent of the volume, 0 to 100.
    grains : float
        Susceptibility of the grains > 0, which may be infinite.

    Returns
    -------
    float
        chi, the ``susceptibility`` of a scene.

    Raises
    ------
    InputError

    Examples
    --------
    >>> import femmembrane as fm
    >>> print(f"{fm.maxwell_garnett(30.0):.3f}, {fm.iron_content(2.5):.1f} vol%")
    1.280, 45.6 vol%
    """
    f = between("percent", percent, 0.0, 100.0, "a number from 0 to 100 is allowed (per cent of the volume)") / 100
    inverse = 3 / _grains(grains)
    if f == 1 and inverse == 0:
        raise InputError("percent", percent, "less than 100 is allowed where the susceptibility of the grains is infinite")
    return 3 * f / (inverse + (1 - f))


def iron_content(susceptibility: float, grains: float = IRON) -> float:
    """Per cent of the volume that iron takes in a material of a susceptibility: the inverse of :func:`maxwell_garnett`.

    Parameters
    ----------
    susceptibility : float
        0 to that of the grains.
    grains : float
        Susceptibility of the grains > 0, which may be infinite.

    Raises
    ------
    InputError
    """
    chi, most = as_float(susceptibility), _grains(grains)
    if not (0 <= chi <= most and chi < math.inf):
        raise InputError("susceptibility", susceptibility, f"a finite number from 0 to that of the grains, {most:g}, is allowed")
    return 100 * chi * (1 + 3 / most) / (3 + chi)


def _grains(value: float) -> float:
    found = as_float(value)
    if not found > 0:
        raise InputError("grains", value, "a number > 0 is allowed, or infinity")
    return found

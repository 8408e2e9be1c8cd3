"""Materials as a laboratory has them: by moduli in Pa.

A material of the package has the shear modulus 1. In a laboratory ``mu`` is the shear modulus at rest, in Pa, and other moduli are in Pa
as well. Models that are usually written in other moduli take those:

================  ===============================================================  =======================
model             moduli in Pa                                                     shear modulus at rest
================  ===============================================================  =======================
mooney-rivlin     ``c10``, ``c01`` of W = c10 (I1 - 3) + c01 (I2 - 3)              2 (c10 + c01)
yeoh              ``c1`` (or ``mu``), ``c2``, ``c3`` of W = sum of c_k (I1 - 3)^k  2 c1
polynomial        ``c10``, ``c01``, ``c20``, ... of (I1 - 3)^i (I2 - 3)^j          2 (c10 + c01)
ogden             ``mu``, one for each exponent                                    sum of mu_k alpha_k/2
ogden             the same, with ``convention = "2mu/alpha^2"``                    sum of mu_k
lopez-pamies      ``mu1``, ``mu2`` (0) in place of ``share``                       mu1 + mu2
gent-gent         ``c1``, ``c2`` of W = -c1 jm log(1 - J/jm) + c2 log(I2/3)        2 c1 + 2 c2/3
extended-tube     ``gc`` of the chains, ``ge`` of the entanglements                (1 - 2 delta^2) gc + ge
veronda-westmann  ``c1`` of W = c1 (exp(b J) - 1) - c1 b/2 (I2 - 3)                c1 b
hooke             ``young_modulus``, E                                             E/(2 (1 + nu))
any of them       ``mu`` (not polynomial); the others have it alone                mu
================  ===============================================================  =======================
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from ..checks import as_float, is_number
from ..errors import InputError
from ..physics.named import material_data
from ..physics.units import has_unit, in_unit
from .given import shown_as_given
from .toml import MATERIALS, material_of

if TYPE_CHECKING:
    from ..physics.materials import Material

#: names of moduli in Pa, by model; of any other model it is mu alone
_MODULI: Mapping[str, tuple[str, ...]] = {
    "mooney-rivlin": ("mu", "c10", "c01"),
    "yeoh": ("mu", "c1", "c2", "c3"),
    "polynomial": ("c10", "c01", "c20", "c11", "c02", "c30", "c21", "c12", "c03"),
    "ogden": ("mu",),
    "lopez-pamies": ("mu", "mu1", "mu2"),
    "gent-gent": ("mu", "c1", "c2"),
    "extended-tube": ("mu", "gc", "ge"),
    "veronda-westmann": ("mu", "c1"),
    "hooke": ("mu", "young_modulus"),
}


def measured(model: str, **numbers: Any) -> tuple[Material, float]:
    """A material by its moduli in Pa.

    Parameters
    ----------
    model : str
        As in a scene file: "neo-hookean", "mooney-rivlin", "yeoh", "gent", "ogden", ...
    **numbers
        ``mu`` is the shear modulus at rest. Mooney-Rivlin takes ``c10`` and ``c01``, Yeoh ``c1``, ``c2`` and ``c3``, a polynomial its
        ``c10`` to ``c03``, Ogden one ``mu`` for each ``alpha``, Lopez-Pamies ``mu1`` and ``mu2``, Gent-Gent ``c1`` and ``c2``, an extended
        tube ``gc`` and ``ge``, Veronda-Westmann ``c1``, Hooke ``young_modulus``. All are in Pa, or texts such as "0.4 MPa". Ratios, such
        as ``jm``, are those of the material.

    Returns
    -------
    material : Material
    shear_modulus : float
        In Pa, for :class:`~femmembrane.Scales`.

    Raises
    ------
    InputError
        For an unknown model, a modulus that is missing or of another unit, and numbers with which the material would be unstable.

    Examples
    --------
    >>> import femmembrane as fm
    >>> latex, shear_modulus = fm.measured("mooney-rivlin", c10="150 kPa", c01=15e3)
    >>> latex, shear_modulus
    (MooneyRivlin(ratio=0.1), 330000.0)
    >>> scales = fm.Scales(radius=0.02, thickness=3e-4, shear_modulus=shear_modulus)
    >>> round(scales.to_si("pressure", 1.0), 6)
    4950.0
    """
    given = {"model": model, **numbers}
    with shown_as_given({"units": "si", "material": given}):
        table, shear_modulus = without_moduli(given, None, True)
        material: Material = material_of(table)
    if shear_modulus is None:
        raise InputError("material.mu", None, "missing; the shear modulus in Pa is allowed")
    return material, shear_modulus


def without_moduli(table: Mapping[str, Any], known: Any, si: bool) -> tuple[dict[str, Any], float | None]:
    """The table of a material over its shear modulus, and this in Pa, if it has moduli in Pa or is a real material by name.

    Parameters
    ----------
    table : mapping
        As in a scene file.
    known : float or None
        Shear modulus in Pa that is given elsewhere.
    si : bool
        Whether moduli without a unit are in Pa.
    """
    if "name" in table:
        return dict(table), material_data(table["name"]).shear_modulus
    model = table.get("model")
    if not isinstance(model, str) or model not in MATERIALS:
        return dict(table), None
    names = [name for name in _MODULI.get(model, ("mu",)) if name in table]
    if not si and not any(_any(has_unit, table[name]) for name in names):
        _refuse_bare(model, table)
        return dict(table), None
    numbers = {**table, **{name: _pascals(f"material.{name}", table[name], si, lists=model == "ogden") for name in names}}
    if not names:
        return numbers, None
    numbers, shear_modulus = _OVER_SHEAR_MODULUS.get(model, _plain)(numbers, known)
    if shear_modulus is None:
        material_of(numbers)  # refuses the numbers from which it does not follow
    return numbers, shear_modulus


def _any(test: Callable[[Any], bool], value: Any) -> bool:
    return any(map(test, value)) if isinstance(value, (list, tuple)) else test(value)


def _refuse_bare(model: str, table: Mapping[str, Any]) -> None:
    """Refuse numbers that a material of shear modulus 1 does not have, and that have no unit either."""
    arguments = getattr(MATERIALS[model], "__dataclass_fields__", {})
    for name in _MODULI.get(model, ("mu",)):
        if name not in arguments and is_number(table.get(name)):
            raise InputError(f"material.{name}", table[name], 'its unit is missing: "0.4 MPa" is allowed, or units = "si" above all tables')


def _pascals(key: str, value: Any, si: bool, lists: bool = False) -> Any:
    """A modulus, or a list of them where one is allowed, in Pa."""
    if lists and isinstance(value, (list, tuple)):
        return [_pascals(f"{key}[{k}]", one, si) for k, one in enumerate(value)]
    if isinstance(value, str):
        return in_unit(key, value, "Pa")[0]
    if not is_number(value):
        raise InputError(key, value, 'a finite number in Pa, or a number with its unit such as "0.4 MPa", is allowed')
    if not si:
        raise InputError(key, value, 'its unit is missing, while another modulus has one: "0.4 MPa" is allowed')
    return float(value)


def _positive(key: str, value: Any, what: str = "shear modulus") -> float:
    if value is None:
        raise InputError(key, None, f"missing; the {what} in Pa is allowed")
    if not (is_number(value) and value > 0):
        raise InputError(key, value, f"a {what} > 0 in Pa is allowed")
    return float(value)


def _plain(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float]:
    return numbers, _positive("material.mu", numbers.pop("mu"))


def _mooney_rivlin(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float]:
    if "mu" in numbers:
        _alone(numbers, "mu", ("c10", "c01"))
        return _plain(numbers, known)
    for name in ("c10", "c01"):
        _alone(numbers, name, ("ratio",))
    c10, c01 = _positive("material.c10", numbers.pop("c10", None), "modulus"), numbers.pop("c01", 0.0)
    if c01 < 0:
        raise InputError(
            "material.c01", c01, "a modulus >= 0 in Pa is allowed: the stress does not grow with the stretch at every stretch otherwise"
        )
    return {**numbers, "ratio": c01 / c10}, _positive("material.c10", 2 * (c10 + c01))


def _yeoh(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float]:
    if "mu" in numbers or "c1" not in numbers:
        _alone(numbers, "mu", ("c1",))
        mu = _positive("material.c1", numbers.pop("mu", known), "modulus")
    else:
        mu = 2 * _positive("material.c1", numbers.pop("c1"), "modulus")
    return {name: value / mu if name in ("c2", "c3") else value for name, value in numbers.items()}, mu


def _ogden(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float | None]:
    moduli, exponents = numbers["mu"], numbers.get("alpha")
    if not (isinstance(moduli, list) and isinstance(exponents, (list, tuple)) and len(moduli) == len(exponents)):
        return numbers, None
    if not all(map(is_number, exponents)) or not all(map(is_number, moduli)):
        return numbers, None
    of_squares = numbers.get("convention", "mu/alpha") == "2mu/alpha^2"  # mu is the sum of mu_k
    twice = math.fsum(m * (2.0 if of_squares else a) for m, a in zip(moduli, exponents, strict=True))
    mu = _positive("material.mu", twice / 2, f"sum of {'mu' if of_squares else 'mu alpha/2'}, the shear modulus,")
    return {**numbers, "mu": [m / mu for m in moduli]}, mu


def _polynomial(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float]:
    mu = _positive("material.c10", 2 * (numbers.get("c10", 0.0) + numbers.get("c01", 0.0)), "sum of c10 and c01")
    return {name: value / mu if name in _MODULI["polynomial"] else value for name, value in numbers.items()}, mu


def _lopez_pamies(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float]:
    if "mu" in numbers:
        _alone(numbers, "mu", ("mu1", "mu2"))
        return _plain(numbers, known)
    for name in ("mu1", "mu2"):
        _alone(numbers, name, ("share",))
    first, second = _positive("material.mu1", numbers.pop("mu1", None)), _not_negative(numbers, "mu2")
    return {**numbers, "share": second / (first + second)}, first + second


def _gent_gent(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float]:
    if "mu" in numbers:
        _alone(numbers, "mu", ("c1", "c2"))
        return _plain(numbers, known)
    for name in ("c1", "c2"):
        _alone(numbers, name, ("share",))
    gent, second = 2 * _positive("material.c1", numbers.pop("c1", None), "modulus"), 2 / 3 * _not_negative(numbers, "c2")
    return {**numbers, "share": second / (gent + second)}, gent + second


def _extended_tube(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float | None]:
    if "mu" in numbers:
        _alone(numbers, "mu", ("gc", "ge"))
        return _plain(numbers, known)
    for name in ("gc", "ge"):
        _alone(numbers, name, ("share",))
    chains, tubes = _positive("material.gc", numbers.pop("gc", None), "modulus"), _not_negative(numbers, "ge")
    delta = as_float(numbers.get("delta"))
    if not 2 * delta * delta < 1:
        return {**numbers, "share": 0.0}, None
    mu = (1 - 2 * delta * delta) * chains + tubes
    return {**numbers, "share": tubes / mu}, mu


def _veronda_westmann(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float | None]:
    if "mu" in numbers:
        _alone(numbers, "mu", ("c1",))
        return _plain(numbers, known)
    c1, b = _positive("material.c1", numbers.pop("c1"), "modulus"), as_float(numbers.get("b"))
    return numbers, c1 * b if is_number(b) and b > 0 else None


def _hooke(numbers: dict[str, Any], known: Any) -> tuple[dict[str, Any], float | None]:
    if "mu" in numbers:
        _alone(numbers, "mu", ("young_modulus",))
        return _plain(numbers, known)
    young = _positive("material.young_modulus", numbers.pop("young_modulus"), "modulus")
    ratio = as_float(numbers.get("poisson_ratio"))
    return numbers, young / (2 * (1 + ratio)) if -1 < ratio <= 0.5 else None


def _not_negative(numbers: dict[str, Any], name: str) -> float:
    """A modulus that may be left out, which is 0; it is taken out of the table."""
    value = float(numbers.pop(name, 0.0))
    if not (is_number(value) and value >= 0):
        raise InputError(f"material.{name}", value, "a modulus >= 0 in Pa is allowed")
    return value


def _alone(numbers: Mapping[str, Any], name: str, others: tuple[str, ...]) -> None:
    for other in others:
        if other in numbers and name in numbers:
            raise InputError(f"material.{other}", numbers[other], f"not allowed beside material.{name}, which says the same; leave one out")


_OVER_SHEAR_MODULUS: Mapping[str, Callable[[dict[str, Any], Any], tuple[dict[str, Any], float | None]]] = {
    "mooney-rivlin": _mooney_rivlin,
    "yeoh": _yeoh,
    "ogden": _ogden,
    "polynomial": _polynomial,
    "lopez-pamies": _lopez_pamies,
    "gent-gent": _gent_gent,
    "extended-tube": _extended_tube,
    "veronda-westmann": _veronda_westmann,
    "hooke": _hooke,
}

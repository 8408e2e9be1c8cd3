"""The numbers that a fit may change, and the scene that they make.

A material of the package has the shear modulus 1, the unit of stress. A fit may leave the unit free: then numbers of the material are
moduli, in the unit in which the scene measures stress (Pa where it has scales, else the unit that its pressures have already)::

    material.mu                      shear modulus at rest of any material but Ogden's and the polynomial
    material.c10, material.c01, ...  the moduli that scene files take for a model, :mod:`~femmembrane.scene.moduli`
    material.mu.K, material.alpha.K  moduli and exponents of Ogden's material, each on its own: with no rule on their sum
    scales.shear_modulus             the shear modulus, the material over it staying as it is; membrane.modulus is another name for it

As soon as one of these moduli is fitted, all numbers of the material are meant so. Exponents and limits, such as ``alpha`` and ``jm``,
have no unit. Without a free modulus the names are those of :mod:`~femmembrane.scene.variation`, and the shear modulus stays.

The least-squares solver moves coordinates in which what is allowed is a box: logarithms of what has one sign, and for Yeoh's material the
distance from the edge of stability (Baker and Ericksen 1954).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..physics.along import Along
from ..physics.materials import MooneyRivlin, Ogden
from ..scene.moduli import without_moduli
from ..scene.toml import MATERIALS, material_of
from ..scene.variation import Parameter, names

if TYPE_CHECKING:
    from ..scene import Scene

Array = NDArray[np.float64]

#: names of the shear modulus as a factor of the whole material
OVERALL = ("scales.shear_modulus", "membrane.modulus")
#: moduli of a model from its numbers and its shear modulus, in the units of stress of the latter
_MODULI: Mapping[str, Callable[[Any, float], dict[str, float]]] = {
    "mooney-rivlin": lambda m, mu: {"c10": mu / (2 * (1 + m.ratio)), "c01": mu * m.ratio / (2 * (1 + m.ratio))},
    "yeoh": lambda m, mu: {"c1": mu / 2, "c2": mu * m.c2, "c3": mu * m.c3},
    "polynomial": lambda m, mu: {f.name: mu * getattr(m, f.name) for f in dataclasses.fields(m)},
    "lopez-pamies": lambda m, mu: {"mu1": mu * (1 - m.share), "mu2": mu * m.share, "alpha1": m.alpha1, "alpha2": m.alpha2},
    "gent-gent": lambda m, mu: {"c1": mu * (1 - m.share) / 2, "c2": 1.5 * mu * m.share, "jm": m.jm},
    "extended-tube": lambda m, mu: {
        "gc": mu * (1 - m.share) / (1 - 2 * m.delta**2),
        "ge": mu * m.share,
        "beta": m.beta,
        "delta": m.delta,
    },
    "veronda-westmann": lambda m, mu: {"c1": mu / m.b, "b": m.b},
    "hooke": lambda m, mu: {"young_modulus": 2 * mu * (1 + m.poisson_ratio), "poisson_ratio": m.poisson_ratio},
}
#: sizes of exponents of Ogden's material, and the factor by which other numbers of one sign may differ from those at the start
_EXPONENTS, _FACTOR = (0.02, 60.0), 1e6
#: numbers without a unit among them
_RATIOS = frozenset({"jm", "alpha1", "alpha2", "beta", "delta", "b", "poisson_ratio", "share", "ratio", "links"})
#: numbers that may be 0 or have any sign; all others keep the sign that they have at the start
_FREE = {"yeoh": ("c2", "c3"), "mooney-rivlin": ("c01", "ratio"), "polynomial": (), "hooke": ("poisson_ratio",)}
_SHARES = frozenset({"share", "mu2", "ge"})


def model_of(material: Any) -> str:
    """The name of a material in scene files; empty for one of the user's own."""
    return next((name for name, kind in MATERIALS.items() if type(material) is kind), "")


def absolute_numbers(material: Any, shear_modulus: float) -> dict[str, float]:
    """All numbers of a material in units of stress, by the names that follow ``material.``."""
    model = model_of(material)
    if isinstance(material, Ogden):
        moduli = {f"mu.{k}": m * shear_modulus for k, m in enumerate(material.mu)}
        return moduli | {f"alpha.{k}": a for k, a in enumerate(material.alpha)}
    if model in _MODULI:
        return _MODULI[model](material, shear_modulus)
    own = {f.name: float(getattr(material, f.name)) for f in dataclasses.fields(material) if f.init} if model else {}
    return {"mu": shear_modulus, **own}


@dataclass(frozen=True)
class Coordinate:
    """One number as the solver sees it: x = log |value|, or the value itself between bounds."""

    logarithmic: bool
    sign: float = 1.0
    low: float = -math.inf
    high: float = math.inf

    @classmethod
    def of_one_sign(cls, value: float, rest: str) -> Coordinate:
        """Of a number that keeps its sign. Its size has bounds far from any measured material: what data do not say ends there."""
        if rest.startswith("alpha."):
            low, high = _EXPONENTS
        else:
            low, high = abs(value) / _FACTOR, abs(value) * _FACTOR
        return cls(True, math.copysign(1.0, value), math.log(min(low, abs(value))), math.log(max(high, abs(value))))


class Law:
    """The numbers of a scene that are fitted.

    Parameters
    ----------
    scene : Scene
        It gives the numbers that are not fitted, and the start of those that are.
    parameters : sequence of str

    Attributes
    ----------
    names : tuple of str
    start : ndarray
        Values in the scene.
    free_modulus : bool
        Whether the unit of stress is one of them, or follows from them.
    unit : float
        The shear modulus of the scene in the unit in which moduli are given: Pa with scales, else 1 (times its own even factor).

    Raises
    ------
    InputError
        For names that the scene does not have, or that say the same twice.
    """

    def __init__(self, scene: Scene, parameters: Sequence[str]) -> None:
        self.names = _checked_names(parameters)
        if getattr(scene.material, "named", None) is not None:  # with other numbers it is not that material any more
            scene = scene.replace(material=dataclasses.replace(scene.material))  # type: ignore[type-var]  # a dataclass, by its name
        self.scene = scene
        self.model = model_of(scene.material)
        self.unit = 1.0 if scene.scales is None else scene.scales.shear_modulus
        self._even = _even_modulus(scene)
        self.modulus = self.unit * self._even
        self.absolute = absolute_numbers(scene.material, self.modulus)
        alone = {"mu": self.modulus} if "mu" not in self.absolute and self.model not in ("polynomial", "ogden", "") else {}
        moduli = {f"material.{n}" for n in (*self.absolute, *alone) if n.partition(".")[0] not in _RATIOS | {"alpha"}}
        packaged = set(names(scene))
        self.overall = next((n for n in self.names if n in OVERALL), None)
        # Yeoh's c2 and c3 are numbers over the shear modulus too: they are moduli beside one that is not
        own = {n for n in moduli if n not in packaged or n.startswith("material.mu.")}
        self.by_moduli = any(n in own for n in self.names) and self.overall is None
        self.free_modulus = self.by_moduli or self.overall is not None
        self._alone = self.by_moduli and "material.mu" in self.names and "mu" not in self.absolute
        if self._alone:
            self.absolute = {"mu": self.modulus, **self._beside_mu()}
        known = sorted(packaged | own | {*OVERALL} | ({f"material.{n}" for n in self.absolute} if self.by_moduli else set()))
        for name in self.names:
            if name not in known:
                raise unknown_name("parameters", name, known)
            if self.by_moduli and name.startswith("material.") and name.removeprefix("material.") not in self.absolute:
                others = ", ".join(f"material.{n}" for n in self.absolute)
                raise InputError("parameters", name, f"beside a modulus these numbers of the material are allowed: {others}")
        self._refuse_one_modulus()
        self._refuse_modulus(scene)
        self.start = np.array([self._value(name) for name in self.names])
        self.coordinates = [self._coordinate(name, value) for name, value in zip(self.names, self.start, strict=True)]

    def _refuse_one_modulus(self) -> None:
        if self.overall is None:
            return
        if sum(n in OVERALL for n in self.names) > 1:
            raise InputError("parameters", list(self.names), f"{' and '.join(OVERALL)} are the same number; leave one out")
        if any(n.startswith("material.mu.") for n in self.names) and len(getattr(self.scene.material, "mu", ())) == 1:
            raise InputError("parameters", list(self.names), f"the only modulus and {self.overall} are the same number; leave one out")

    def _refuse_modulus(self, scene: Scene) -> None:
        """A free shear modulus needs a place in the scene, and numbers of what else is in units of it."""
        if not self.free_modulus:
            return
        if scene.scales is None and scene.modulus is not None and not _is_even(scene):
            raise InputError(
                "membrane.modulus", scene.modulus, "a scene with scales is allowed where the modulus varies along the meridian"
            )
        known = names(scene)
        lacking = [name for name in self.beside_modulus(scene) if name not in known]
        if isinstance(scene.remanence, Along):
            lacking.append("membrane.remanence")
        if len([n for n in known if n.startswith("load.")]) < len(scene.loads):
            lacking.append("load")
        if lacking:
            allowed = f"a known shear modulus is allowed here: {lacking[0]} is in units of it, and is no number that could follow it"
            raise InputError("parameters", list(self.names), allowed)

    def _beside_mu(self) -> dict[str, float]:
        """Numbers of a model that stand beside its shear modulus."""
        material: Any = self.scene.material
        own = {f.name: float(getattr(material, f.name)) for f in dataclasses.fields(material) if f.init}
        return {n: v if n in _RATIOS else v * self.modulus for n, v in own.items()}

    def _value(self, name: str) -> float:
        if name in OVERALL:
            return self.modulus
        if self.by_moduli and name.startswith("material."):
            return self.absolute[name.removeprefix("material.")]
        return Parameter(self.scene, name).value

    def is_modulus(self, name: str) -> bool:
        """Whether a number has the unit of stress."""
        if not name.startswith("material."):
            return name in OVERALL
        return self.by_moduli and name.removeprefix("material.").partition(".")[0] not in _RATIOS | {"alpha"}

    def unit_of(self, name: str) -> str:
        """The unit of a number: Pa, or empty."""
        return "Pa" if self.is_modulus(name) and self.scene.scales is not None else ""

    def _coordinate(self, name: str, value: float) -> Coordinate:
        table, _, rest = name.partition(".")
        if table != "material" and name not in OVERALL:
            positive = rest.endswith(("strength", "susceptibility", "prestretch", "saturation", "volume", "radius"))
            return Coordinate(False, low=0.0) if positive else Coordinate(False)
        free = _FREE.get(self.model, ())
        if self.model == "polynomial" and name not in OVERALL:
            return Coordinate(False)
        if rest in free or rest in _SHARES:
            if self.model == "yeoh" and rest == "c2":
                return Coordinate(False)
            if rest == "poisson_ratio":
                return Coordinate(False, low=-1.0 + 1e-9, high=0.5)
            return Coordinate(False, low=0.0, high=1.0 if rest == "share" else math.inf)
        if value == 0:
            return Coordinate(False)
        return Coordinate.of_one_sign(value, rest)

    # --- coordinates of the solver

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Of the coordinates."""
        return np.array([c.low for c in self.coordinates]), np.array([c.high for c in self.coordinates])

    def to_coordinates(self, values: Array) -> Array:
        x = [math.log(abs(v)) if c.logarithmic else v for v, c in zip(values, self.coordinates, strict=True)]
        shifted = np.array(x, dtype=float)
        if (edge := self._edge(values)) is not None:
            shifted[edge[0]] -= edge[1]
        return shifted

    def from_coordinates(self, x: Array) -> Array:
        values = np.array([c.sign * math.exp(min(v, 700.0)) if c.logarithmic else v for v, c in zip(x, self.coordinates, strict=True)])
        if (edge := self._edge(values)) is not None:
            values[edge[0]] += edge[1]
        return values

    def slopes(self, values: Array) -> Array:
        """d values/d coordinates, shape (n, n)."""
        matrix = np.diag([v if c.logarithmic else 1.0 for v, c in zip(values, self.coordinates, strict=True)])
        if (edge := self._edge(values)) is not None:
            matrix[edge[0]] += edge[2] @ matrix
        return matrix

    def _edge(self, values: Array) -> tuple[int, float, Array] | None:
        """Of Yeoh's material: the place of c3, its least stable value 2 c2^2/(3 * 2 c1) below c2 = 0, and the derivatives of that."""
        if self.model != "yeoh" or "material.c3" not in self.names:
            return None
        found = dict(zip(self.names, values, strict=True))
        known = self.absolute if self.by_moduli else {"c2": self.scene.material.c2}  # type: ignore[attr-defined]
        c2 = found.get("material.c2", known["c2"])
        modulus = self._yeoh_modulus(found)
        gradient = np.zeros(len(values))
        if c2 >= 0:
            return self.names.index("material.c3"), 0.0, gradient
        least = c2 * c2 * _EDGE / (1.5 * modulus)
        for k, name in enumerate(self.names):
            if name == "material.c2":
                gradient[k] = 2 * least / c2
            elif name == "material.c1":
                gradient[k] = -least / modulus * 2
            elif name == "material.mu":
                gradient[k] = -least / modulus
        return self.names.index("material.c3"), least, gradient

    def has_edge(self, k: int) -> bool:
        """Whether the least value of a number depends on others."""
        return self.model == "yeoh" and self.names[k] == "material.c3"

    def _yeoh_modulus(self, found: Mapping[str, float]) -> float:
        if not self.by_moduli:
            return 1.0
        if "mu" in self.absolute:
            return float(found.get("material.mu", self.absolute["mu"]))
        return 2 * float(found.get("material.c1", self.absolute["c1"]))

    # --- the scene

    def split(self, values: Array, scene: Scene | None = None) -> tuple[float, Scene]:
        """Factor of the unit of stress, and the scene with the material over it, for the scene of one of the tests.

        Other numbers of the scene that are in units of stress are divided by the factor: magnets, weights and voltages stay what they are.

        Raises
        ------
        InputError
            For numbers that no scene can have.
        """
        factor, made = self._made(values, scene or self.scene)
        if factor != 1.0:
            for name, power in self.beside_modulus(made).items():
                number = Parameter(made, name)
                made = number.scene_at(number.value * factor**power)
        return factor, made

    def beside_modulus(self, scene: Scene) -> dict[str, float]:
        """Numbers of a scene in units of stress, and by which power of a free shear modulus they change."""
        if not self.free_modulus or not _in_units_of_stress(scene):
            return {}
        known = names(scene)
        powers = {f"source.{k}.strength": -1.0 for k in range(len(scene.sources))}
        powers |= {n: -1.0 for n in known if n.startswith("load.")}
        powers |= {n: -0.5 for n in known if n.startswith("electric.") or n in ("membrane.saturation", "membrane.remanence")}
        return powers

    def _made(self, values: Array, scene: Scene) -> tuple[float, Scene]:
        """The factor, and the scene with its other numbers as they are."""
        factor = _even_modulus(scene)
        if _is_even(scene):
            scene = scene.replace(modulus=None)
        given = dict(zip(self.names, (float(v) for v in values), strict=True))
        if self.overall is not None:
            factor = given.pop(self.overall) / self.unit
        if self.by_moduli:
            numbers = self.absolute | {n.removeprefix("material."): given.pop(n) for n in list(given) if n.startswith("material.")}
            material, modulus = self._material(numbers)
            factor, scene = modulus / self.unit, scene.replace(material=material)
        elif scene.material != self.scene.material:
            scene = scene.replace(material=self.scene.material)
        known = names(scene) if given else ()
        for name, value in given.items():
            if name in known:
                scene = Parameter(scene, name).scene_at(value)
        return factor, scene

    def _material(self, numbers: dict[str, float]) -> tuple[Any, float]:
        """The material over its shear modulus, and this."""
        if not self.model:  # of the user's own, with nothing to change
            return self.scene.material, numbers["mu"]
        if self.model == "ogden":
            count = len(self.scene.material.mu)  # type: ignore[attr-defined]
            mu, alpha = (np.array([numbers[f"{key}.{k}"] for k in range(count)]) for key in ("mu", "alpha"))
            modulus = float(mu @ alpha) / 2
            return Ogden(tuple(mu / modulus), tuple(alpha)), modulus
        if self.model == "mooney-rivlin" and "c10" in numbers:
            return MooneyRivlin(numbers["c01"] / numbers["c10"]), 2 * (numbers["c10"] + numbers["c01"])
        table, found = without_moduli({"model": self.model, **numbers}, None, True)
        if found is None:
            raise InputError("material", numbers, "numbers with a shear modulus are allowed")
        return material_of(table), found

    def fitted_scene(self, values: Array) -> Scene:
        """The scene with these numbers: a free modulus goes into its scales, or without scales into the modulus of its sheet."""
        factor, scene = self._made(values, self.scene)
        if factor == 1.0:
            return scene
        if not self.free_modulus or scene.scales is None:
            return scene.replace(modulus=factor)
        scene = self.split(values)[1]
        scales: Any = scene.scales
        return scene.replace(scales=dataclasses.replace(scales, shear_modulus=factor * self.unit))

    def shear_modulus(self, values: Array) -> float:
        """The shear modulus at rest, in the unit of the moduli."""
        return self._made(values, self.scene)[0] * self.unit


#: how far inside the edge of stability a solver may come
_EDGE = 1.0 + 1e-9


def _in_units_of_stress(scene: Scene) -> bool:
    """Whether numbers of a scene besides its material are in units of the shear modulus."""
    return bool(scene.sources or scene.loads or scene.electric is not None)


def _is_even(scene: Scene) -> bool:
    return isinstance(getattr(scene.modulus, "given", None), (int, float))


def _even_modulus(scene: Scene) -> float:
    """The factor of the modulus where it is one number; 1 where it varies along the meridian, and stays as it is."""
    return float(scene.modulus.given) if _is_even(scene) else 1.0


def _checked_names(parameters: Any) -> tuple[str, ...]:
    allowed = "a list of names of numbers of the scene is allowed, such as ['material.mu', 'material.jm']"
    if isinstance(parameters, str):
        parameters = [parameters]
    try:
        found = tuple(parameters)
    except TypeError:
        raise InputError("parameters", parameters, allowed) from None
    if not found or not all(isinstance(name, str) for name in found):
        raise InputError("parameters", parameters, allowed)
    if len(set(found)) < len(found):
        raise InputError("parameters", list(found), "every name once is allowed")
    return found

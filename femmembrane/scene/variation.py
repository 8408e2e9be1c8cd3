"""One number of a scene by its name, changed while everything else stays.

======================== ==================================================================================================
``source.K.NAME``        a number of source K (from 0): ``source.0.strength``, ``source.0.height``
``load.K.NAME``          a number of load K: ``load.0.gamma``
``obstacle.K.NAME``      a number of obstacle K: ``obstacle.0.height``
``electric.NAME``        what is given of ``electric.voltage``, ``electric.total_charge`` and ``electric.frozen_charge``
``membrane.susceptibility``  chi; ``membrane.saturation`` and ``membrane.remanence``, where they are numbers
``membrane.prestretch``  p of a flat disc or annulus, or of a tube
``mesh.END.radius``      place of an end that has one in the scene: ``mesh.rim.radius``, ``mesh.top.height``
``chamber.NAME``         volume or atmosphere of the chamber of gas
``material.NAME``        a number of a material that has such an argument; others change with it where its ``numbers_with`` says so
``material.mu.K``        modulus K of Ogden's material (from 0); the other moduli are scaled by one factor
``material.alpha.K``     exponent K of Ogden's material; mu_K changes with it so that mu_K alpha_K stays
======================== ==================================================================================================

The two rules for Ogden's material keep the sum of mu alpha at 2, and so the shear modulus at 1, the unit of stress. The scene of a value
holds exactly this value of the named number.
"""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..discretization.lift import Lift, Moving, lift_of
from ..discretization.supports import ENDS, as_support
from ..errors import InputError, unknown_name
from ..physics.magnetisation import Magnetisation
from ..physics.materials import Ogden

if TYPE_CHECKING:
    from ..discretization.meridian import Meridian
    from ..physics.obstacles import Obstacle
    from .value import Scene

#: added to a strength, so that its square root can be differentiated at zero; strengths above 1e-284 do not change
_TINY = 1e-300
#: how a sheet is magnetised beside its susceptibility
MAGNETISATION = ("demagnetization", "saturation", "remanence", "remanence_direction", "remanence_transport")
#: scales that may change while all that was given in SI units stays
SCALES = ("scales.thickness", "scales.shear_modulus")
#: powers of both in the units of numbers by their last names, and of quantities by their kinds (:class:`~femmembrane.Scales`); strengths
#: are squares of what is measured
_POWERS: Mapping[str, tuple[float, float]] = {
    "strength": (0.0, 1.0),
    "weight": (0.0, 1.0),
    "gamma": (1.0, 1.0),
    "force": (1.0, 1.0),
    "atmosphere": (1.0, 1.0),
    "voltage": (1.0, 0.5),
    "total_charge": (0.0, 0.5),
    "frozen_charge": (0.0, 0.5),
    "saturation": (0.0, 0.5),
    "remanence": (0.0, 0.5),
    "pressure": (1.0, 1.0),
    "energy": (1.0, 1.0),
    "gas": (1.0, 1.0),
    "stress": (0.0, 1.0),
    "charge": (0.0, 0.5),
    "capacitance": (-1.0, 0.0),
    "electric_field": (0.0, 0.5),
}
#: parts of a scene that are lists, by their names
_LISTS = {"source": "sources", "load": "loads", "obstacle": "obstacles"}
#: parts of a scene that are objects of their own
_OBJECTS = ("electric", "chamber")


@dataclass(frozen=True)
class Parameter:
    """A number of a scene.

    Parameters
    ----------
    scene : Scene
    name : str
        Its place, as listed above.

    Raises
    ------
    InputError
        For a name that the scene does not have.
    """

    scene: Scene
    name: str

    def __post_init__(self) -> None:
        known = names(self.scene)
        if not isinstance(self.name, str) or self.name not in known:
            raise unknown_name("parameter", self.name, known or ["(this scene has no number to vary)"])
        if self.name.startswith("material.mu.") and len(self.scene.material.mu) == 1:  # type: ignore[attr-defined]
            raise InputError("parameter", self.name, "the only modulus is 2/alpha, fixed by the unit of stress; vary material.alpha.0")

    @property
    def even(self) -> bool:
        """Whether its square alone acts, as that of a voltage or a charge."""
        return self.name.startswith("electric.")

    @property
    def value(self) -> float:
        """The number in the scene given."""
        part, _, rest = self.name.partition(".")
        if part == "membrane":
            return float(getattr(self.scene, rest) or 0.0)
        if part in _OBJECTS:
            return float(getattr(getattr(self.scene, part), rest))
        if part == "mesh":
            end, _, direction = rest.partition(".")
            return float(getattr(self.scene.mesh, end)[direction])
        place, _, name = rest.rpartition(".") if part in _LISTS else ("", "", rest)
        owner = getattr(self.scene, _LISTS[part])[int(place)] if part in _LISTS else self.scene.material
        key, _, index = name.partition(".")
        number = getattr(owner, key)
        return float(number[int(index)] if index else number)

    def scene_at(self, value: float) -> Scene:
        """The scene with this value, checked like every scene.

        The moment in the scales is left out once no dipole has the strength that belongs to it.

        Raises
        ------
        InputError
            For a value that the scene cannot take.
        """
        part, _, rest = self.name.partition(".")
        if part == "membrane":
            return self.scene.replace(**{rest: value})
        if part == "mesh":
            return self.scene.replace(mesh=self._mesh_at(value))
        if part in _OBJECTS:
            return self.scene.replace(**{part: dataclasses.replace(getattr(self.scene, part), **{rest: value})})
        if part == "material":
            material: Any = self.scene.material
            if rest.startswith("mu."):
                self._check_modulus(value, material.alpha[int(rest[3:])])
            return self.scene.replace(material=dataclasses.replace(material, **self._material_numbers(rest, value)))
        index, name = int(rest.partition(".")[0]), rest.partition(".")[2]
        if part in ("load", "obstacle"):
            owners: Any = getattr(self.scene, _LISTS[part])
            changed = {_LISTS[part]: (*owners[:index], dataclasses.replace(owners[index], **{name: value}), *owners[index + 1 :])}
            try:
                return self.scene.replace(**changed)
            except InputError:
                if part == "load" or self.scene.squeezed:
                    raise
            return self.scene.replace(**changed, squeezed=True)
        sources: list[Any] = list(self.scene.sources)
        sources[index] = dataclasses.replace(sources[index], **{name: value})
        scales = self.scene.scales
        if scales is not None and not scales.fits(sources):
            scales = dataclasses.replace(scales, dipole_moment=None)
        return self.scene.replace(sources=tuple(sources), scales=scales)

    def vary(self, value: Any) -> Any:
        """The parts of the scene at a value that may be a symbol. They are not checked, and formulas alone may use them."""
        parts, (part, _, rest) = _parts(self.scene), self.name.partition(".")
        if rest.startswith("alpha."):
            parts.material = _with_exponent(parts.material, int(rest[6:]), value)
        elif part == "material":
            parts.material = _unchecked(parts.material, **self._material_numbers(rest, value))
        else:
            self._put(parts, value)
        return parts

    def _put(self, parts: SimpleNamespace, value: Any) -> None:
        """Change parts of the scene to those at a value; of a number that is not one of the material."""
        scene, (part, _, rest) = self.scene, self.name.partition(".")
        if part in ("chamber", "obstacle"):  # of the control, or of what stands in the way, and of no potential
            return
        if part == "electric":
            given: Any = scene.electric
            parts.electricity = _unchecked(dataclasses.replace(given, **{rest: 1.0}).plain(scene.scales), **{rest: value / self.unit})
        elif rest == "prestretch":  # the lift of p is p - 1 times that of 2
            parts.prestretch, parts.lifted = 2.0, Moving.between(value - 1, 2.0, None, _lift(scene.mesh, 2.0), 1.0)
        elif part == "mesh":
            vars(parts).update(self._moved(value))
        elif part == "membrane" and rest in MAGNETISATION:
            setattr(parts, rest, value)
        elif part == "membrane" and Magnetisation.of(scene) is not None:
            parts.susceptibility = value
        elif part == "membrane":  # chi |h|^2 = |sqrt(chi) h|^2
            parts.sources, parts.susceptibility = tuple(_Scaled(s, value) for s in parts.sources), 1.0
        else:
            index, name = int(rest.partition(".")[0]), rest.partition(".")[2]
            owners = getattr(parts, _LISTS[part])
            if name == "strength":
                changed: Any = _Scaled(_unchecked(owners[index], strength=1.0), value)
            else:
                changed = _unchecked(owners[index], **{name: value})
            setattr(parts, _LISTS[part], (*owners[:index], changed, *owners[index + 1 :]))

    @property
    def unit(self) -> float:
        """What a voltage or a charge is divided by in formulas; 1 for any other number."""
        given: Any = self.scene.electric
        if not self.name.startswith("electric.") or given.relative_permittivity is None:
            return 1.0
        return float(given.units(self.scene.scales)[self.name.partition(".")[2]])

    @property
    def moves(self) -> bool:
        """Whether it moves an end of the membrane."""
        return self.name.startswith("mesh.") or self.name == "membrane.prestretch"

    @property
    def shapes(self) -> bool:
        """Whether it moves a rigid body, or changes the shape of one."""
        part, place, *_ = self.name.split(".")
        return part == "obstacle" or (part == "source" and getattr(self.scene.sources[int(place)], "obstacle", None) is not None)

    def bodies_at(self, value: float) -> tuple[Obstacle, ...]:
        """The rigid bodies at a value, which are not checked against the membrane or each other.

        Raises
        ------
        InputError
            For a value that a body cannot have.
        """
        if not self.shapes:
            return self.scene.bodies
        part, place, name = self.name.split(".", 2)
        owners: Any = list(getattr(self.scene, _LISTS[part]))
        owners[int(place)] = dataclasses.replace(owners[int(place)], **{name: value})
        if part == "obstacle":
            return (*owners, *self.scene.bodies[len(owners) :])
        brought = (getattr(source, "obstacle", None) for source in owners)
        return (*self.scene.obstacles, *(body for body in brought if body is not None))

    def rates(self) -> dict[str, float]:
        """How numbers of the scene change with this one, by their names: by 1 for each unit, and those of a material that go with it."""
        part, _, rest = self.name.partition(".")
        if part != "material":
            return {self.name: 1.0}
        name, _, index = rest.partition(".")
        material: Any = self.scene.material
        if not index:  # what goes with a number is linear in it
            ahead, here = (self._material_numbers(name, self.value + step) for step in (1.0, 0.0))
            return {f"material.{key}": ahead[key] - here[key] for key in ahead}
        k, mu, alpha = int(index), material.mu, material.alpha
        if name == "alpha":
            return {self.name: 1.0, f"material.mu.{k}": -mu[k] / alpha[k]}
        others = sum(m * a for j, (m, a) in enumerate(zip(mu, alpha, strict=True)) if j != k)
        return {f"material.mu.{j}": 1.0 if j == k else -m * alpha[k] / others for j, m in enumerate(mu)}

    def _mesh_at(self, value: float | None) -> Meridian:
        """The mesh with this place of the end; None is where the end rests."""
        end, _, direction = self.name.removeprefix("mesh.").partition(".")
        mesh: Any = self.scene.mesh
        placed: Meridian = dataclasses.replace(mesh, **{end: {**getattr(mesh, end), direction: value}})
        return placed

    def _moved(self, value: Any) -> dict[str, Any]:
        """The lift over the place of an end, and a mesh on which that is somewhere else than at rest."""
        mesh, (end, direction) = self.scene.mesh, self.name.split(".")[1:]
        at_ends = mesh.position(mesh.breakpoints()[[0, -1]])
        size = float(at_ends[0].max())
        place = _place(mesh, end) or 0
        rest = float(at_ends[direction == "height"][place])
        at = self.value if self.value != rest else rest + size
        unmoved = lift_of(self._mesh_at(None), self.scene.prestretch)
        way = Moving.between(value - rest, at, unmoved, _lift(self._mesh_at(rest + size)), size)
        if as_support(mesh.supports()[place]).wall and direction == "radius":
            way = dataclasses.replace(way, sliding=(1.0, 0.0) if place == 0 else (0.0, 1.0), wall=value**2 - at**2)
        return {"mesh": self._mesh_at(at), "lifted": way}

    def _check_modulus(self, value: float, alpha: float) -> None:
        if not 0 < value * alpha < 2:
            allowed = f"values between 0 and {2 / alpha:.9g} are allowed: the other moduli share what is left of the sum of mu alpha = 2"
            raise InputError(self.name, value, allowed)

    def _material_numbers(self, rest: str, value: Any) -> dict[str, Any]:
        name, _, index = rest.partition(".")
        material: Any = self.scene.material
        if not index:
            changed: dict[str, Any] = getattr(material, "numbers_with", _alone)(name, value)
            return changed
        k, mu, alpha = int(index), list(material.mu), list(material.alpha)
        if name == "alpha":
            mu[k] = mu[k] * alpha[k] / value
            alpha[k] = value
        else:
            others = sum(m * a for j, (m, a) in enumerate(zip(mu, alpha, strict=True)) if j != k)
            share = (2 - value * alpha[k]) / others
            mu = [value if j == k else m * share for j, m in enumerate(mu)]
        return {"mu": tuple(mu), "alpha": tuple(alpha)}


@dataclass(frozen=True)
class Scale:
    """A scale of a scene in SI units, by which everything that was given in SI units becomes another number.

    Lengths, ratios and the numbers of a material stay. What is held, as a pressure in Pa is, becomes another number too.

    Parameters
    ----------
    scene : Scene
        With scales.
    name : {"scales.thickness", "scales.shear_modulus"}

    Raises
    ------
    InputError
        For another name, a scene without scales, and sources and loads of one's own, which nobody can convert.
    """

    scene: Scene
    name: str

    def __post_init__(self) -> None:
        known = [*names(self.scene), *(SCALES if self.scene.scales is not None else ())]
        if self.name not in known or self.name not in SCALES:
            raise unknown_name("parameter", self.name, known)
        numbers = set(names(self.scene))
        for k, source in enumerate(self.scene.sources):
            if f"source.{k}.strength" not in numbers:
                raise InputError("parameter", self.name, f"sources with a strength are allowed, which is converted; not {source!r}")
        for load in self.scene.loads:
            if not all(name in _POWERS for name in _numbers(load)):
                raise InputError("parameter", self.name, f"loads of the package are allowed, whose numbers are converted; not {load!r}")

    @property
    def value(self) -> float:
        """The scale in SI units."""
        return float(getattr(self.scene.scales, self.name.partition(".")[2]))

    @property
    def moves(self) -> bool:
        """Whether it moves an end of the membrane."""
        return False

    def power(self, name: str) -> float:
        """Power of the scale in the unit of a number of the scene, or of a quantity by its kind."""
        known = _POWERS.get(name) or (_POWERS.get(name.rpartition(".")[2]) if "." in name else None) or (0.0, 0.0)
        return known[SCALES.index(self.name)]

    def rates(self) -> dict[str, float]:
        """How numbers of the scene change with the scale, by their names."""
        found = ((name, self.power(name) * _named(self.scene, name).value) for name in names(self.scene))
        return {name: -product / self.value for name, product in found if product}

    def scene_at(self, value: float) -> Scene:
        """The scene with this scale and the same SI numbers, checked like every scene.

        Raises
        ------
        InputError
            For a scale that is not positive.
        """
        old: Any = self.scene.scales
        scales = dataclasses.replace(old, **{self.name.partition(".")[2]: value})
        scene, electric = self.scene, self.scene.electric
        for name in self.rates():
            if not (name.startswith("electric.") and getattr(electric, "relative_permittivity", None) is not None):
                parameter = _named(scene, name)
                scene = parameter.scene_at(parameter.value * (self.value / value) ** self.power(name))
        return scene.replace(scales=scales)


@dataclass(frozen=True)
class Numbers:
    """Several numbers of a scene, each of which may have any value while all others stay.

    Nothing goes with a number here: moduli of Ogden's material are independent, and their sum of mu alpha may be another than 2.

    Parameters
    ----------
    scene : Scene
    names : tuple of str
        Places of the numbers, as listed above.

    Raises
    ------
    InputError
        For a name that the scene does not have.
    """

    scene: Scene
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        known = names(self.scene)
        for name in self.names:
            if not isinstance(name, str) or name not in known:
                raise unknown_name("parameter", name, known or ["(this scene has no number to vary)"])

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The numbers one by one."""
        return tuple(_named(self.scene, name) for name in self.names)

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers in the scene given."""
        return tuple(parameter.value for parameter in self.parameters)

    def vary(self, values: Sequence[Any]) -> Any:
        """The parts of the scene at values that may be symbols, as :meth:`Parameter.vary`."""
        parts, given = _parts(self.scene), dict(zip(self.names, values, strict=True))
        # a strength stands before the whole field of a source, and the susceptibility before that of all
        for parameter in sorted(self.parameters, key=lambda p: (p.name == "membrane.susceptibility", p.name.endswith(".strength"))):
            if not parameter.name.startswith("material."):
                parameter._put(parts, given[parameter.name])
        own = {name.removeprefix("material."): value for name, value in given.items() if name.startswith("material.")}
        if isinstance(parts.material, Ogden):
            parts.material = _with_terms(parts.material, own)
        elif own:
            parts.material = _unchecked(parts.material, **own)
        return parts


def names(scene: Scene) -> list[str]:
    """Names of all numbers of a scene that can be varied."""
    found = [f"source.{k}.{name}" for k, source in enumerate(scene.sources) for name in _numbers(source)]
    found += [f"load.{k}.{name}" for k, load in enumerate(scene.loads) for name in _numbers(load)]
    found += [f"obstacle.{k}.{name}" for k, body in enumerate(scene.obstacles) for name in _numbers(body)]
    if scene.electric is not None:
        found.append(f"electric.{scene.electric.load}")
    if scene.sources:
        found.append("membrane.susceptibility")
        found += [f"membrane.{name}" for name in ("saturation", "remanence") if isinstance(getattr(scene, name), Real)]
    if _can_be_stretched(scene):
        found.append("membrane.prestretch")
    found += [
        f"mesh.{end}.{direction}"
        for end in ENDS
        if isinstance(held := getattr(scene.mesh, end, None), Mapping) and _place(scene.mesh, end) is not None
        for direction in ("radius", "height")
        if direction in held
    ]
    if getattr(scene, "chamber", None) is not None:
        found += [f"chamber.{name}" for name in _numbers(scene.chamber)]
    material = scene.material
    if isinstance(material, Ogden):
        return found + [f"material.{key}.{k}" for key in ("mu", "alpha") for k in range(len(material.mu))]
    return found + [f"material.{name}" for name in _numbers(material)]


def parameter_of(scene: Scene, name: str) -> Parameter | Scale:
    """A number of a scene, or one of its scales, by its name.

    Raises
    ------
    InputError
        For a name that the scene does not have.
    """
    return Scale(scene, name) if isinstance(name, str) and name in SCALES else Parameter(scene, name)


def _named(scene: Scene, name: str) -> Parameter:
    """A number whose name is known to be one."""
    named: Parameter = _unchecked(Parameter.__new__(Parameter), scene=scene, name=name)
    return named


def _parts(scene: Scene) -> SimpleNamespace:
    """The parts of a scene that formulas use."""
    kept = (
        *("mesh", "degree", "tension_field", "thickness", "modulus", "prestretch", "element_ends", "material", "sources", "loads"),
        *("bodies", "borders", "follows"),
    )
    found = {name: getattr(scene, name) for name in ("susceptibility", "electricity", *MAGNETISATION, *kept)}
    return SimpleNamespace(**found)


def _place(mesh: Any, end: str) -> int | None:
    """Which of the two points of a meridian is the end with a name; None where that is a pole."""
    bare = dataclasses.replace(mesh, **{end: getattr(mesh, end)["kind"]})
    return next((k for k, (own, other) in enumerate(zip(mesh.supports(), bare.supports(), strict=True)) if own != other), None)


def _lift(mesh: Meridian, prestretch: float = 1.0) -> Lift:
    lift = lift_of(mesh, prestretch)
    if lift is None:  # no caller asks where every end rests
        raise InputError("mesh", mesh, "an end with another place than the one at which it rests is allowed")
    return lift


def _can_be_stretched(scene: Scene) -> bool:
    try:
        return lift_of(scene.mesh, 2.0) is not None
    except InputError:
        return False


def _numbers(owner: Any) -> list[str]:
    """The real arguments of an object. An argument declared as int (an orientation, a count) cannot vary continuously."""
    if not dataclasses.is_dataclass(owner):
        return []
    real = [f.name for f in dataclasses.fields(owner) if f.init and f.type in ("float", float)]
    return [name for name in real if isinstance(getattr(owner, name), Real)]


def _alone(name: str, value: Any) -> dict[str, Any]:
    """A number of a material without others that must change with it."""
    return {name: value}


def _unchecked(owner: Any, **changes: Any) -> Any:
    """A copy of a frozen object with some attributes replaced behind its back, so that they may be symbols."""
    new = copy.copy(owner)
    for name, value in changes.items():
        object.__setattr__(new, name, value)
    return new


@dataclass(frozen=True)
class _Scaled:
    """A source whose field is multiplied by the square root of a factor."""

    source: Any
    factor: Any

    @property
    def sees(self) -> frozenset[str]:
        return frozenset(self.source.sees)

    def field(self, rho: Any, eta: Any) -> tuple[Any, ...]:
        amplitude = np.sqrt(self.factor + _TINY)
        return tuple(amplitude * component for component in self.source.field(rho, eta))

    def jet(self, rho: Any, eta: Any) -> Any:
        jet = self.source.jet(rho, eta)
        amplitude = np.sqrt(self.factor + _TINY)
        return None if jet is None else type(jet)(*(amplitude * part for part in jet))

    def intensity(self, rho: Any, eta: Any) -> Any:
        return self.factor * self.source.intensity(rho, eta)


def _with_exponent(material: Any, k: int, value: Any) -> Any:
    """Ogden's material with another exponent in term k, of unchanged sign, and mu_k alpha_k as it was."""
    rest = _unchecked(material, **{key: getattr(material, key)[:k] + getattr(material, key)[k + 1 :] for key in ("mu", "alpha")})
    term = _unchecked(material, mu=material.mu[k : k + 1], alpha=material.alpha[k : k + 1])
    return _Sum((rest, _Stretched(term, value / material.alpha[k])))


def _with_terms(material: Ogden, numbers: Mapping[str, Any]) -> Any:
    """Ogden's material with some moduli and exponents of its terms replaced; exponents of unchanged signs."""
    mu = tuple(numbers.get(f"mu.{k}", m) for k, m in enumerate(material.mu))
    if not any(name.startswith("alpha.") for name in numbers):
        return _unchecked(material, mu=mu) if numbers else material
    whole: Any = None
    for k, (modulus, alpha) in enumerate(zip(mu, material.alpha, strict=True)):
        ratio = numbers[f"alpha.{k}"] / alpha if f"alpha.{k}" in numbers else None
        # a material at stretched strains has the modulus mu/t
        term = _unchecked(material, mu=(modulus if ratio is None else modulus * ratio,), alpha=(alpha,))
        term = term if ratio is None else _Stretched(term, ratio)
        whole = term if whole is None else _Sum((whole, term))
    return whole


@dataclass(frozen=True)
class _Stretched:
    """A material at strains multiplied by a ratio, with the same modulus: W(t e)/t^2. It takes alpha to t alpha and mu to mu/t."""

    material: Any
    ratio: Any

    def energy(self, e1: Any, e2: Any) -> Any:
        return self.material.energy(self.ratio * e1, self.ratio * e2) / self.ratio**2

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        s1, s2 = self.material.stress(self.ratio * e1, self.ratio * e2)
        return s1 / self.ratio, s2 / self.ratio

    def tangent(self, e1: Any, e2: Any) -> Any:
        return self.material.tangent(self.ratio * e1, self.ratio * e2)


@dataclass(frozen=True)
class _Sum:
    """Two materials side by side."""

    parts: tuple[Any, Any]

    def energy(self, e1: Any, e2: Any) -> Any:
        return sum(part.energy(e1, e2) for part in self.parts)

    def stress(self, e1: Any, e2: Any) -> tuple[Any, ...]:
        return tuple(a + b for a, b in zip(*(part.stress(e1, e2) for part in self.parts), strict=True))

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, ...]:
        return tuple(a + b for a, b in zip(*(part.tangent(e1, e2) for part in self.parts), strict=True))

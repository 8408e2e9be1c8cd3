"""Derivatives of what an equilibrium answers with respect to numbers of its scene.

The derivatives of the state come from :mod:`..solve.sensitivity`, with the factors of K. From them follow exactly those of pressure,
volume, height, energies and axisymmetric eigenvalues. Profiles, electric quantities and eigenvalues against waves around the axis are
explicit formulas of the state and the numbers. They are differentiated along the exact derivative of the state, by differences
extrapolated to step 0, which leaves about ten digits; nothing is solved for that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import choice
from ..errors import InputError, SolveError, Status, unknown_name
from ..quantities import PROFILE, quantity
from ..scene.run import GAS, PRESCRIBED
from ..scene.variation import Scale
from ..solve.beside import BesideBodies, sensitive
from ..solve.controls import CONTROLS, Control, check_height
from ..solve.sensitivity import FOLDS, Rates, Sensitive, differentiated
from ..solve.state import inner
from . import door
from .contact import contact_of
from .equilibrium import electric_of

if TYPE_CHECKING:
    from ..potential import Evaluation, Potential
    from ..scene import Scene
    from .branch import Branch
    from .equilibrium import Equilibrium
    from .special_point import SpecialPoint

Array = NDArray[np.float64]

#: what can be held, by the words that users have for it
HELD = {**{name: name for name in CONTROLS}, **PRESCRIBED, GAS: GAS}
_ENERGIES = {f"{name}_energy": name for name in ("elastic", "magnetic", "load", "electric")}
_ELECTRIC = ("voltage", "charge", "capacitance", "electric_field")
_PROFILE = ("rho", "eta", *PROFILE)
_CONTACT = ("contact_radius", "contact_reference_radius", "contact_force", "contact_area")
#: what can be differentiated
DIFFERENTIABLE = (*CONTROLS, "gas_amount", "energy", *_ENERGIES, *_ELECTRIC, "eigenvalue", *_PROFILE, *_CONTACT)
#: names of quantities of the first limit point of a branch, and what they are there
OF_LIMIT = {"limit_pressure": "pressure", "limit_volume": "volume", "limit_height": "center_height"}
#: step of differences of explicit formulas, relative to the number and to the membrane's own size
_STEP = 2e-3

Answer = float | Array


@dataclass(frozen=True)
class Along:
    """What an eigenvalue or a profile is asked for: where, and against which perturbations."""

    r: ArrayLike | None = None
    control: str | None = None
    azimuthal: int = 0


class _Derived:
    """One equilibrium that moves with numbers of its scene."""

    def __init__(self, eq: Equilibrium, potential: Potential, known: Sensitive, rates: Rates, along: Along) -> None:
        self.eq, self.potential, self.known, self.rates, self.along = eq, potential, known, rates, along
        self._evaluation = potential.evaluate(eq.state, eq.pressure)
        self._profiles: list[dict[str, Array]] | None = None

    def of(self, name: str) -> list[Answer]:
        """Derivatives of a quantity with respect to all numbers."""
        plain, factor = self._plain(name)
        found = self._of(plain)
        if plain == name:
            return found
        kind, value = quantity(plain).si, self._value(plain)
        powers = [p.power(kind) / p.value if isinstance(p, Scale) else 0.0 for p in self.known.parameters]
        return [factor * (rate + power * value) for rate, power in zip(found, powers, strict=True)]

    def _value(self, name: str) -> Answer:
        """The quantity itself."""
        if name in _CONTACT:
            return float(getattr(self.eq.contact, name.removeprefix("contact_")))
        if name not in _PROFILE:
            return float(getattr(self.eq, name))
        return self.eq.profile(self.along.r)[name]

    def _plain(self, name: str) -> tuple[str, float]:
        """The quantity without SI units, and what its derivative is multiplied by."""
        if name in DIFFERENTIABLE:
            return name, 1.0
        from ..quantities import in_si

        scales = self.eq.scene.converter
        for stem in DIFFERENTIABLE:
            kind = quantity(stem).si
            if scales is not None and kind and in_si(stem) == name and scales.converts(kind):
                return stem, float(scales.to_si(kind, 1.0))
        raise unknown_name("of", name, DIFFERENTIABLE)

    def _of(self, name: str) -> list[Answer]:
        rates, eq = self.rates, self.eq
        if name in CONTROLS:
            return _floats({"pressure": rates.pressure, "volume": rates.volume, "center_height": rates.height}[name])
        if name == "gas_amount":
            return _floats(self._amount())
        if name == "energy" or name in _ENERGIES:
            return _floats(self._energy(name))
        if name in _ELECTRIC:
            return [float(v) for v in self._explicit(lambda moved: np.array(_electric(moved, name)))]
        if name in _CONTACT:
            if eq.contact is None or not eq.contact.touching:
                raise InputError("of", name, "allowed where a body is touched")
            return [float(v) for v in self._explicit(lambda moved: np.array(self._contact(moved, name)))]
        if name == "eigenvalue":
            against = self.along.control, self.along.azimuthal
            return _floats(door.eigenvalue_rates(eq, self.known, rates, *against, self.moved, self.step, self.at))
        if self._profiles is None:
            self._profiles = self._profile_rates()
        return [columns[name] for columns in self._profiles]

    def _amount(self) -> Array:
        gas = self.eq.enclosed
        if gas is None:
            raise InputError("of", "gas_amount", "no gas holds this equilibrium; a scene with chamber=fm.Chamber(volume=...) has one")
        total, absolute = self.eq.volume + gas.chamber, self.eq.pressure + gas.atmosphere
        own = absolute * self.known.through("chamber.volume") + total * self.known.through("chamber.atmosphere")
        amount: Array = self.rates.pressure * total + absolute * self.rates.volume + own
        return amount

    def _energy(self, name: str) -> Array:
        if self.potential.charged is not None or self.eq.scene.bodies:
            return np.array([float(v) for v in self._explicit(lambda moved: np.array(getattr(self.at(moved)[1], name)))])
        parts = self.known.energies(self.eq.state, self.eq.pressure)
        wanted = parts if name == "energy" else [_ENERGIES[name]]
        total = np.zeros(len(self.known.names))
        for part in wanted:
            if part in parts:
                state, numbers = parts[part]
                total = total + state @ self.rates.x + numbers
        return total

    def step(self, k: int) -> float:
        """Step of number k that moves neither it nor the membrane far."""
        value = abs(self.known.parameters[k].value)
        dx, dp = self.rates.x[:, k], float(self.rates.pressure[k])
        move = float(np.sqrt(inner(self.potential, dx, dp, dx, dp)))
        return _STEP * min(value or 1.0, 1 / move if move else np.inf)

    def moved(self, k: int, t: float) -> tuple[Scene, Array, float]:
        """Scene and state after number k has changed by t, to first order; beside bodies its held nodes are on these."""
        parameter = self.known.parameters[k]
        scene = parameter.scene_at(parameter.value + t) if t else self.eq.scene
        x = self.eq.state + t * self.rates.x[:, k]
        if isinstance(self.known, BesideBodies):
            borders = self._borders(k, t)
            scene, x = scene.bordered(borders), self.known.placed(self._evaluation, k, t, x, borders)
        return scene, x, self.eq.pressure + t * float(self.rates.pressure[k])

    def _borders(self, k: int, t: float) -> tuple[tuple[int, float], ...]:
        """Ends of elements that follow borders of contact after number k has changed by t."""
        rates = self.rates.borders
        if rates is None:
            return ()
        return tuple((end, s + t * float(rate)) for (end, s), rate in zip(self.eq.scene.borders, rates[:, k], strict=True))

    def at(self, moved: tuple[Scene, Array, float]) -> tuple[Potential, Evaluation]:
        """Potential and evaluation of a moved state, with the same nodes held."""
        potential = door.holding(moved[0], self._evaluation)
        return potential, potential.evaluate(moved[1], moved[2])

    def _contact(self, moved: tuple[Scene, Array, float], name: str) -> float:
        return float(getattr(contact_of(self.at(moved)[1]), name.removeprefix("contact_")))

    def _explicit(self, formula: Callable[[tuple[Scene, Array, float]], Array]) -> list[Array]:
        return [differentiated(lambda t, k=k: formula(self.moved(k, t)), self.step(k)) for k in range(len(self.known.names))]  # type: ignore[misc]

    def _profile_rates(self) -> list[dict[str, Array]]:
        s, shown = self.eq.places(self.along.r), (*_PROFILE,)

        def rows(moved: tuple[Scene, Array, float]) -> Array:
            columns = door.profile_at(*moved, s).columns()
            return np.stack([columns[name] for name in shown])

        found = self._explicit(rows)
        for k in range(len(found)):
            self._one_sided(found[k], k, s, rows)
        return [dict(zip(shown, each, strict=True)) for each in found]

    def _one_sided(self, found: Array, k: int, s: Array, rows: Callable[[tuple[Scene, Array, float]], Array]) -> None:
        """Take the side on which a border of contact goes away from a place that it sweeps over: slopes jump there."""
        step, here = self.step(k), self.eq.scene.borders
        for sign in (1.0, -1.0):
            swept = np.zeros(s.shape, dtype=bool)
            for (_, a), (_, b) in zip(here, self._borders(k, sign * step), strict=False):
                reach = 2 * abs(b - a)
                # a place at the border itself belongs to the element behind it
                swept |= (np.abs(s - a) <= reach) & ((s >= a) if b < a else (s < a))
            if swept.any():
                own = differentiated(lambda t, sign=sign: rows(self.moved(k, sign * abs(t))) * sign, step, sided=True)  # type: ignore[misc]
                found[:, swept] = own[:, swept]


def _floats(values: Array) -> list[Answer]:
    return [float(value) for value in values]


def _electric(moved: tuple[Scene, Array, float], name: str) -> float:
    return electric_of(*moved[:2])[name]


def sensitivity_of(eq: Equilibrium, of: Any, to: Any, held: str | None, along: Along) -> Any:
    """See :meth:`.Equilibrium.sensitivity`."""
    quantities, known = _listed("of", of), _known(eq.scene, to)
    if eq.status is Status.INTERPOLATED:
        raise SolveError("an interpolated state is in no exact balance, and has no exact derivatives", status=Status.INTERPOLATED)
    potential, control = eq.potential, _control(eq, held)
    evaluation = potential.evaluate(eq.state, eq.pressure)
    rates = known.at_control(evaluation, eq.pressure, control)
    return _shaped(_Derived(eq, potential, known, rates, along), quantities, of, to)


def sensitivity_of_point(point: SpecialPoint, of: Any, to: Any, along: Along) -> Any:
    """See :meth:`.SpecialPoint.sensitivity`."""
    eq = point.equilibrium
    quantities, known = _listed("of", of), _known(eq.scene, to)
    if point.kind not in FOLDS:
        allowed = f"a {' or a '.join(kind.replace('_', ' ') for kind in FOLDS)} is allowed: others have no equation that is followed here"
        raise InputError("point.kind", point.kind, allowed)
    potential = eq.potential
    evaluation = potential.evaluate(eq.state, eq.pressure)
    if evaluation.spring is not None:
        raise InputError("electric.total_charge", eq.charge, "a voltage is allowed at a fold: a total charge couples all points")
    rates = known.at_fold(evaluation, eq.pressure, point.kind)
    return _shaped(_Derived(eq, potential, known, rates, along), quantities, of, to)


def sensitivity_along(branch: Branch, of: Any, to: Any, held: str | None, along: Along) -> Any:
    """See :meth:`.Branch.sensitivity`."""
    quantities = _listed("of", of)
    at_limit = [name for name in quantities if name in OF_LIMIT]
    if at_limit and len(at_limit) < len(quantities):
        raise InputError("of", of, f"{at_limit[0]} is one number, and others are one for each equilibrium: ask for them in two calls")
    if at_limit:
        inside = sensitivity_of_point(_first_limit(branch, of), [OF_LIMIT[name] for name in quantities], to, along)
        named = {name: inside[OF_LIMIT[name]] for name in quantities}
        return named[of] if isinstance(of, str) else named
    if held is None and branch.hold:
        held = next(iter(branch.hold))
    found = [sensitivity_of(eq, of, to, held, along) for eq in branch]
    return _stacked(found)


def _stacked(found: Sequence[Any]) -> Any:
    if found and isinstance(found[0], Mapping):
        return {key: _stacked([one[key] for one in found]) for key in found[0]}
    return np.array(found)


def _first_limit(branch: Branch, of: Any) -> SpecialPoint:
    if branch.special_points is None:
        raise InputError("of", of, "special points of this branch were not looked for; fm.trace with special_points=True finds them")
    for point in branch.special_points:
        if point.kind == "limit_point":
            return point
    raise InputError("of", of, "this branch has no limit point")


def _shaped(derived: _Derived, quantities: Sequence[str], of: Any, to: Any) -> Any:
    """A value, or a mapping by the names in a list."""

    def one(name: str) -> Any:
        values = derived.of(name)
        return values[0] if isinstance(to, str) else dict(zip(derived.known.names, values, strict=True))

    return one(of) if isinstance(of, str) else {name: one(name) for name in quantities}


def _listed(key: str, given: Any) -> tuple[str, ...]:
    if isinstance(given, str):
        return (given,)
    if not isinstance(given, Sequence) or not given or not all(isinstance(name, str) for name in given):
        raise InputError(key, given, "a name or a list of names is allowed")
    return tuple(dict.fromkeys(given))


def _known(scene: Scene, to: Any) -> Sensitive:
    """The derivatives of the equations of a scene with respect to numbers that it has."""
    try:
        return sensitive(scene, _listed("to", to))
    except InputError as error:
        if error.key != "parameter":
            raise
        raise InputError("to", error.value, error.allowed) from None


def _control(eq: Equilibrium, held: str | None) -> Control:
    """The control that holds the equilibrium."""
    if held is None:
        run = eq.scene.run
        prescribed = None if run is None else run.quantity
        held = GAS if eq.gas is not None else prescribed if prescribed in HELD else "volume"
    name = HELD[choice("held", held, HELD)]
    if name == "center_height":
        check_height("held", eq.potential)
    if name != GAS:
        return CONTROLS[name].at(float(getattr(eq, name)))
    gas = eq.enclosed
    if gas is None:
        raise InputError("held", held, "no gas holds this equilibrium; a scene with chamber=fm.Chamber(volume=...) has one")
    return gas

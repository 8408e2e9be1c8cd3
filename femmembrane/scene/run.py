"""The equilibria that are asked for: the table [run]."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import choice, number, sequence, sign, store, whole
from ..errors import InputError
from ..quantities import PLACES

#: words of [run].control, and the public name of the quantity that each prescribes; arc length prescribes none
PRESCRIBED = {"volume": "volume", "pressure": "pressure", "height": "center_height"}
#: the amount of gas in the chamber of the scene is prescribed as well
GAS = "gas"
CONTROLS = (*PRESCRIBED, GAS, "arc-length")
#: quantities that a minimiser can hold; no potential holds the height of the pole
MINIMISED = ("volume", "pressure")
AT_LIMIT = ("stop", "jump")
SOLVERS = ("ipopt", "newton")
#: quantities that may be held while a number of the scene changes
HELD = (*PLACES, GAS)
#: equilibria of a run, which has to keep them all
MAX_STEPS = 10**6
_MAX_STEPS = 400


class Target(Mapping[str, float]):
    """Where a branch ends: a mapping of one quantity to one value, hashable."""

    def __init__(self, quantity: str, value: float) -> None:
        self._item = (quantity, value)

    def __getitem__(self, key: str) -> float:
        if key != self._item[0]:
            raise KeyError(key)
        return self._item[1]

    def __iter__(self) -> Iterator[str]:
        return iter(self._item[:1])

    def __len__(self) -> int:
        return 1

    def __hash__(self) -> int:
        return hash(self._item)

    def __repr__(self) -> str:
        return repr(dict(self))


@dataclass(frozen=True)
class Run:
    """The equilibria that are asked for.

    Parameters
    ----------
    control : {"volume", "pressure", "height", "gas", "arc-length"} or the name of a number of the scene
        What is prescribed at each equilibrium: ``source.0.height`` for a magnet that moves. With gas the loads are amounts of it.
    start, stop : float, optional
        First and last load. With arc length ``start`` is the volume of the first equilibrium, and ``stop`` is not used; over a number it
        may be left out.
    steps : int, optional
        Number of equilibria from start to stop, both included (one: start alone).
    values : sequence of float, optional
        The loads one by one, in place of start, stop and steps.
    until : mapping of one quantity to its value, optional
        Where an arc-length run ends: one of ``volume``, ``pressure``, ``center_height``, or the number ``over``.
    over : str, optional
        The number of the scene that changes along an arc-length run in place of the load. It sets out from its value in the scene.
    hold : mapping of one quantity to its value, optional
        What is held while a number changes: one of ``volume``, ``pressure``, ``center_height``, ``gas``.
    max_steps : int
        Most steps of an arc-length run.
    direction : {1, -1}, optional
        Whether an arc-length run sets out to larger or to smaller volumes; over a number to larger or smaller numbers, by default to that
        in ``until``.
    solver : {"ipopt", "newton"}
        The solver under volume and pressure control. Heights and arc length always take the bordered Newton corrector.
    at_limit : {"stop", "jump"}
        Under volume and pressure control a branch may turn back before a load, or lose its stability at a branch point. The run then ends
        there, or snaps to the next stable state.

    Raises
    ------
    InputError
        For a value outside these sets, and for keys that do not go together.
    """

    control: str = "volume"
    start: float | None = None
    stop: float | None = None
    steps: int | None = None
    values: tuple[float, ...] | None = None
    until: Mapping[str, float] | None = None
    max_steps: int = _MAX_STEPS
    direction: int | None = None
    solver: str = "ipopt"
    at_limit: str = "stop"
    over: str | None = None
    hold: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        if not (isinstance(self.control, str) and "." in self.control):  # numbers are known to the scene
            choice("run.control", self.control, CONTROLS)
        self._check_keys()
        self._check_number()
        choice("run.solver", self.solver, SOLVERS)
        choice("run.at_limit", self.at_limit, AT_LIMIT)
        store(
            self,
            start=None if self.start is None else number("run.start", self.start),
            stop=None if self.stop is None else number("run.stop", self.stop),
            steps=None if self.steps is None else whole("run.steps", self.steps, most=MAX_STEPS),
            values=None if self.values is None else _loads("run.values", self.values),
            until=None if self.until is None else _target("run.until", self.until, (*HELD, *([self.over] if self.over else []))),
            hold=None if self.hold is None else _target("run.hold", _public(self.hold), HELD),
            max_steps=whole("run.max_steps", self.max_steps, most=MAX_STEPS),
        )

    @property
    def quantity(self) -> str | None:
        """Public name of the quantity that is prescribed: volume, pressure or center_height; None with arc length."""
        return PRESCRIBED.get(self.control)

    @property
    def number(self) -> str | None:
        """Name of the number of the scene that changes; None where it is a load."""
        return self.over or (self.control if "." in self.control else None)

    @property
    def minimised(self) -> bool:
        """Whether the equilibria are found by minimisation (IPOPT)."""
        prescribed = self.quantity if self.hold is None else next(iter(self.hold))
        return self.solver == "ipopt" and self.control != "arc-length" and prescribed in MINIMISED

    def loads(self) -> NDArray[np.float64]:
        """The prescribed volumes, pressures or heights, shape (number of equilibria,).

        Raises
        ------
        InputError
            With arc length, which has no list of loads.
        """
        if self.values is not None:
            return np.array(self.values)
        if self.start is None or self.stop is None or self.steps is None:
            raise InputError(
                "run.control", self.control, "its loads are found on the way; only volume and pressure control have a list of loads"
            )
        return np.linspace(self.start, self.stop, self.steps)

    def _check_keys(self) -> None:
        by_length = self.control == "arc-length"
        needed: tuple[str, ...] = ("values",) if self.values is not None else ("start", "stop", "steps")
        advice = f"{self.control} control takes start, stop and steps, or values"
        if by_length:
            needed = ("until",) if self.over else ("start", "until")
            advice = f"arc-length control takes {' and '.join(needed)}"
        for name in ("start", "stop", "steps", "values", "until"):
            value = getattr(self, name)
            if value is not None and name not in needed and not (by_length and name == "start"):
                beside = ", not together with run.values" if needed == ("values",) and name != "until" else ""
                raise InputError(f"run.{name}", value, advice + beside)
        for name in needed:
            if getattr(self, name) is None:
                raise InputError(f"run.{name}", None, f"missing; {advice}")
        if self.max_steps != _MAX_STEPS and not by_length:
            raise InputError("run.max_steps", self.max_steps, f"only arc-length control takes it; {advice}")
        if self.direction is not None:
            store(self, direction=sign("run.direction", self.direction, "1 (towards larger volumes) or -1 is allowed"))
        if self.direction not in (None, 1) and not by_length:
            raise InputError("run.direction", self.direction, f"only arc-length control takes it; {advice}")
        if self.direction == 1 and not self.over:
            store(self, direction=None)

    def _check_number(self) -> None:
        """Over a number something is held, and nowhere else."""
        if self.over is not None and self.control != "arc-length":
            raise InputError("run.over", self.over, 'only control = "arc-length" takes it; any other control is itself what changes')
        if self.over is not None and not (isinstance(self.over, str) and "." in self.over):
            raise InputError("run.over", self.over, "the name of a number of the scene is allowed, such as source.0.height")
        known = "one quantity and its value are allowed, such as {pressure = 0.0}; known: " + ", ".join(HELD)
        if self.number is None:
            if self.hold is not None:
                raise InputError("run.hold", self.hold, "only runs over a number of the scene take it, such as source.0.height")
            return
        if self.hold is None:
            raise InputError("run.hold", None, f"missing; over a number {known}")
        if isinstance(self.hold, Mapping) and self.number in self.hold:
            raise InputError("run.hold", self.number, f"it is the load already; hold another quantity: {', '.join(HELD)}")


def _loads(key: str, values: Any) -> tuple[float, ...]:
    allowed = "a list of one or more finite numbers is allowed"
    given = sequence(key, values, allowed, MAX_STEPS)
    result = tuple(number(f"{key}[{k}]", value) for k, value in enumerate(given))
    if not result:
        raise InputError(key, values, allowed)
    return result


def _public(value: Any) -> Any:
    """A mapping with public names in place of the words that [run] has for quantities."""
    return {PRESCRIBED.get(name, name): end for name, end in value.items()} if isinstance(value, Mapping) else value


def _target(key: str, value: Any, known: tuple[str, ...]) -> Target:
    if not isinstance(value, Mapping) or len(value) != 1:
        raise InputError(key, value, "one quantity and its value are allowed, such as {center_height = 5.0}; known: " + ", ".join(known))
    ((quantity, end),) = value.items()
    choice(key, quantity, known)
    return Target(quantity, number(f"{key}.{quantity}", end))

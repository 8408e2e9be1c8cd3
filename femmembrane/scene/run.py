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
CONTROLS = (*PRESCRIBED, "arc-length")
#: quantities that a minimiser can hold; no potential holds the height of the pole
MINIMISED = ("volume", "pressure")
AT_LIMIT = ("stop", "jump")
SOLVERS = ("ipopt", "newton")
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
    control : {"volume", "pressure", "height", "arc-length"}
        What is prescribed at each equilibrium.
    start, stop : float, optional
        First and last load. With arc length ``start`` is the volume of the first equilibrium, and ``stop`` is not used.
    steps : int, optional
        Number of equilibria from start to stop, both included (one: start alone).
    values : sequence of float, optional
        The loads one by one, in place of start, stop and steps.
    until : mapping of one quantity to its value, optional
        Where an arc-length run ends: one of ``volume``, ``pressure``, ``center_height``.
    max_steps : int
        Most steps of an arc-length run.
    direction : {1, -1}
        Whether an arc-length run sets out to larger or to smaller volumes.
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
    direction: int = 1
    solver: str = "ipopt"
    at_limit: str = "stop"

    def __post_init__(self) -> None:
        choice("run.control", self.control, CONTROLS)
        self._check_keys()
        choice("run.solver", self.solver, SOLVERS)
        choice("run.at_limit", self.at_limit, AT_LIMIT)
        store(
            self,
            start=None if self.start is None else number("run.start", self.start),
            stop=None if self.stop is None else number("run.stop", self.stop),
            steps=None if self.steps is None else whole("run.steps", self.steps, most=MAX_STEPS),
            values=None if self.values is None else _loads("run.values", self.values),
            until=None if self.until is None else _target("run.until", self.until),
            max_steps=whole("run.max_steps", self.max_steps, most=MAX_STEPS),
        )

    @property
    def quantity(self) -> str | None:
        """Public name of the quantity that is prescribed: volume, pressure or center_height; None with arc length."""
        return PRESCRIBED.get(self.control)

    @property
    def minimised(self) -> bool:
        """Whether the equilibria are found by minimisation (IPOPT)."""
        return self.solver == "ipopt" and self.quantity in MINIMISED

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
        needed: tuple[str, ...] = (
            ("start", "until") if by_length else ("values",) if self.values is not None else ("start", "stop", "steps")
        )
        advice = (
            "arc-length control takes start and until" if by_length else f"{self.control} control takes start, stop and steps, or values"
        )
        for name in ("start", "stop", "steps", "values", "until"):
            value = getattr(self, name)
            if value is not None and name not in needed:
                beside = ", not together with run.values" if needed == ("values",) and name != "until" else ""
                raise InputError(f"run.{name}", value, advice + beside)
        for name in needed:
            if getattr(self, name) is None:
                raise InputError(f"run.{name}", None, f"missing; {advice}")
        if self.max_steps != _MAX_STEPS and not by_length:
            raise InputError("run.max_steps", self.max_steps, f"only arc-length control takes it; {advice}")
        store(self, direction=sign("run.direction", self.direction, "1 (towards larger volumes) or -1 is allowed"))
        if self.direction != 1 and not by_length:
            raise InputError("run.direction", self.direction, f"only arc-length control takes it; {advice}")


def _loads(key: str, values: Any) -> tuple[float, ...]:
    allowed = "a list of one or more finite numbers is allowed"
    given = sequence(key, values, allowed, MAX_STEPS)
    result = tuple(number(f"{key}[{k}]", value) for k, value in enumerate(given))
    if not result:
        raise InputError(key, values, allowed)
    return result


def _target(key: str, value: Any) -> Target:
    if not isinstance(value, Mapping) or len(value) != 1:
        raise InputError(key, value, "one quantity and its value are allowed, such as {center_height = 5.0}; known: " + ", ".join(PLACES))
    ((quantity, end),) = value.items()
    choice(key, quantity, PLACES)
    return Target(quantity, number(f"{key}.{quantity}", end))

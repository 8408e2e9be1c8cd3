"""Equilibria at one load."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from ..quantities import PLACES, words, written
from . import door
from .equilibrium import Equilibrium


@dataclass(frozen=True, eq=False)
class Equilibria(Sequence[Equilibrium]):
    """Equilibria at one load, by increasing energy (E under volume control, E - P V under pressure control).

    Attributes
    ----------
    control : {"volume", "pressure"}
        What is held.
    load : float
        Its value.
    found : tuple of Equilibrium
    energies : tuple of float
        The energy of each, which orders them.
    searched : str
        What was done to find them. A search never proves that there are no more.
    """

    control: str
    load: float
    found: tuple[Equilibrium, ...] = field(repr=False)
    energies: tuple[float, ...]
    searched: str

    def __len__(self) -> int:
        return len(self.found)

    def __getitem__(self, index):  # type: ignore[no-untyped-def]  # the overloads of Sequence
        return self.found[index]

    def __iter__(self) -> Iterator[Equilibrium]:
        return iter(self.found)

    def _repr_html_(self) -> str:
        """Meridians and a table, for notebooks."""
        return door.equilibria_html(self)

    def __str__(self) -> str:
        lines = [f"{len(self)} equilibria at {self.control} {self.load:.9g}; {self.searched}"]
        places = " ".join(f"{words(name):>12}" for name in PLACES)
        lines.append(f"{'energy':>14} {places}  {'under pressure':<14}  {'under volume':<14}")
        for energy, eq in zip(self.energies, self.found, strict=True):
            verdicts = f"{eq.verdict('pressure').word:<14}  {eq.verdict('volume').word:<14}"
            numbers = " ".join(written(name, getattr(eq, name), 12) for name in PLACES)
            lines.append(f"{written('energy', energy, 14)} {numbers}  {verdicts}".rstrip())
        return "\n".join(lines)

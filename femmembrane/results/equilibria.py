"""Equilibria at one load."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from .records import Equilibrium


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

    def __str__(self) -> str:
        lines = [f"{len(self)} equilibria at {self.control} {self.load:.9g}; {self.searched}"]
        lines.append(f"{'energy':>14} {'volume':>12} {'pressure':>12} {'pole height':>12}  {'under pressure':<14}  {'under volume':<14}")
        for energy, eq in zip(self.energies, self.found, strict=True):
            words = f"{eq.verdict('pressure').word:<14}  {eq.verdict('volume').word:<14}"
            lines.append(f"{energy:>14.8g} {eq.volume:>12.6g} {eq.pressure:>12.8g} {eq.center_height:>12.6g}  {words}".rstrip())
        return "\n".join(lines)

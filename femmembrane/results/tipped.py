"""Equilibria with waves around the axis, and the branches that they form beyond an azimuthal onset."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .. import files, memory
from ..checks import choice, whole
from ..errors import Status, printable, unknown_name
from ..quantities import PLACES, words, written
from . import door

if TYPE_CHECKING:
    from ..potential import Potential
    from ..potential.tipped import TippedPotential
    from ..scene import Scene
    from .verdict import Verdict

Array = NDArray[np.float64]
T = TypeVar("T")

#: bytes for a point of a surface: its four numbers, and what they are computed from
_BYTES = 64
#: columns of the table of a branch, between the step and the verdicts that the scene asks for
COLUMNS = (*PLACES, "amplitude", "shift", "energy", "harmonics", "truncation", "residual", "iterations")


@dataclass(frozen=True, eq=False)
class TippedEquilibrium:
    """One equilibrium of a membrane with waves around the axis: symmetric in the plane theta = 0, and under a turn by a wave.

    Attributes
    ----------
    pressure, volume : float
        P, and the exact enclosed volume.
    center_height : float
        Height of the pole.
    waves : int
        n: the surface is the same after a turn by 1/n of a revolution.
    harmonics : int
        K: the displacement has the harmonics 0, n, ... K n.
    amplitude : float
        Root mean square over the reference area of the part of the displacement that has waves, over R0.
    shift : float
        Displacement of the pole across the axis, towards theta = 0, over R0; 0 unless n = 1.
    truncation : float
        Estimated root mean square of the harmonics that were left out, over R0: that of the last one.
    elastic_energy, magnetic_energy, load_energy, electric_energy : float
        In units of mu T R0^2.
    residual : float
        Largest force out of balance, relative to the largest of the forces.
    iterations : int
    status : Status
        NOT_RESOLVED where the harmonics are too few, LEGENDRE_FAILURE where a principal stress is compressive: ever shorter waves lower
        the energy there, and the membrane wrinkles.
    scene : Scene
    state : ndarray
        Coefficients of the harmonics (read-only).
    """

    pressure: float
    volume: float
    center_height: float
    waves: int
    harmonics: int
    amplitude: float
    shift: float
    truncation: float
    elastic_energy: float
    magnetic_energy: float
    load_energy: float
    electric_energy: float
    residual: float
    iterations: int
    status: Status
    scene: Scene = field(repr=False)
    state: Array = field(repr=False)
    _answers: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    @property
    def energy(self) -> float:
        """Elastic, magnetic, load and electric energy."""
        return self.elastic_energy + self.magnetic_energy + self.load_energy + self.electric_energy

    @property
    def potential(self) -> Potential:
        """The discrete potential of the scene."""
        from ..potential import potential_of

        return potential_of(self.scene)

    @property
    def tipped(self) -> TippedPotential:
        """The potential in these harmonics."""
        from ..potential.tipped import tipped_potential

        return tipped_potential(self.potential, self.waves, self.harmonics)

    def remembered(self, key: Hashable, find: Callable[[], T]) -> T:
        """The answer to a question, which is asked once.

        Parameters
        ----------
        key : hashable
            The question.
        find : callable
            Who answers.
        """
        if key not in self._answers:
            self._answers[key] = find()
        answer: T = self._answers[key]
        return answer

    def verdict(self, control: str = "volume") -> Verdict:
        """Stability against perturbations with 0, n, ... K n waves around the axis.

        A turn of the waves about the axis costs nothing, and counts as no perturbation. With n = 1 these are all perturbations up to K
        waves; with n > 1 others are not tested. Where a principal stress is compressive, ever shorter waves have ever lower eigenvalues.

        Parameters
        ----------
        control : {"volume", "pressure"}
            What is held.

        Raises
        ------
        InputError
            For an unknown control.
        """
        choice("control", control, ("volume", "pressure"))
        return self.remembered(("verdict", control), lambda: door.tipped_verdict(self, control))

    def sizes(self) -> Array:
        """Root mean square of each harmonic of the displacement over the reference area, over R0, shape (K + 1,)."""
        return self.tipped.harmonics.sizes(self.state)

    def surface(self, sectors: int = 48) -> dict[str, Array]:
        """The surface at the nodes of the meridian and at angles around the axis.

        Parameters
        ----------
        sectors : int
            Number of angles, from 0 on, in one revolution.

        Returns
        -------
        dict of ndarray, shape (n_nodes, sectors)
            theta, the angle of a point before the deformation; x, y, z of the deformed point over R0.

        Raises
        ------
        InputError
            For fewer than 3 angles, and for more than there is memory for.
        """
        whole("sectors", sectors, least=3)
        memory.require("sectors", int(sectors), _BYTES * (self.scene.mesh.elements * self.scene.degree + 1), "angles")
        angles = 2 * np.pi * np.arange(sectors) / sectors
        found: dict[str, Array] = door.tipped_surface(self, angles)
        return found


@dataclass(frozen=True, eq=False)
class TippedPoint:
    """A fold of a branch with waves.

    Attributes
    ----------
    kind : str
        limit_point (dP = 0), volume_fold (dV = 0) or height_fold.
    volume, pressure, center_height : float
    error : float
        Estimated relative distance from the exact point of the discrete branch.
    equilibrium : TippedEquilibrium
    """

    kind: str
    volume: float
    pressure: float
    center_height: float
    error: float
    equilibrium: TippedEquilibrium = field(repr=False)


@dataclass(frozen=True, eq=False)
class TippedBranch(Sequence[TippedEquilibrium]):
    """Equilibria with waves around the axis, from an azimuthal onset on, in the order in which they were found.

    Attributes
    ----------
    scene : Scene
    equilibria : sequence of TippedEquilibrium
        The first one is the axisymmetric state at the onset.
    status : Status
        How the trace ended.
    message : str
        Why it ended before it was finished; empty when all went well.
    special_points : tuple of TippedPoint, or None
        None when none were looked for.
    timings : mapping of str to float
        Seconds by stage.
    """

    scene: Scene
    equilibria: Sequence[TippedEquilibrium]
    status: Status
    message: str
    special_points: tuple[TippedPoint, ...] | None
    timings: Mapping[str, float] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.equilibria)

    def __getitem__(self, index):  # type: ignore[no-untyped-def]  # the overloads of Sequence
        return self.equilibria[index]

    def __iter__(self) -> Iterator[TippedEquilibrium]:
        return iter(self.equilibria)

    @property
    def columns(self) -> list[str]:
        """Names of the columns of the table."""
        asked = self.scene.analysis.stability
        return ["step", *COLUMNS, *(f"verdict_{control}" for control in ("volume", "pressure") if control in asked)]

    def column(self, name: str) -> NDArray[Any]:
        """One column of the table.

        Parameters
        ----------
        name : str
            One of :attr:`columns`, or of energies.

        Raises
        ------
        InputError
            For an unknown name.
        """
        energies = ("elastic_energy", "magnetic_energy", "load_energy", "electric_energy")
        if name not in (known := [*self.columns, *energies]):
            raise unknown_name("column", name, known)
        if name == "step":
            return np.arange(len(self))
        if name.startswith("verdict_"):
            return np.array([eq.verdict(name.removeprefix("verdict_")).word for eq in self])
        return np.array([getattr(eq, name) for eq in self])

    def to_dataframe(self) -> Any:
        """The table as a pandas data frame."""
        import pandas

        return pandas.DataFrame({name: self.column(name) for name in self.columns})

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table.

        Parameters
        ----------
        path : path
        """
        files.write_csv(path, self.columns, zip(*(self.column(name).tolist() for name in self.columns), strict=True))

    def to_xarray(self) -> Any:
        """Everything as one xarray data set, as :meth:`save` writes it."""
        from .store import tipped_to_xarray

        return tipped_to_xarray(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the branch to a NetCDF file, whole or not at all; :func:`femmembrane.load` brings it back to the last bit.

        Parameters
        ----------
        path : path

        Raises
        ------
        InputError
            For a branch without equilibria, and when the file cannot be written.
        """
        from .store import save_tipped

        save_tipped(self, path)

    def _repr_html_(self) -> str:
        """Its diagram and a table, for notebooks."""
        return door.tipped_html(self)

    def to_vtk(self, path: str | PathLike[str]) -> list[Path]:
        """Write a VTU file for each equilibrium, and the PVD file that strings them together: a movie for ParaView.

        Parameters
        ----------
        path : path
            A name that ends in ``.pvd``.

        Returns
        -------
        list of Path

        Raises
        ------
        InputError
            When the name does not end in ``.pvd`` or the folder cannot be written to.
        """
        return door.write_tipped_vtk(self, path)

    def plot(
        self, path: str | PathLike[str] | None = None, *, ax: Any = None, x: str = "volume", y: str = "pressure", label: str = ""
    ) -> Any:
        """One column against another on Matplotlib axes. Stability is drawn where the scene asks for verdicts at a held volume.

        Parameters
        ----------
        path : path, optional
            Where the figure is also written.
        ax : matplotlib Axes, optional
            Where to draw; default: axes of a new figure.
        x, y : str
            Columns.
        label : str
            Name of the branch in the legend.

        Returns
        -------
        matplotlib Axes

        Raises
        ------
        InputError
            For an unknown column.
        """
        return door.plot_tipped(self, path, ax, x, y, label)

    def __str__(self) -> str:
        names = (*PLACES, "amplitude", "truncation")
        lines = [f"{'step':>4} " + " ".join(f"{words(name):>13}" for name in names)]
        for k, eq in enumerate(self):
            lines.append(f"{k:>4} " + " ".join(written(name, getattr(eq, name), 13) for name in names))
        if self.message:
            lines.append(printable(f"{self.status}: {self.message}"))
        return "\n".join(lines)

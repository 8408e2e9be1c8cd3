"""A branch: equilibria in the order in which they were found, with what was met on the way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import TYPE_CHECKING, Any, overload

from numpy.typing import NDArray

from ..errors import Status, printable
from ..quantities import PLACES, words, written
from . import door
from .analyses import printed
from .equilibrium import Equilibrium
from .path_memory import PathMemory
from .special_point import Jump, SpecialPoint

if TYPE_CHECKING:
    from ..scene import Scene
    from .zones import ZonesAlong


class SoFar(Sequence[Equilibrium]):
    """The equilibria that a growing list has now. It is taken after each step of a run, where copies would cost a time quadratic in the
    steps."""

    def __init__(self, growing: list[Equilibrium]) -> None:
        self._growing, self._count = growing, len(growing)

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> Equilibrium: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Equilibrium, ...]: ...

    def __getitem__(self, index: int | slice) -> Equilibrium | tuple[Equilibrium, ...]:
        places = range(self._count)[index]
        return self._growing[places] if isinstance(places, int) else tuple(self._growing[k] for k in places)


@dataclass(frozen=True, eq=False)
class Branch(Sequence[Equilibrium]):
    """Equilibria in the order in which they were found. A branch is a sequence: it has a length, items and slices.

    Attributes
    ----------
    scene : Scene
    equilibria : sequence of Equilibrium
    status : Status
        How the run ended.
    message : str
        Why it ended before it was finished; empty when all went well.
    timings : mapping of str to float
        Seconds by stage.
    special_points : tuple of SpecialPoint, or None
        None when special points were not looked for.
    memory : TraceMemory, PathMemory or None
        What is needed to go on: a TraceMemory for a branch traced by arc length, a PathMemory for an unfinished run by loads.
    jumps : tuple of Jump
        Where a run snapped because the branch turned back before a load, or lost its stability at a branch point.
    solver : str
        Which solver found the equilibria: ``ipopt`` or ``newton``; empty where that was not noted.
    remarks : tuple of str
        Remarks on how the run went on, for instance that another processor began it.
    over : str
        The number of the scene that changes along the branch, by its name, such as ``source.0.height``; empty where none does. Every
        equilibrium has the scene with its own value, and the name is one of the columns.
    hold : mapping of str to float
        What is held meanwhile, and at which value.

    Examples
    --------
    >>> import femmembrane as fm
    >>> branch = fm.inflate(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), volumes=[0.5, 1.0, 2.0])
    >>> len(branch), branch.status.value, round(branch[-1].pressure, 4)
    (3, 'converged', 1.8025)
    >>> [round(float(height), 4) for height in branch.column("center_height")]
    [0.298, 0.5528, 0.94]
    """

    scene: Scene
    equilibria: Sequence[Equilibrium]
    status: Status = Status.CONVERGED
    message: str = ""
    timings: Mapping[str, float] = field(default_factory=dict)
    special_points: tuple[SpecialPoint, ...] | None = None
    memory: PathMemory | None = field(default=None, repr=False)
    jumps: tuple[Jump, ...] = ()
    solver: str = ""
    remarks: tuple[str, ...] = ()
    over: str = ""
    hold: Mapping[str, float] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.equilibria)

    @overload
    def __getitem__(self, index: int) -> Equilibrium: ...

    @overload
    def __getitem__(self, index: slice) -> Branch: ...

    def __getitem__(self, index: int | slice) -> Equilibrium | Branch:
        if isinstance(index, slice):
            return replace(self, equilibria=self.equilibria[index], special_points=None, memory=None, jumps=())
        return self.equilibria[index]

    def __iter__(self) -> Iterator[Equilibrium]:
        return iter(self.equilibria)

    def column(self, name: str) -> NDArray[Any]:
        """One column of the table.

        Parameters
        ----------
        name : str
            ``step``, ``status``, any column of the table, an energy, or a number of the scene by its name. ``lambda_`` or ``verdict_`` is
            followed by pressure, volume, n1, n2, ...; ``fraction_`` by a kind of zones; ``error_`` by a quantity, where the scene asks for
            error estimates (relative errors at the load that its [run] prescribes, else at the volume). A scene with scales has
            ``pressure_pa``, ``volume_m3``, ``center_height_m``, ``elastic_energy_j``, ... as well.

        Raises
        ------
        InputError
            For an unknown name.
        """
        from .table import column

        return column(self, name)

    def __str__(self) -> str:
        columns = printed(self.scene)
        own, width = [self.over] if self.over else [], max(len(self.over), 12)
        head = " ".join([f"{'step':>4}", *(f"{name:>{width}}" for name in own), *(f"{words(name):>12}" for name in PLACES)])
        head += "".join(f"  {c.heading:<{c.width}}" for c in columns)
        lines = [printable(self.scene.title), head] if self.scene.title else [head]
        for k, eq in enumerate(self):
            varied = (f"{eq.number(name):>{width}.6g}" for name in own)
            numbers = " ".join([f"{k:>4}", *varied, *(written(name, getattr(eq, name), 12) for name in PLACES)])
            lines.append(numbers + "".join(f"  {c.text(eq):<{c.width}}" for c in columns))
        lines += [line for line in (self.mesh_used, *self.notes, self.message) if line]
        return "\n".join(line.rstrip() for line in lines)

    @property
    def mesh_used(self) -> str:
        """The mesh that was chosen for an accuracy, in words; empty for one that was given."""
        mesh, degree = self.scene.mesh, self.scene.degree
        accuracy, estimated = (getattr(mesh, name, None) for name in ("accuracy", "estimated"))
        if accuracy is None or estimated is None:
            return ""
        return f"mesh: {mesh.elements} elements of degree {degree}, graded, chosen for accuracy {accuracy:g}, estimated {estimated:.0e}"

    @property
    def notes(self) -> tuple[str, ...]:
        """The remarks, loads that no such membrane holds, repairs of the mesh, and what was done about motions that nothing resists."""
        from ..discretization.space import space_of_scene
        from ..scene.absurd_loads import remarks_on_loads

        repaired = tuple(f"mesh: {what}" for what in getattr(self.scene.mesh, "repaired", ()))
        if self.scene.open:
            return self.remarks
        return (*self.remarks, *remarks_on_loads(self.scene), *repaired, *space_of_scene(self.scene).notes)

    def zones_along(self) -> ZonesAlong:
        """Zones of all equilibria and, where their kinds change from one to the next, of states between them."""
        return door.zones_along(self)

    def to_dataframe(self) -> Any:
        """The table as a pandas DataFrame."""
        from .table import to_dataframe

        return to_dataframe(self)

    def to_xarray(self) -> Any:
        """Table, profiles and states as an xarray Dataset with units and long names."""
        from .store import to_xarray

        return to_xarray(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write everything to one NetCDF file; :func:`femmembrane.load` reads it back.

        Parameters
        ----------
        path : path
        """
        from .store import save

        save(self, path)

    def to_vtk(self, path: str | PathLike[str]) -> None:
        """Write a ParaView collection (.pvd) with one VTU file a step.

        Parameters
        ----------
        path : path
            With the suffix ``.pvd``.
        """
        door.write_vtk(self, path)

    def plot(self, path: str | PathLike[str] | None = None, *, units: str = "scaled") -> Any:
        """Pressure against volume as a Matplotlib figure; over a number what answers to it, at what is held.

        Parameters
        ----------
        path : path, optional
            Where the figure is also written.
        units : {"scaled", "si"}
            In units of the package, or in SI units such as ml and kPa, by the scales of the scene.

        Raises
        ------
        InputError
            For a file that cannot be written, and for SI units of a scene without scales.
        """
        return door.plot_pressure_volume(self, path, units)

    def report(self, path: str | PathLike[str], *, units: str = "scaled") -> None:
        """Write one HTML page with what the branch has: figures, verdicts, special points, zones, errors, scene, timings.

        Parameters
        ----------
        path : path
        units : {"scaled", "si"}
            As for :meth:`plot`.
        """
        door.write_report(self, path, units)

    def cite(self) -> str:
        """BibTeX of what the computation used."""
        from .citations import cite

        return cite(self)

    def _repr_html_(self) -> str:
        """The table and the pressure-volume diagram, for notebooks."""
        return door.branch_html(self)

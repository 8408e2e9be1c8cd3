"""A branch: equilibria in the order in which they were found, with what was met on the way."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING, Any, overload

from numpy.typing import ArrayLike, NDArray

from ..discretization.meridian import in_words
from ..errors import Status, printable
from ..quantities import PLACES, words, written
from . import door
from .analyses import printed
from .equilibrium import Equilibrium
from .path_memory import PathMemory
from .special_point import Jump, SpecialPoint

if TYPE_CHECKING:
    from ..scene import Scene
    from .curve import BranchCurve
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
    _drawn: list[BranchCurve] = field(default_factory=list, init=False, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        """What a copy has: what was found for drawing belongs to potentials, which are built anew in another process."""
        return {**vars(self), "_drawn": []}

    def __len__(self) -> int:
        return len(self.equilibria)

    @overload
    def __getitem__(self, index: int) -> Equilibrium: ...

    @overload
    def __getitem__(self, index: slice) -> Branch: ...

    def __getitem__(self, index: int | slice) -> Equilibrium | Branch:
        if isinstance(index, slice):
            return replace(self, equilibria=self.equilibria[index], special_points=None, memory=None, jumps=self._jumps_in(index))
        return self.equilibria[index]

    def __iter__(self) -> Iterator[Equilibrium]:
        return iter(self.equilibria)

    def _jumps_in(self, part: slice) -> tuple[Jump, ...]:
        """The snaps between equilibria of a part that goes the same way."""
        kept = range(len(self))[part]
        if kept.step < 0:
            return ()
        landed = ((bisect_left(kept, jump.index), jump) for jump in self.jumps)
        return tuple(replace(jump, index=k, landing=self[kept[k]]) for k, jump in landed if 0 < k < len(kept))

    @property
    def volume(self) -> NDArray[Any]:
        """Enclosed volume of every equilibrium over R0^3."""
        return self.column("volume")

    @property
    def pressure(self) -> NDArray[Any]:
        """P of every equilibrium."""
        return self.column("pressure")

    @property
    def center_height(self) -> NDArray[Any]:
        """Height of the pole of every equilibrium over R0."""
        return self.column("center_height")

    @property
    def elastic_energy(self) -> NDArray[Any]:
        """Elastic energy of every equilibrium in units of mu T R0^2."""
        return self.column("elastic_energy")

    @property
    def magnetic_energy(self) -> NDArray[Any]:
        """Magnetic energy of every equilibrium in units of mu T R0^2; zeros without sources."""
        return self.column("magnetic_energy")

    @property
    def curve(self) -> BranchCurve:
        """What lies between the equilibria; found when first asked for, at about the cost of a third of the branch."""
        from .curve import BranchCurve

        if not self._drawn:
            self._drawn.append(BranchCurve(self))
        return self._drawn[0]

    def at(
        self,
        *,
        volume: float | None = None,
        pressure: float | None = None,
        center_height: float | None = None,
        refine: bool = False,
        crossing: int = 0,
    ) -> Equilibrium:
        """The state at a volume, a pressure or a height of the pole, between equilibria of the branch.

        It lies on the cubic between two equilibria, with the tangents of the branch there, and its status is ``interpolated``: its
        ``residual`` says how far forces are out of balance. Where an equilibrium of the branch has the value, it is that one.

        Parameters
        ----------
        volume, pressure, center_height : float
            Exactly one of them.
        refine : bool
            Solve for the equilibrium there. It has the value that was asked for exactly.
        crossing : int
            Which one, where the branch passes the value several times: 0 for the first, -1 for the last.

        Raises
        ------
        InputError
            When the branch does not pass the value, or not so many times, and for a branch over a number.
        SolveError
            When the equilibrium cannot be solved for, as at a fold in the quantity.

        Examples
        --------
        >>> import femmembrane as fm
        >>> branch = fm.inflate(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), volumes=[0.5, 1.0, 2.0])
        >>> between, solved = branch.at(volume=1.5), branch.at(volume=1.5, refine=True)
        >>> between.status.value, round(between.pressure, 3), solved.status.value, round(solved.pressure, 3)
        ('interpolated', 1.584, 'converged', 1.584)
        """
        from .between_equilibria import state_at

        return state_at(self, {"volume": volume, "pressure": pressure, "center_height": center_height}, refine, crossing)

    def resample(self, count: int, *, refine: bool = False) -> Branch:
        """The branch with so many states, evenly spread along it.

        Ends of the branch and of its parts before and after snaps are kept. Other states are interpolated, as in :meth:`at`.

        Parameters
        ----------
        count : int
            At least two for the branch, and two more for each snap.
        refine : bool
            Solve for the equilibria.

        Raises
        ------
        InputError, SolveError
            As :meth:`at`.

        Examples
        --------
        >>> import femmembrane as fm
        >>> branch = fm.inflate(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), volumes=[0.5, 1.0, 2.0])
        >>> [str(eq.status) for eq in branch.resample(4)]
        ['converged', 'interpolated', 'interpolated', 'converged']
        """
        from .between_equilibria import resampled

        return resampled(self, count, refine)

    def sensitivity(
        self,
        of: str | Sequence[str] = "pressure",
        to: str | Sequence[str] = (),
        *,
        held: str | None = None,
        r: ArrayLike | None = None,
        control: str | None = None,
        azimuthal: int = 0,
    ) -> Any:
        """Derivatives along the branch with respect to numbers of the scene, or those of its first limit point.

        Parameters
        ----------
        of : str or list of str
            As for :meth:`.Equilibrium.sensitivity`; or ``limit_pressure``, ``limit_volume``, ``limit_height`` of the first limit point.
            Any other one of ``branch.special_points`` is asked of itself: ``point.sensitivity(...)``.
        to, held, r, control, azimuthal
            As for :meth:`.Equilibrium.sensitivity`; over a number of the scene, what the run holds is held by default. At a limit point
            nothing is held.

        Returns
        -------
        ndarray or dict
            A row for each equilibrium, and one number for a limit point; in dicts by names where lists were given.

        Raises
        ------
        InputError
            As :meth:`.Equilibrium.sensitivity`, and for a branch without a limit point.
        SolveError
            As there.

        Examples
        --------
        >>> import femmembrane as fm
        >>> scene = fm.Scene(material=fm.MooneyRivlin(0.05), mesh=fm.disc(16))
        >>> branch = fm.trace(scene, until={"volume": 8.0})
        >>> print(f"{branch.sensitivity('limit_pressure', 'material.ratio'):.4f}")
        7.5381
        >>> len(branch.sensitivity("pressure", "material.ratio", held="center_height")) == len(branch)
        True
        """
        from .sensitivities import Along, sensitivity_along

        return sensitivity_along(self, of, to, held, Along(r, control, azimuthal))

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
    def mesh_changes(self) -> bool:
        """Whether the mesh changes along it, as an accuracy may need: every equilibrium has the scene on its own mesh."""
        mesh, degree = self.scene.mesh, self.scene.degree
        if self.scene.follows_zones:
            return False
        return any(eq.scene.mesh is not mesh and (eq.scene.degree != degree or eq.scene.mesh != mesh) for eq in self.equilibria)

    @property
    def mesh_used(self) -> str:
        """The mesh that was chosen for an accuracy, in words; empty for one that was given."""
        mesh, degree = self.scene.mesh, self.scene.degree
        if self.mesh_changes:
            sizes = sorted({(eq.scene.mesh.elements, eq.scene.degree) for eq in self.equilibria})
            (fewest, _), (most, degree) = sizes[0], sizes[-1]
            count = sum(a.scene.mesh != b.scene.mesh for a, b in pairwise(self.equilibria))
            often = "once" if count == 1 else f"{count} times"
            chosen = f"changed {often} along the branch for accuracy {in_words(getattr(mesh, 'accuracy', None) or 0.0)}"
            return f"mesh: {fewest} to {most} elements of degree {degree}, graded, {chosen}"
        accuracy, estimated = (getattr(mesh, name, None) for name in ("accuracy", "estimated"))
        if accuracy is None or estimated is None:
            return ""
        chosen = f"chosen for accuracy {in_words(accuracy)}, estimated {estimated:.0e}"
        return f"mesh: {mesh.elements} elements of degree {degree}, graded, {chosen}"

    @property
    def notes(self) -> tuple[str, ...]:
        """The remarks, sources that the membrane enters, loads that no such membrane holds, remarks on the mesh, and free motions."""
        from ..discretization.space import space_of_scene
        from ..scene.absurd_loads import remarks_on_loads, remarks_on_scales
        from .entered import remarks_on_entered

        mesh = tuple(f"mesh: {what}" for what in getattr(self.scene.mesh, "remarks", ()))
        if self.scene.open:
            return self.remarks
        unlikely = (*remarks_on_scales(self.scene.scales), *remarks_on_loads(self.scene))
        return (*self.remarks, *remarks_on_entered(self), *unlikely, *mesh, *space_of_scene(self.scene).notes)

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

    def plot(
        self,
        path: str | PathLike[str] | None = None,
        *,
        ax: Any = None,
        x: str | None = None,
        y: str | None = None,
        label: str | None = None,
        units: str = "scaled",
    ) -> Any:
        """Any quantity of the branch against any other, on Matplotlib axes.

        The line goes along the :attr:`curve` of the branch. Line styles tell the verdicts that the scene asked for. Markers are the special
        points found.

        Parameters
        ----------
        path : path, optional
            Where the figure is also written: PNG, PDF, SVG, PGF or what else Matplotlib writes.
        ax : matplotlib Axes, optional
            Where to draw, for several branches in one picture. Default: axes of a new figure.
        x, y : str, optional
            Columns of the branch that are numbers, such as ``center_height``, ``lambda_pressure`` or ``step``, or a number of the scene by
            its name. Default: pressure against volume; over a number what answers to it, at what is held.
        label : str, optional
            Name of the branch in the legend. The branch then has a colour of its own, and its dashes tell verdicts.
        units : {"scaled", "si"}
            In units of the package, or in SI units such as ml and kPa, by the scales of the scene.

        Returns
        -------
        matplotlib Axes

        Raises
        ------
        InputError
            For an empty branch, an unknown quantity, a file that cannot be written, and SI units of a scene without scales.

        Examples
        --------
        >>> import femmembrane as fm
        >>> thin, thick = (fm.Scene(material=fm.MooneyRivlin(ratio=r), mesh=fm.disc(16)) for r in (0.05, 0.2))
        >>> ax = fm.inflate(thin, volumes=[0.5, 1.0, 2.0, 4.0]).plot(x="center_height", label="ratio 0.05")
        >>> ax = fm.inflate(thick, volumes=[0.5, 1.0, 2.0, 4.0]).plot(ax=ax, x="center_height", label="ratio 0.2")
        >>> [text.get_text() for text in ax.get_legend().get_texts()]
        ['ratio 0.05', 'ratio 0.2', 'stability not tested']
        """
        return door.plot_branch(self, path, ax, x, y, label, units)

    def report(self, path: str | PathLike[str], *, units: str = "scaled") -> None:
        """Write one HTML page with what the branch has: figures, verdicts, special points, zones, errors, scene, timings.

        Parameters
        ----------
        path : path
        units : {"scaled", "si"}
            As for :meth:`plot`.
        """
        door.write_report(self, path, units)

    def explore(self, path: str | PathLike[str], *, units: str = "scaled") -> None:
        """Write one HTML page on which the branch is explored: click a state to see it in space with its verdicts, modes and zones.

        The page needs no network, and has all that it shows: 1 MB for 80 states, and 2 MB for the library that draws them.

        Parameters
        ----------
        path : path
        units : {"scaled", "si"}
            As for :meth:`plot`.

        Raises
        ------
        InputError
            For an empty branch, a file that cannot be written, SI units of a scene without scales, and where Plotly is not installed
            (``pip install "femmembrane[explore]"``).
        """
        door.write_explorer(self, path, units)

    def cite(self) -> str:
        """BibTeX of what the computation used."""
        from .citations import cite

        return cite(self)

    def _repr_html_(self) -> str:
        """The branch to explore, for notebooks; a still picture with a table where scripts are not allowed or Plotly is not installed."""
        return door.branch_html(self)

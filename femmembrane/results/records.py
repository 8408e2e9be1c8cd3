"""Frozen records of what was computed: equilibria, special points and branches."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..discretization.meridian import LEAST_LENGTH
from ..errors import InputError, Status, printable
from ..quantities import PLACES, words, written
from ..solve.controls import control_kind
from ..threads import one_thread
from . import door

if TYPE_CHECKING:
    from ..potential import Potential
    from ..scene import Scene
    from ..solve.controls import Gas
    from .error_estimate import ErrorEstimate
    from .verdict import Verdict
    from .vibration import Vibration
    from .zones import Zones, ZonesAlong

Array = NDArray[np.float64]

#: classes of perturbations shown by ``print(branch)`` when the scene asks for none
_SHOWN = ("pressure", "volume")


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """One equilibrium of a scene.

    Attributes
    ----------
    pressure : float
        P = p R0/(mu T).
    volume : float
        Enclosed volume over R0^3, signed, with the 2 pi.
    center_height : float
        Height of the pole over R0; of a shape without one that of the first point of its meridian.
    elastic_energy, magnetic_energy : float
        In units of mu T R0^2, with the 2 pi; the magnetic one is 0 without sources.
    residual : float
        Largest out-of-balance force relative to the forces that meet at a node, recomputed after the solve.
    iterations : int
        Iterations spent on this equilibrium, rejected attempts included.
    status : Status
    scene : Scene
    state : ndarray, shape (n_free,)
        Displacement coefficients of the free degrees of freedom (read-only).
    seconds : float
        Wall time spent on this equilibrium and its verdicts.
    gas : Gas or None
        The enclosed gas that holds it, when found under gas control.
    load_energy : float
        Energy of the loads besides the pressure, in units of mu T R0^2, with the 2 pi; 0 without.
    """

    pressure: float
    volume: float
    center_height: float
    elastic_energy: float
    magnetic_energy: float
    residual: float
    iterations: int
    status: Status
    scene: Scene = field(repr=False)
    state: Array = field(repr=False)
    seconds: float = field(default=0.0, repr=False)
    gas: Gas | None = field(default=None, repr=False)
    load_energy: float = field(default=0.0, repr=False)
    _verdicts: dict[tuple[str | None, int], Verdict] = field(default_factory=dict, repr=False)
    _zones: dict[str, Zones] = field(default_factory=dict, repr=False)
    _errors: dict[str, ErrorEstimate] = field(default_factory=dict, repr=False)

    @property
    def energy(self) -> float:
        """Elastic, magnetic and load energy."""
        return self.elastic_energy + self.magnetic_energy + self.load_energy

    @property
    def potential(self) -> Potential:
        """The discrete potential this state lives in (built once per scene)."""
        from ..potential import potential_of

        return potential_of(self.scene)

    def in_scene(self, scene: Scene) -> Equilibrium:
        """The same equilibrium in a scene with the same potential, which may ask for or scale other things."""
        return replace(self, scene=scene, _zones={})

    def profile(self, r: ArrayLike | None = None) -> dict[str, Array]:
        """The deformed meridian with stretches and stresses.

        Parameters
        ----------
        r : array_like, optional
            Reference radii in [0, 1]; of a meridian that does not run along the radius, arc lengths over R0 from its first end. Default
            the nodes, from the pole to the rim (from the first to the last end).

        Returns
        -------
        dict of ndarray
            r, rho, eta (over R0; also s, the arc length, where it is not r); stretch_1, stretch_2 (1 meridional, 2 circumferential);
            mechanical_stress_1, mechanical_stress_2, total_stress_1, total_stress_2 (Cauchy, in units of mu); when the scene has scales,
            the stresses in Pa as well, under the same names with ``_pa`` at the end.

        Raises
        ------
        InputError
            For radii outside the membrane.
        """
        space = self.potential.space
        s = space.node_parameters() if r is None else _places(r, space.ends, "reference radii" if space.radial else "arc lengths")
        return door.profile_at(self.scene, self.state, self.pressure, s).columns(self.scene.scales)

    def verdict(self, control: str | None = None, *, azimuthal: int = 0, gas: Gas | None = None) -> Verdict:
        """Stability against one class of perturbations; computed once and remembered.

        Parameters
        ----------
        control : {"pressure", "volume", "gas"}
            What is held against axisymmetric perturbations; left out for azimuthal ones, which do not change the volume.
        azimuthal : int
            Number of waves around the axis; 0 for axisymmetric perturbations.
        gas : Gas, optional
            For control "gas": the enclosed gas; default the one under which this equilibrium was found.

        Raises
        ------
        InputError
            For an unknown control, or one that does not go with the rest.
        """
        if not isinstance(control, str | None) or not isinstance(azimuthal, (int, np.integer)):
            raise InputError(
                "control" if isinstance(azimuthal, (int, np.integer)) else "azimuthal",
                control or azimuthal,
                "a name and a number are allowed",
            )
        if gas is not None and control != "gas":
            raise InputError("gas", gas, 'allowed with control "gas" only')
        key = (control, azimuthal)
        if key not in self._verdicts or control == "gas":
            self._verdicts[key] = self._judged(control, azimuthal, gas or self.gas)
        return self._verdicts[key]

    @one_thread
    def _judged(self, control: str | None, azimuthal: int, gas: Gas | None) -> Verdict:
        evaluation = self.potential.evaluate(self.state, self.pressure)
        compliance = gas.compliance(self.volume) if gas else None
        return door.checked_verdict(self.potential, self.state, self.pressure, evaluation, control, azimuthal, compliance=compliance)

    @one_thread
    def frequencies(self, *, azimuthal: int = 0, count: int = 3, control: str = "pressure") -> tuple[Vibration, ...]:
        """The lowest natural modes, in order of their eigenvalues and proved to be the lowest.

        Parameters
        ----------
        azimuthal : int
            Number of waves around the axis; 0 for axisymmetric modes.
        count : int
            How many modes.
        control : {"pressure", "volume"}
            What is held during the motion; makes a difference for axisymmetric modes only.

        Raises
        ------
        InputError
            For an argument that is not allowed.
        SolveError
            Where a compressive stress leaves the spectrum without a lowest eigenvalue.
        """
        return door.natural_frequencies(self.potential, self.state, self.pressure, azimuthal, count, control)

    def zones(self, criterion: str | None = None) -> Zones:
        """Taut and wrinkled zones by the signs of the principal stresses, from the pole to the rim; computed once and remembered.

        Zones thinner than about a tenth of an element may be missed.

        Parameters
        ----------
        criterion : {"total", "mechanical"}, optional
            The stresses that decide; default what the scene asks for in ``analysis.wrinkling``, or "total".

        Raises
        ------
        InputError
            For an unknown criterion.
        """
        criterion = (self.scene.analysis.wrinkling or "total") if criterion is None else criterion
        if not isinstance(criterion, str) or criterion not in self._zones:
            self._zones[criterion] = door.find_zones(self.scene, self.state, self.pressure, criterion)
        return self._zones[criterion]

    @one_thread
    def error_estimate(self, control: str = "volume") -> ErrorEstimate:
        """Estimated discretisation errors, from the same load in a finer space; computed once and remembered.

        Where there is none (a compressed or slack state, one too close to a fold of what is held, a mesh too coarse) errors are NaN, and
        the record says why. In a wrinkled tension field the estimate is rough, a factor of two or so.

        Parameters
        ----------
        control : {"volume", "pressure", "center_height"}
            What is held: the errors are those of the other quantities at the same volume, pressure or pole height.

        Raises
        ------
        InputError
            For an unknown control.
        """
        control = control_kind(control).name
        if control not in self._errors:
            verdicts = {c: self.verdict(c) for c in ("pressure", "volume")}
            self._errors[control] = door.estimate_errors(self.potential, self.state, self.pressure, control, verdicts)
        return self._errors[control]

    def _repr_html_(self) -> str:
        """Numbers and verdicts with the deformed meridian, for notebooks."""
        return door.equilibrium_html(self)


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """A point of a branch where something changes.

    Attributes
    ----------
    kind : str
        limit_point (dP = 0), volume_fold (dV = 0), height_fold, branch_point, azimuthal_onset.
    volume, pressure, center_height : float
    error : float
        Estimated distance, relative, of the located point from the exact one of the discrete branch.
    equilibrium : Equilibrium
    azimuthal : int
        For an azimuthal onset: the number of waves against which stability is lost or regained there.
    tangent : ndarray, shape (n_free + 1,), or None
        For a branch point: the direction in (x, P) of the branch on which it was found, which tells it from the one that crosses there.
    """

    kind: str
    volume: float
    pressure: float
    center_height: float
    error: float
    equilibrium: Equilibrium = field(repr=False)
    azimuthal: int = field(default=0, kw_only=True)
    tangent: Array | None = field(default=None, repr=False, kw_only=True)


@dataclass(frozen=True, eq=False)
class PathMemory:
    """What the next equilibrium of a run depends on besides the last one, so that an interrupted run goes on as if it had not been.

    Attributes
    ----------
    sigma : tuple of float
        Load (in a trace: arc length) at the last points that predict the next one, two at most.
    points, slopes : ndarray, shape (len(sigma), n_free + 1)
        (x, P) and its derivative with respect to sigma there.
    """

    sigma: tuple[float, ...]
    points: Array
    slopes: Array


@dataclass(frozen=True, eq=False)
class TraceMemory(PathMemory):
    """The same for a trace by arc length.

    Attributes
    ----------
    step : float
        Length of the next step.
    regular : int
        Number of equilibria that are steps of the trace; one more may be the end point that was asked for.
    unexplained : tuple of str
        Changes of inertia met so far at which no special point was located.
    """

    step: float
    regular: int
    unexplained: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Jump:
    """A snap of a run from one part of the branch to another, or to another branch.

    Attributes
    ----------
    index : int
        Position in the branch of the equilibrium landed on.
    limit : SpecialPoint or None
        The fold at which the branch turned back before the load, or the branch point at which it lost its stability: from there another
        branch leads to the landing.
    landing : Equilibrium
    """

    index: int
    limit: SpecialPoint | None
    landing: Equilibrium


class SoFar(Sequence[Equilibrium]):
    """The equilibria that a growing list has now: taken after each step of a run, a copy would cost a time quadratic in the steps."""

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
    """Equilibria in the order in which they were found.

    Attributes
    ----------
    scene : Scene
    equilibria : sequence of Equilibrium
    status : Status
        How the run ended; with a ``message`` unless all went well.
    timings : mapping of str to float
        Seconds by stage.
    special_points : tuple of SpecialPoint, or None when none were looked for
    memory : TraceMemory for a branch traced by arc length, PathMemory for an unfinished run by loads, else None
    jumps : tuple of Jump
        Where a run snapped because the branch turned back before a load, or lost its stability at a branch point.
    solver : str
        Who found the equilibria: ``ipopt`` or ``newton``; empty where that was not noted.
    remarks : tuple of str
        What is to be known of how the run went on, such as that another processor began it.
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
            step, any column of the table, status, an energy, lambda_ or verdict_ with pressure, volume, n1, n2, ..., fraction_ with a kind
            of zones, when the scene has scales, pressure_pa, and when it asks for error estimates, error_ with what they are of (relative
            errors at the load that its [run] prescribes, else at the volume).

        Raises
        ------
        InputError
            For an unknown name.
        """
        from .table import column

        return column(self, name)

    def __str__(self) -> str:
        classes = self.scene.analysis.stability or _SHOWN
        zones = self.scene.analysis.wrinkling is not None
        head = " ".join([f"{'step':>4}", *(f"{words(name):>12}" for name in PLACES)]) + "".join(f"  {'under ' + c:<14}" for c in classes)
        head += "  zones" if zones else ""
        lines = [printable(self.scene.title), head] if self.scene.title else [head]
        for k, eq in enumerate(self):
            numbers = " ".join([f"{k:>4}", *(written(name, getattr(eq, name), 12) for name in PLACES)])
            verdicts = "".join(f"  {eq.verdict(c).word:<14}" for c in classes)
            lines.append(numbers + verdicts + (f"  {eq.zones().summary}" if zones else ""))
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
        """The remarks, what was repaired of the points of the mesh, and what was done about motions of the membrane as a whole that nothing
        resists."""
        from ..discretization.space import space_of_scene

        repaired = tuple(f"mesh: {what}" for what in getattr(self.scene.mesh, "repaired", ()))
        return self.remarks if self.scene.open else (*self.remarks, *repaired, *space_of_scene(self.scene).notes)

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
        """Write everything to one NetCDF file; :func:`femmembrane.load` reads it back."""
        from .store import save

        save(self, path)

    def to_vtk(self, path: str | PathLike[str]) -> None:
        """Write a ParaView collection (.pvd) with one VTU file a step."""
        door.write_vtk(self, path)

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Pressure against volume as a Matplotlib figure, also written to ``path`` if given."""
        return door.plot_pressure_volume(self, path)

    def report(self, path: str | PathLike[str]) -> None:
        """Write one HTML page with what the branch has: figures, verdicts, special points, zones, errors, scene, timings."""
        door.write_report(self, path)

    def cite(self) -> str:
        """BibTeX of what the computation used."""
        from .citations import cite

        return cite(self)

    def _repr_html_(self) -> str:
        """The table and the pressure-volume diagram, for notebooks."""
        return door.branch_html(self)


def _places(r: ArrayLike, ends: Array, what: str) -> Array:
    s = np.atleast_1d(np.asarray(r, dtype=float))
    margin = LEAST_LENGTH * float(ends[-1])  # whoever computes an end meets it to round-off only
    if not ((s >= ends[0] - margin) & (s <= ends[-1] + margin)).all():
        raise InputError("r", r, f"{what} in [{ends[0]:g}, {ends[-1]:g}] are allowed")
    return np.clip(s, ends[0], ends[-1])

"""Work against precision of one equilibrium, what its parts cost, and what effects add."""

from __future__ import annotations

import os
import platform
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from .. import files
from ..accuracy import cost as work
from ..accuracy.cost import Course, Job, Measurement, Outcome, Reference
from ..accuracy.strong_form import StrongForm, prescribed
from ..errors import InputError, SolveError, unknown_name
from ..native import native
from ..origin import NOTED_VERSIONS, package_version, processor
from ..potential import Potential, potential_of
from ..results.records import Branch, Equilibrium
from ..results.store import save
from ..results.table import write_csv
from ..scene import MAX_DEGREE, Analysis, Scene
from ..solve.banded import BandFactor, BorderedFactor
from ..solve.start import start_at_height, start_at_pressure, start_at_volume
from ..solve.state import State
from ..stability.judge import judge
from ..stability.zones import find_zones
from ..threads import one_thread
from .arguments import check_scene
from .recording import record

#: columns of the table, and the machine with every line so that a table can stand alone
COLUMNS = (*(f.name for f in fields(Measurement)), "machine")

_TITLES = {
    "newton": "finite elements, Newton",
    "ipopt": "finite elements, IPOPT",
    "shooting": "shooting, Newton",
    "collocation": "collocation",
    "published": "shooting as published",
}
#: arguments of a study that takes seconds
QUICK: Mapping[str, Any] = {
    "degrees": (1, 2, 6),
    "elements": (8, 16),
    "tolerances": {"shooting": (1e-6,), "collocation": (1e-4,), "published": (1e-3,)},
    "repeat": 1,
    "budget": 0.2,
    "reference_elements": 32,
}
_SYMBOLS = {"volume": "V", "pressure": "P", "center_height": "pole height"}


@dataclass(frozen=True, eq=False)
class Cost:
    """What :func:`cost` measured.

    Attributes
    ----------
    scene : Scene
    control : str
        volume, pressure or center_height.
    load : float
    quantity : str
        pressure, or under pressure control volume: whose relative error is measured.
    reference : Reference
        What errors are measured against, and its own error.
    lines : tuple of Measurement
    machine : mapping of str to str
        Processor, number of processors, system and versions.
    """

    scene: Scene
    control: str
    load: float
    quantity: str
    reference: Reference
    lines: tuple[Measurement, ...] = field(repr=False)
    machine: Mapping[str, str] = field(repr=False)

    def select(self, **having: Any) -> tuple[Measurement, ...]:
        """The lines with these attributes (``what="solve", method="newton", start="warm"``).

        Raises
        ------
        InputError
            For an attribute that a line does not have.
        """
        for name in having:
            if name not in COLUMNS[:-1]:
                raise unknown_name("select", name, COLUMNS[:-1])
        return tuple(line for line in self.lines if all(getattr(line, name) == value for name, value in having.items()))

    @property
    def front(self) -> tuple[Measurement, ...]:
        """The solves that no other one with the same start beats in both time and error, warm ones first, the fastest first."""
        return tuple(
            sorted((line for line in self.lines if line.front), key=lambda line: (work.STARTS.index(line.start), line.milliseconds))
        )

    def __str__(self) -> str:
        return "\n".join(_text(self))

    def to_dataframe(self) -> Any:
        """All lines as a pandas DataFrame with the columns :data:`COLUMNS`."""
        import pandas

        return pandas.DataFrame(list(self._rows()), columns=list(COLUMNS))

    def write_csv(self, path: str | PathLike[str]) -> None:
        """Write all lines under a header, whole or not at all; what does not apply is left empty.

        Raises
        ------
        InputError
            When the folder does not exist or cannot be written to.
        """
        files.write_csv(path, COLUMNS, ([None if _absent(value) else value for value in row] for row in self._rows()))

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Error against milliseconds as a Matplotlib figure, also written to ``path`` if given."""
        from ..views.cost import plot_cost

        return plot_cost(self, path)

    def _rows(self) -> Iterator[list[Any]]:
        machine = ", ".join(self.machine.values())
        for line in self.lines:
            yield [*asdict(line).values(), machine]


@one_thread
def cost(
    scene: Scene,
    *,
    volume: float | None = None,
    pressure: float | None = None,
    center_height: float | None = None,
    degrees: Sequence[int] = (1, 2, 4, 6, 8),
    elements: Sequence[int] = (4, 8, 16, 32, 64, 128),
    solvers: Sequence[str] = ("newton", "ipopt"),
    starts: Sequence[str] = work.STARTS,
    methods: Sequence[str] | None = None,
    tolerances: Mapping[str, Sequence[float]] = work.TOLERANCES,
    repeat: int = 5,
    budget: float = 2.0,
    step: float | None = None,
    reference_elements: int = 64,
    parts: bool = True,
    clock: work.Clock = time.perf_counter,
) -> Cost:
    """Error against wall time of one equilibrium, by every method on every mesh.

    Finite elements of every degree on every mesh by every solver, *warm* (the next load step of a branch, predicted from the two states
    before it) and *cold* (as :func:`femmembrane.equilibrium` does without ``start``: inflated without sources, which are then turned on;
    that is Newton's work, and a cold IPOPT confirms it). Beside them, warm, the methods of :mod:`femmembrane.accuracy`, from a straight
    line through the same two states. Times are wall times of one process on one thread, taken in turns; compare them with each other
    rather than with those of another machine. The right-hand sides of shooting are interpreted, one radius at a time: compiled ones would
    be faster, and the number of them is there to say by how much.

    Parameters
    ----------
    scene : Scene
        Its own mesh is that of the stages and effects.
    volume, pressure, center_height : float
        Exactly one of them. A height is held by no minimiser: IPOPT is then left out.
    degrees, elements : sequence of int
        Degrees from 1 to 8 and numbers of elements, every one with every one.
    solvers : sequence of {"newton", "ipopt"}
    starts : sequence of {"warm", "cold"}
    methods : sequence of {"shooting", "collocation", "published"}, optional
        Default all of them, or none for a tension field or another shape than the disc, which they do not solve.
    tolerances : mapping of str to sequence of float
        Those at which each method is measured.
    repeat : int
        Medians are of so many times.
    budget : float
        Seconds after which one piece of work is not repeated.
    step : float, optional
        Load step; default a sixtieth of the load.
    reference_elements : int
        Elements of degree 8 of the reference.
    parts : bool
        Whether stages and effects are measured as well.
    clock : callable
        Seconds.

    Returns
    -------
    Cost

    Raises
    ------
    InputError
        For an argument that is not allowed.
    SolveError
        When the reference cannot be found. A method that fails does not raise: its line says so.
    """
    check_scene(scene)
    control, load = prescribed(volume, pressure, center_height)
    if load == 0 and not (scene.sources or scene.loads):
        raise InputError(control, load, "a load other than 0 is allowed without sources: the flat membrane has no stiffness to step from")
    _whole("degrees", degrees, MAX_DEGREE)
    _whole("elements", elements)
    _whole("repeat", [repeat])
    _whole("reference_elements", [reference_elements])
    _known("solvers", solvers, work.SOLVERS)
    _known("starts", starts, work.STARTS)
    _known("methods", methods or (), work.METHODS)
    for key, value, least in (("budget", budget, 0.0), ("step", 1.0 if step is None else step, np.nextafter(0, 1))):
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not least <= value < np.inf:
            raise InputError(key, value, f"a finite number {'>' if key == 'step' else '>='} 0 is allowed")
    if methods is None:
        methods = tuple(work.METHODS) if _has_strong_form(scene) else ()
    elif methods:
        StrongForm(scene)  # says why not
    _known("tolerances", [m for m in methods if m not in tolerances], ())
    if control == "center_height":
        solvers = [s for s in solvers if s != "ipopt"]
    course = Course(scene, control, load, step, max(reference_elements, *elements))
    if "ipopt" in solvers and len(degrees) * len(elements) > work.most_meshes():
        allowed = f"no more than {work.most_meshes()} meshes (degrees times elements) are allowed with IPOPT, which keeps so many problems"
        raise InputError("elements", tuple(elements), allowed)
    jobs = [*work.element_jobs(course, degrees, elements, solvers, starts), *work.method_jobs(course, methods, tolerances)]
    if parts:
        jobs += [*_stages(course), *_effects(course)]
    with tempfile.TemporaryDirectory() as folder:
        if parts:
            jobs += _outputs(course, Path(folder))
        lines = work.measure(jobs, course.reference.value, repeat, budget, clock)
    quantity = "volume" if control == "pressure" else "pressure"
    return Cost(scene, control, load, quantity, course.reference, work.with_front(lines, course.reference.error), machine())


def asked_load(scene: Scene) -> dict[str, Any]:
    """The last load that a scene's [run] asks for, as the argument of :func:`cost`: of arc length, where it ends.

    Raises
    ------
    InputError
        When the scene has no [run].
    """
    if scene.run is None:
        raise InputError("run", None, "missing; the load that is studied is the last one of [run]")
    if scene.run.control == "arc-length":
        return dict(scene.run.until or {})
    return {{"height": "center_height"}.get(scene.run.control, scene.run.control): float(scene.run.loads()[-1])}


def machine() -> dict[str, str]:
    """Processor, number of processors, system and versions."""
    return {
        "processor": processor(),
        "processors": f"{os.cpu_count()} processors",
        "system": f"{platform.system()} {platform.machine()}",
        "python": f"Python {platform.python_version()}",
        **{name: f"{name} {package_version(name)}" for name in NOTED_VERSIONS},
        "compiled": "NumPy" if native() is None else "compiled",
    }


def _whole(key: str, values: Sequence[int], most: int | None = None) -> None:
    numbers: list[Any] = list(values) if isinstance(values, Iterable) and not isinstance(values, (str, bytes)) else []
    for n in numbers or [None]:
        if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 1 or (most is not None and n > most):
            raise InputError(key, n if numbers else values, f"whole numbers {'>= 1' if most is None else f'from 1 to {most}'} are allowed")


def _known(key: str, names: Sequence[str], known: Any) -> None:
    single = isinstance(names, str) or not isinstance(names, Iterable)
    for name in [names] if single else names:
        if single or name not in known:
            raise unknown_name(key, str(name), known)


def _has_strong_form(scene: Scene) -> bool:
    try:
        StrongForm(scene)
    except InputError:
        return False
    return True


# --- parts of the work, on the scene's own mesh


def _stages(course: Course) -> list[Job]:
    """One evaluation, one factorisation, one verdict of each kind asked (the two controls and n = 1 by default), the zones."""
    scene = course.scene
    potential = potential_of(scene)
    state = course.step(potential)("newton", potential)
    x, p, evaluation = state.x, state.pressure, state.evaluation
    _, row, corner = course.control_at(course.load).equation(potential.space, x, p, evaluation)

    def factorise() -> None:
        factor = BorderedFactor(BandFactor(evaluation.band), -evaluation.volume_gradient, row, corner)
        factor.solve(evaluation.gradient, 0.0)

    asked: list[tuple[str, str | None, int]] = [(f"verdict, {c} control", c, 0) for c in scene.analysis.stability or ("pressure", "volume")]
    asked += [(f"verdict, n = {n}", None, n) for n in scene.analysis.azimuthal_modes or (1,)]
    stages: dict[str, Callable[[], Any]] = {
        "evaluation and assembly": lambda: potential.evaluate(x, p),
        "factorisation and solution": factorise,
    }
    for name, control, n in asked:
        # started from its own mode, as on a branch from that of the state before
        guess = judge(potential, x, p, evaluation, control, n).coefficients
        stages[name] = partial(judge, potential, x, p, evaluation, control, n, guess=guess)
    criterion = scene.analysis.wrinkling or "total"
    stages["zones of wrinkles"] = lambda: find_zones(scene, x, p, criterion)
    line = Measurement("stage", "", "", scene.degree, potential.space.n_elements, potential.space.n_free)
    return [_job(line, name, act) for name, act in stages.items()]


def _outputs(course: Course, folder: Path) -> list[Job]:
    """What one equilibrium leaves behind, by file."""
    from ..views.plots import plot_pressure_volume
    from ..views.vtk import write_vtk

    scene = course.scene.replace(analysis=Analysis())
    potential = potential_of(scene)
    equilibrium = record(scene, potential, course.step(potential)("newton", potential))
    branch = Branch(scene, (equilibrium,))
    outputs: dict[str, Callable[[], Any]] = {
        "output, table": lambda: write_csv(branch, folder / "branch.csv"),
        "output, NetCDF": lambda: save(branch, folder / "branch.nc"),
        "output, VTU": lambda: write_vtk(branch, folder / "membrane.pvd"),
        "output, picture": lambda: plot_pressure_volume(branch, folder / "pressure-volume.png"),
    }
    line = Measurement("stage", "", "", scene.degree, potential.space.n_elements, potential.space.n_free)
    return [_job(line, name, act) for name, act in outputs.items()]


def _job(line: Measurement, name: str, act: Callable[[], Any]) -> Job:
    def do() -> Outcome:
        act()
        return Outcome()

    return Job(replace(line, method=name), do)


def _effects(course: Course) -> list[Job]:
    """One load step by Newton with its record, without and with each effect, everything else as in the scene."""
    plain = course.scene.replace(run=None, analysis=Analysis(), tension_field=False)
    modes = course.scene.analysis.azimuthal_modes or (1,)
    pairs: dict[str, tuple[Scene, Scene]] = {}
    if plain.sources:
        pairs["sources"] = (plain.replace(sources=(), scales=None), plain)
    pairs["azimuthal modes"] = (plain, plain.replace(analysis=Analysis(azimuthal_modes=modes)))
    pairs["zones of wrinkles"] = (plain, plain.replace(analysis=Analysis(wrinkling=course.scene.analysis.wrinkling or "total")))
    pairs["tension field"] = (plain, plain.replace(tension_field=True))
    jobs = []
    for name, pair in pairs.items():
        for start, scene in zip(("off", "on"), pair, strict=True):
            line = Measurement("effect", name, start, scene.degree, course.scene.mesh.elements)
            jobs.append(Job(line, _recorded(course, scene)))
    return jobs


def _recorded(course: Course, scene: Scene) -> Callable[[], Outcome]:
    potential = potential_of(scene)
    cold: dict[str, Callable[[Potential, float], State]] = {
        "volume": start_at_volume,
        "pressure": start_at_pressure,
        "center_height": start_at_height,
    }
    try:
        again = course.step(potential, cold[course.control](potential, course.loads[0]))
        previous = record(scene, potential, again("newton", potential))  # lends its modes as the state before does on a branch
    except SolveError as error:
        message = str(error)
        return lambda: Outcome(converged=False, message=message)

    def do() -> Outcome:
        state = again("newton", potential)
        equilibrium: Equilibrium = record(scene, potential, state, previous)
        if scene.analysis.wrinkling:
            equilibrium.zones()
        return Outcome(iterations=state.iterations)

    return do


# --- the table as text


def _absent(value: Any) -> bool:
    return value is None or (isinstance(value, float) and np.isnan(value))


def _number(value: Any, form: str, width: int) -> str:
    return " " * (width - 1) + "-" if _absent(value) else f"{value:{width}{form}}"


def _text(study: Cost) -> Iterator[str]:
    letter = "V" if study.quantity == "volume" else "P"
    reference = study.reference
    at = f"{_SYMBOLS[study.control]} = {study.load:.9g}"
    yield f"One equilibrium at {at}: relative error in {letter} and milliseconds (* nothing is better in both)"
    yield (
        f"reference: {letter} = {reference.value:.15g}, {reference.elements} elements of degree {reference.degree}, "
        f"own error {reference.error:.1g}"
    )
    yield ", ".join(study.machine.values())
    yield from _element_table(study, letter)
    yield from _method_table(study, letter)
    stages, effects = study.select(what="stage"), study.select(what="effect")
    if stages:
        yield f"\n{'parts, on ' + str(stages[0].elements) + ' elements of degree ' + str(stages[0].degree):<54} {'ms':>9}"
        yield from (f"  {line.method:<52} {line.milliseconds:>9.3f}" for line in stages)
    if effects:
        yield f"\n{'one load step (Newton iterations)':<44} {'off ms':>14} {'on ms':>14}"
        for off, on in zip(effects[::2], effects[1::2], strict=True):
            times = (f"{line.milliseconds:9.3f} ({line.iterations:>2})" if line.converged else f"{'-':>14}" for line in (off, on))
            yield f"  {off.method:<42} {' '.join(times)}"


def _element_table(study: Cost, letter: str) -> Iterator[str]:
    lines = study.select(what="solve")
    kinds = list(dict.fromkeys((line.method, line.start) for line in lines if line.degree))
    meshes = list(dict.fromkeys((line.degree, line.elements, line.unknowns) for line in lines if line.degree))
    if not meshes:
        return
    heads = "".join(f"{method + ' ' + start:>14}" for method, start in kinds)
    builds = list(dict.fromkeys(method for method, _ in kinds))
    yield f"\ndegree elements unknowns {'error in ' + letter:>10}{heads}" + "".join(f"{'set-up ' + b:>15}" for b in builds)
    for degree, n, unknowns in meshes:
        own = {(line.method, line.start): line for line in lines if (line.degree, line.elements) == (degree, n)}
        error = next((line.error for line in own.values() if line.converged), None)
        times = "".join(_number(own[k].milliseconds, ".2f", 12) + (" *" if own[k].front else "  ") for k in kinds)
        setups = [
            next((own[k].setup_milliseconds for k in kinds if k[0] == b and not _absent(own[k].setup_milliseconds)), None) for b in builds
        ]
        yield f"{degree:>6} {n:>8} {unknowns:>8} {_number(error, '.1e', 10)}{times}" + "".join(_number(t, ".1f", 15) for t in setups)


def _method_table(study: Cost, letter: str) -> Iterator[str]:
    lines = [line for line in study.select(what="solve") if line.degree is None]
    if lines:
        yield f"\n{'method':<24} tolerance {'error in ' + letter:>10} {'ms':>12} {'iterations':>12} {'right-hand sides':>17}"
    for line in lines:
        time_ = _number(line.milliseconds, ".2f", 12) + (" *" if line.front else "  ")
        yield (
            f"{_TITLES[line.method]:<24} {line.tolerance:>9.0e} {_number(line.error, '.1e', 10)} {time_} {line.iterations:>10} "
            f"{line.evaluations:>17}" + ("" if line.converged else f"  {line.message}")
        )

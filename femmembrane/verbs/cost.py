"""Work against precision of one equilibrium, what its parts cost, and what effects add."""

from __future__ import annotations

import os
import platform
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..accuracy import cost as work
from ..accuracy.cost import Course, Job, Outcome
from ..accuracy.strong_form import StrongForm, prescribed
from ..checks import is_number, is_whole
from ..discretization.meridian import Disc
from ..errors import InputError, SolveError, unknown_name
from ..kernels import kernels
from ..origin import NOTED_VERSIONS, package_version, processor
from ..potential import potential_of
from ..results.branch import Branch
from ..results.cost import STARTS, Cost, Measurement
from ..results.equilibrium import Equilibrium
from ..results.store import save
from ..results.table import write_csv
from ..scene import MAX_DEGREE, Analysis, Scene
from ..scene.run import GAS
from ..solve.banded import BandFactor, BorderedFactor
from ..solve.controls import CONTROLS, control_kind
from ..solve.start import cold_start
from ..stability.checked_verdict import checked_verdict
from ..stability.zones import find_zones
from ..threads import one_thread
from .arguments import check_scene
from .load_run import LoadRequest
from .meshing import on_chosen_mesh
from .state_records import record

#: arguments of a study that takes seconds
QUICK: Mapping[str, Any] = {
    "degrees": (1, 2, 6),
    "elements": (8, 16),
    "tolerances": {"shooting": (1e-6,), "collocation": (1e-4,), "published": (1e-3,)},
    "repeat": 1,
    "budget": 0.2,
    "reference_elements": 32,
}


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
    starts: Sequence[str] = STARTS,
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

    Finite elements of every degree are measured on every mesh with every solver, warm and cold. *Warm* is the next load step of a branch,
    predicted from the two states before it. *Cold* is :func:`femmembrane.equilibrium` without ``start``: the membrane is inflated without
    sources, and these are then turned on. Newton's method does this work, and a cold IPOPT confirms it.

    The methods of :mod:`femmembrane.accuracy` are measured warm, from a straight line through the same two states. The right-hand sides of
    shooting are interpreted, one radius at a time. Compiled ones would be faster; their number is in the table.

    Times are wall times of one process on one thread, taken in turns. Compare them with each other rather than with another machine's.

    Parameters
    ----------
    scene : Scene
        Stages and effects are measured on its own mesh, or on the one that is chosen for the accuracy that it asks for.
    volume, pressure, center_height : float
        Exactly one of them. No minimiser holds a height: IPOPT is then left out.
    degrees, elements : sequence of int
        Degrees from 1 to 8 and numbers of elements; every degree is combined with every number.
    solvers : sequence of {"newton", "ipopt"}
    starts : sequence of {"warm", "cold"}
    methods : sequence of {"shooting", "collocation", "published"}, optional
        Default: all that solve the scene: the published one is for the disc, and none is for a tension field or a shape with kinks.
    tolerances : mapping of str to sequence of float
        Tolerances at which each method is measured.
    repeat : int
        Number of times that a median is taken over.
    budget : float
        Seconds after which one piece of work is not repeated.
    step : float, optional
        Load step. Default: a sixtieth of the load.
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
    _known("starts", starts, STARTS)
    _known("methods", methods or (), work.METHODS)
    for key, value, least in (("budget", budget, 0.0), ("step", 1.0 if step is None else step, np.nextafter(0, 1))):
        if not (is_number(value) and value >= least):
            raise InputError(key, value, f"a finite number {'>' if key == 'step' else '>='} 0 is allowed")
    if methods is None:
        methods = tuple(m for m in work.METHODS if m != "published" or isinstance(scene.mesh, Disc)) if _has_strong_form(scene) else ()
    elif methods:
        StrongForm(scene)  # says why not
    _known("tolerances", [m for m in methods if m not in tolerances], ())
    if not CONTROLS[control].minimised:
        solvers = [s for s in solvers if s != "ipopt"]
    if scene.open:
        scene = on_chosen_mesh(scene, LoadRequest(CONTROLS[control], np.array([load]), solver="newton")).scene
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
    if scene.run.number is not None or scene.run.control == GAS or GAS in (scene.run.until or ()):
        raise InputError("run.control", scene.run.number or GAS, "a run by volume, pressure, height or arc length is studied")
    if scene.run.control == "arc-length":
        return dict(scene.run.until or {})
    return {control_kind(scene.run.control).name: float(scene.run.loads()[-1])}


def machine() -> dict[str, str]:
    """Processor, number of processors, system and versions."""
    return {
        "processor": processor(),
        "processors": f"{os.cpu_count()} processors",
        "system": f"{platform.system()} {platform.machine()}",
        "python": f"Python {platform.python_version()}",
        **{name: f"{name} {package_version(name)}" for name in NOTED_VERSIONS},
        "compiled": kernels().name,
    }


def _whole(key: str, values: Sequence[int], most: int | None = None) -> None:
    numbers: list[Any] = list(values) if isinstance(values, Iterable) and not isinstance(values, (str, bytes)) else []
    for n in numbers or [None]:
        if not is_whole(n, most=most):
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

    analysis = scene.analysis
    asked = Analysis(analysis.stability or ("pressure", "volume"), analysis.azimuthal_modes or (1,)).verdicts
    stages: dict[str, Callable[[], Any]] = {
        "evaluation and assembly": lambda: potential.evaluate(x, p),
        "factorisation and solution": factorise,
    }
    for against in asked:
        ask = partial(checked_verdict, potential, x, p, evaluation, against.control, against.azimuthal)
        # started from its own mode, as on a branch from that of the state before
        stages[f"verdict, {against.brief}{' control' if against.control else ''}"] = partial(ask, guess=ask().coefficients)
    stages["zones of wrinkles"] = lambda: find_zones(scene, x, p, analysis.zone_criterion)
    line = Measurement("stage", "", "", scene.degree, potential.space.n_elements, potential.space.n_free)
    return [_job(line, name, act) for name, act in stages.items()]


def _outputs(course: Course, folder: Path) -> list[Job]:
    """What one equilibrium leaves behind, by file."""
    scene = course.scene.replace(analysis=Analysis())
    potential = potential_of(scene)
    equilibrium = record(scene, potential, course.step(potential)("newton", potential))
    branch = Branch(scene, (equilibrium,))
    outputs: dict[str, Callable[[], Any]] = {
        "output, table": lambda: write_csv(branch, folder / "branch.csv"),
        "output, NetCDF": lambda: save(branch, folder / "branch.nc"),
        "output, VTU": lambda: branch.to_vtk(folder / "membrane.pvd"),
        "output, picture": lambda: branch.plot(folder / "pressure-volume.png"),
    }
    line = Measurement("stage", "", "", scene.degree, potential.space.n_elements, potential.space.n_free)
    return [_job(line, name, act) for name, act in outputs.items()]


def _job(line: Measurement, name: str, act: Callable[[], Any]) -> Job:
    def do() -> Outcome:
        act()
        return Outcome()

    return Job(replace(line, method=name), do)


def _effects(course: Course) -> list[Job]:
    """One load step by Newton's method with its record, without and with each effect. Everything else is as in the scene."""
    plain = course.scene.replace(run=None, analysis=Analysis(), tension_field=False)
    modes = course.scene.analysis.azimuthal_modes or (1,)
    pairs: dict[str, tuple[Scene, Scene]] = {}
    if plain.sources:
        pairs["sources"] = (plain.replace(sources=(), scales=None), plain)
    pairs["azimuthal modes"] = (plain, plain.replace(analysis=Analysis(azimuthal_modes=modes)))
    pairs["zones of wrinkles"] = (plain, plain.replace(analysis=Analysis(wrinkling=course.scene.analysis.zone_criterion)))
    pairs["tension field"] = (plain, plain.replace(tension_field=True))
    jobs = []
    for name, pair in pairs.items():
        for start, scene in zip(("off", "on"), pair, strict=True):
            line = Measurement("effect", name, start, scene.degree, course.scene.mesh.elements)
            jobs.append(Job(line, _recorded(course, scene)))
    return jobs


def _recorded(course: Course, scene: Scene) -> Callable[[], Outcome]:
    potential = potential_of(scene)
    try:
        again = course.step(potential, cold_start(potential, CONTROLS[course.control], course.loads[0]))
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

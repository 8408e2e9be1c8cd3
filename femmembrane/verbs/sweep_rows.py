"""What a sweep computes of one scene: plain numbers, one row a scene."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from scipy.optimize import brentq

from ..checks import choice, number
from ..errors import FemmembraneError, InputError, SolveError, Status
from ..quantities import PLACES
from ..results.branch import Branch
from ..results.equilibrium import Equilibrium
from ..results.special_point import SpecialPoint
from ..scene import Analysis, Scene
from .follow import equilibrium, run
from .search import equilibria
from .trace import trace

#: message and status of a row when a scene fails for a reason outside of it; such a row is not kept, and the scene is tried again
UNEXPECTED = "unexpected error"
#: reference radii at which the smallest stress is looked for
_RADII = np.linspace(0.0, 1.0, 401)
#: steps of a trace between two looks at whether it has met what is sought
_PIECE = 20

#: how the onset of an instability was found, beside its numbers
ONSET, NEVER, ALWAYS = "onset", "never on this branch", "from the start"

Values = dict[str, Any]


@dataclass(frozen=True)
class Row:
    """What came of one scene.

    Attributes
    ----------
    status, message : str
        How its computation ended, as text.
    values : dict
        Numbers, texts and one-dimensional arrays; with an early end, what there was before it.
    seconds : float
        Wall time.
    """

    status: str
    message: str
    values: Values
    seconds: float = 0.0


@dataclass(frozen=True)
class Options:
    """What a quantity needs beside the scene; hashed with it.

    Attributes
    ----------
    pressure, volume : float or None
        The load of ``equilibria``.
    direction : {1, -1}
        Whether traces set out to larger or to smaller volumes.
    """

    pressure: float | None = None
    volume: float | None = None
    direction: int = 1


Compute = Callable[[Scene, Options], Row]


def compute(scene: Scene, quantity: str, options: Options) -> Row:
    """The row of one scene; whatever goes wrong is in its status and message."""
    clock = time.perf_counter()
    try:
        row = COMPUTED[quantity](scene, options)
    except FemmembraneError as error:
        status = str(error.status) if isinstance(error, SolveError) else "bad input"
        row = Row(status, str(error), {})
    except Exception as error:  # one scene must not stop thousands
        row = Row(UNEXPECTED, f"{type(error).__name__}: {error}", {})
    return Row(row.status, row.message, row.values, time.perf_counter() - clock)


def check(scene: Scene, quantity: str, options: Options) -> None:
    """Raise InputError for an unknown quantity, and for one that this scene with these options does not have."""
    choice("quantity", quantity, COMPUTED)
    given = {name: value for name, value in (("pressure", options.pressure), ("volume", options.volume)) if value is not None}
    if quantity == "equilibria":
        if len(given) != 1:
            raise InputError("quantity", quantity, "it takes exactly one of pressure and volume, such as pressure=1.8")
        ((name, load),) = given.items()
        number(name, load)
    elif given:
        raise InputError(*next(iter(given.items())), 'only quantity = "equilibria" takes a load; all others take the load of [run]')
    traced = quantity in TRACED
    if options.direction not in (1, -1) or (options.direction != 1 and not traced):
        raise InputError("direction", options.direction, f"1, or for {', '.join(TRACED)} -1 (towards smaller volumes) is allowed")
    if quantity != "equilibria" and scene.run is None:
        raise InputError("run", None, f'missing; quantity = "{quantity}" computes what [run] says')
    if traced and scene.run is not None and scene.run.control != "arc-length":
        raise InputError("run.control", scene.run.control, f'quantity = "{quantity}" needs control = "arc-length", with start and until')


def _run(scene: Scene, options: Options) -> Row:
    return _row(scene, run(scene))


def _branch(scene: Scene, options: Options) -> Row:
    return _row(scene, _traced(scene, options))


def _traced(scene: Scene, options: Options, special_points: bool = True, ended: Callable[[Branch], bool] | None = None) -> Branch:
    """The branch that [run] asks for, followed in pieces. It is the same as in one piece, but ends early where ``ended`` says so."""
    asked = scene.run
    if asked is None:
        raise InputError("run", None, "missing")
    piece = asked.max_steps if ended is None else _PIECE
    ways: dict[str, Any] = {"until": asked.until, "special_points": special_points}
    direction = asked.direction if options.direction == 1 else options.direction
    branch = trace(scene, start=cast(float, asked.start), direction=direction, max_steps=min(piece, asked.max_steps), **ways)
    while ended is not None and branch.status is Status.STEP_LIMIT and not ended(branch):
        made = len(branch) - 1
        if made >= asked.max_steps:
            break
        branch = trace(scene, start=branch, max_steps=min(made + piece, asked.max_steps), **ways)
    return branch


def _row(scene: Scene, branch: Branch) -> Row:
    """The curve of a branch, and where it turns."""
    values: Values = {name: branch.column(name) for name in PLACES}
    values["steps"] = len(branch)
    if branch.special_points is not None:
        for kind, tag in (("limit_point", "limit"), ("volume_fold", "fold"), ("azimuthal_onset", "onset")):
            points = [point for point in branch.special_points if point.kind == kind]
            if kind == "azimuthal_onset" and not scene.analysis.azimuthal_modes:
                continue
            values[f"{kind}s"] = len(points)
            for name in PLACES:
                values[f"{tag}_{name}"] = _array(getattr(point, name) for point in points)
            if kind == "azimuthal_onset":
                values["onset_waves"] = _array(point.azimuthal for point in points)
    if scene.analysis.wrinkling and len(branch):
        values["wrinkled_fraction"] = 1.0 - branch.column("fraction_taut")
        values["largest_wrinkled_fraction"] = float(values["wrinkled_fraction"].max())
    return Row(str(branch.status), branch.message, values)


def _equilibria(scene: Scene, options: Options) -> Row:
    load = {"pressure": options.pressure} if options.volume is None else {"volume": options.volume}
    found = equilibria(scene, **load)
    modes = scene.analysis.azimuthal_modes
    axisymmetric = np.array([eq.verdict(found.control).stable is True for eq in found], dtype=bool)
    upright = np.array([all(eq.verdict(azimuthal=n).stable is True for n in modes) for eq in found], dtype=bool)
    values: Values = {"equilibria": len(found), "stable_equilibria": int((axisymmetric & upright).sum())}
    for name in PLACES:
        values[f"state_{name}"] = _array(getattr(eq, name) for eq in found)
    values["state_energy"] = np.array(found.energies)
    values["state_stable"] = (axisymmetric & upright).astype(float)
    return Row(str(Status.CONVERGED), found.searched, values)


def _tipping(scene: Scene, options: Options) -> Row:
    """Where stability against one wave around the axis is first lost or regained along the branch."""
    asked = scene.replace(analysis=Analysis(azimuthal_modes=(1,)))

    def onset(branch: Branch) -> SpecialPoint | None:
        return next((p for p in branch.special_points or () if p.kind == "azimuthal_onset"), None)

    branch = _traced(asked, options, ended=lambda branch: onset(branch) is not None)
    first, point = branch[0].verdict(azimuthal=1), onset(branch)
    values = _place("onset", point)
    values["upright_at_start"] = float(first.stable is True)
    values["outcome"] = ONSET if point is not None else NEVER if first.stable else ALWAYS
    return _told(branch, values, point is not None)


def _wrinkling(scene: Scene, options: Options) -> Row:
    """Where the smallest principal stress along the meridian first becomes compressive on the branch."""
    criterion = scene.analysis.wrinkling or "mechanical"

    def compressed(branch: Branch) -> int | None:
        return next((k for k, eq in enumerate(branch) if _smallest_stress(eq, criterion) < 0), None)

    branch = _traced(scene.replace(analysis=Analysis()), options, special_points=False, ended=lambda b: compressed(b) is not None)
    first = compressed(branch)
    point = _where_compressed(branch.scene, branch[first - 1], branch[first], criterion) if first else None
    outcome = NEVER if first is None else ONSET if first else ALWAYS
    return _told(branch, {**_place("onset", point), "outcome": outcome}, first is not None)


def _told(branch: Branch, values: Values, found: bool) -> Row:
    """The row of an answer; without an answer it says how the branch ended."""
    return Row(str(Status.CONVERGED), "", values) if found else Row(str(branch.status), branch.message, values)


def _smallest_stress(eq: Equilibrium, criterion: str) -> float:
    profile = eq.profile(_RADII)
    return float(min(profile[f"{criterion}_stress_{k}"].min() for k in (1, 2)))


def _where_compressed(scene: Scene, before: Equilibrium, after: Equilibrium, criterion: str) -> Equilibrium:
    """The equilibrium between two neighbours at which the smallest stress is zero. It is sought by pole height, or by volume where the
    height turns back.
    """
    plain = scene.replace(run=None)
    last: SolveError | None = None
    for name in ("center_height", "volume"):

        def at(load: float, name: str = name) -> Equilibrium:
            where: dict[str, Any] = {name: load}
            return equilibrium(plain, **where, start=before, solver="newton")

        def stress(load: float, at: Callable[[float], Equilibrium] = at) -> float:
            return _smallest_stress(at(load), criterion)

        ends = getattr(before, name), getattr(after, name)
        try:
            if stress(ends[0]) >= 0 > stress(ends[1]):
                return at(float(brentq(stress, *ends, xtol=1e-10, rtol=1e-12)))
        except SolveError as error:
            last = error
    message = f"compression sets in between V = {before.volume:.6g} and {after.volume:.6g}, but the onset could not be located"
    raise SolveError(message, status=Status.NOT_CONVERGED if last is None else last.status)


def _place(tag: str, point: Any) -> Values:
    return {f"{tag}_{name}": np.nan if point is None else float(getattr(point, name)) for name in PLACES}


def _array(numbers: Iterable[float]) -> Any:
    return np.array(list(numbers), dtype=float)


COMPUTED: Mapping[str, Compute] = {
    "run": _run,
    "branch": _branch,
    "equilibria": _equilibria,
    "tipping": _tipping,
    "wrinkling": _wrinkling,
}
#: quantities that follow a branch by arc length
TRACED = ("branch", "tipping", "wrinkling")

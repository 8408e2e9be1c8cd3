"""The same equilibrium on many meshes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..accuracy.borders import holding
from ..accuracy.convergence import EIGENVALUE_ROUND_OFF, profile_norms
from ..checks import only, switch
from ..discretization.space import transferred
from ..errors import SolveError, Status
from ..potential import Array, potential_of
from ..results.convergence import COMPARED, PROFILES, ROUND_OFF, Convergence
from ..results.equilibrium import Equilibrium
from ..scene import MAX_DEGREE, Scene
from ..scene.run import GAS
from ..solve.bare import usual_volume
from ..solve.controls import CONTROLS, Control, control_kind
from ..solve.newton import correct
from ..solve.state import State
from ..threads import one_thread
from .arguments import check_increasing, check_scene
from .follow import equilibrium, run
from .over_number import Hold
from .state_records import record_on_borders
from .trace import trace

#: least number of elements of the reference, all of the highest degree
_REFERENCE_ELEMENTS = 32
#: a branch is traced from the moderately inflated membrane to a little beyond the volume of its first limit point
_TRACED_BEYOND = 1.1


@one_thread
def convergence(
    scene: Scene,
    *,
    volume: float | None = None,
    pressure: float | None = None,
    center_height: float | None = None,
    degrees: Sequence[int] = (1, 2, 3, 4),
    elements: Sequence[int] = (8, 16, 32, 64),
    start: Equilibrium | None = None,
    limit_points: bool = False,
) -> Convergence:
    """How fast an equilibrium converges with the degree and the number of elements, and how well it is known.

    :func:`equilibrium` finds the equilibrium on the scene's own mesh, stable or not. From there it is solved on a reference mesh of degree
    8 (32 elements, or half the largest number that is asked for) and then on every mesh. All meshes are graded like the scene's own.

    Parameters
    ----------
    scene : Scene
    volume, pressure, center_height : float
        Exactly one of them.
    degrees : sequence of int
        Increasing, from 1 to 8.
    elements : sequence of int
        Increasing.
    start : Equilibrium, optional
        An equilibrium of this scene to start from.
    limit_points : bool
        Whether to compare the first limit point between the moderately inflated membrane and the equilibrium as well.

    Returns
    -------
    Convergence

    Raises
    ------
    InputError, SolveError
        SolveError when the equilibrium cannot be found on the scene's own mesh or on the reference. Any other mesh on which it cannot be
        found is a line in ``messages`` and NaN in the tables.

    Examples
    --------
    The pressure converges at order 2 with linear elements, and at order 4 with quadratic ones:

    >>> import femmembrane as fm
    >>> study = fm.convergence(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16)), volume=1.0, degrees=(1, 2), elements=(8, 16))
    >>> [round(float(order), 1) for order in study.orders("pressure")[:, -1]]
    [2.0, 4.0]
    """
    check_scene(scene)
    degrees = check_increasing("degrees", degrees, MAX_DEGREE)
    elements = check_increasing("elements", elements, None)
    switch("limit_points", limit_points, "True or False is allowed")
    given = {"volume": volume, "pressure": pressure, "center_height": center_height}
    name, load = only("convergence", given, "exactly one of volume, pressure and center_height is allowed")
    plain = scene.replace(run=None, analysis=type(scene.analysis)())
    found = equilibrium(plain, volume=volume, pressure=pressure, center_height=center_height, start=start, solver="newton")
    control = CONTROLS[name].at(float(load))
    return _Study(found.scene, name, control, degrees, elements, limit_points).run(scene, float(load), found)


@one_thread
def convergence_of_run(scene: Scene, *, degrees: Sequence[int], elements: Sequence[int]) -> Convergence:
    """:func:`convergence` at the last load of the scene's [run], with the state that the run ends in.

    Raises
    ------
    InputError
        When the scene has no [run].
    SolveError
        When the run does not reach its last load.
    """
    degrees, elements = check_increasing("degrees", degrees, MAX_DEGREE), check_increasing("elements", elements, None)
    plain = scene.replace(analysis=type(scene.analysis)())
    branch = run(plain)
    if branch.status is not Status.CONVERGED or plain.run is None:
        raise SolveError(branch.message or str(branch.status), status=branch.status, result=branch)
    if branch.hold:  # at the last value of the number
        ((name, load),) = branch.hold.items()
    elif plain.run.until is not None:
        ((name, load),) = plain.run.until.items()
    else:
        kind = plain.run.control
        name, load = kind if kind == GAS else control_kind(kind).name, float(plain.run.loads()[-1])
    last = branch[-1]
    return _Study(last.scene, name, Hold(name, load).control(last.scene), degrees, elements, False).run(scene, load, last)


class _Study:
    """The solves of one study."""

    def __init__(
        self, scene: Scene, name: str, control: Control, degrees: tuple[int, ...], elements: tuple[int, ...], limit_points: bool
    ) -> None:
        self.scene, self.name, self.control, self.degrees, self.elements = scene, name, control, degrees, elements
        self.traced: tuple[float, float] | None = None
        self.limit_points = limit_points
        known = [q for q in COMPARED if q not in PROFILES and (limit_points or not q.startswith("limit_"))]
        self.quantities = [q for q in known if q != name and (scene.sources or q != "magnetic_energy")]

    def run(self, scene: Scene, load: float, found: Equilibrium) -> Convergence:
        n = max(_REFERENCE_ELEMENTS, self.elements[-1] // 2)
        fine = self.solve(MAX_DEGREE, n, found)
        others = [self.solve(MAX_DEGREE - 1, n, fine), self.solve(MAX_DEGREE, n // 2, fine)]
        if self.limit_points:
            self.traced = self._stretch(fine)
        reference = self.measured(fine)
        solved, messages = self._solve_all(fine)
        shape = (len(self.degrees), len(self.elements))
        values = {q: np.full(shape, np.nan) for q in self.quantities}
        errors = {q: np.full(shape, np.nan) for q in (*self.quantities, *PROFILES)}
        scale, floors = self._floors(fine, others, reference)
        for place, eq in solved.items():
            for q, value in self.measured(eq).items():
                values[q][place] = value
                errors[q][place] = abs(value - reference[q]) / scale[q]
            for q, norm in zip(PROFILES, _difference(eq, fine), strict=True):
                errors[q][place] = norm / scale[q]
        ordered = {q: errors[q] for q in COMPARED if q in errors}
        meshes = [self.scene.mesh.with_elements(n) for n in self.elements]
        return Convergence(
            scene=scene,
            control=self.name,
            load=load,
            degrees=self.degrees,
            elements=self.elements,
            unknowns=np.array([[potential_of(self.on(d, n)).space.n_free for n in self.elements] for d in self.degrees]),
            element_size=np.array([np.diff(mesh.breakpoints()).max() for mesh in meshes]),
            values=values,
            reference=reference,
            errors=ordered,
            floors=floors,
            scale=scale,
            meshes=f"{n} elements of degree {MAX_DEGREE}, against {n} of degree {MAX_DEGREE - 1} and {n // 2} of degree {MAX_DEGREE}",
            messages=tuple(messages),
        )

    def on(self, degree: int, elements: int) -> Scene:
        return self.scene.replace(mesh=self.scene.mesh.with_elements(elements), degree=degree)

    def solve(self, degree: int, elements: int, start: Equilibrium) -> Equilibrium:
        """The equilibrium on a mesh, from its neighbour on another."""
        scene = self.on(degree, elements)
        potential = potential_of(scene)
        guess = _transferred(start, scene)
        result = correct(potential, self.control, guess, start.pressure, damped=True, max_iterations=40)
        if result.status is not Status.CONVERGED:
            raise SolveError(f"{elements} elements of degree {degree}: the equilibrium was not found there", status=result.status)
        return record_on_borders(scene, State.of(result), holding(self.control))

    def measured(self, eq: Equilibrium) -> dict[str, float]:
        limit = self._first_limit(eq) if self.limit_points else {}
        verdicts = {f"lambda_{c}": eq.verdict(c).smallest_eigenvalue for c in ("pressure", "volume")}
        found = {**verdicts, **limit}
        return {q: float(found[q]) if q in found else float(getattr(eq, q)) for q in self.quantities}

    def _solve_all(self, fine: Equilibrium) -> tuple[dict[tuple[int, int], Equilibrium], list[str]]:
        solved: dict[tuple[int, int], Equilibrium] = {}
        messages: list[str] = []
        for i, degree in enumerate(self.degrees):
            for k, n in enumerate(self.elements):
                try:
                    solved[i, k] = self.solve(degree, n, fine)
                except SolveError as error:
                    messages.append(f"{error} ({error.status})")
        return solved, messages

    def _floors(
        self, fine: Equilibrium, others: Sequence[Equilibrium], reference: dict[str, float]
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Divisors of relative errors, and the error of the reference over the same divisors."""
        scale: dict[str, float] = {}
        floors: dict[str, float] = {}
        measured = [self.measured(eq) for eq in others]
        for q, value in reference.items():
            distance = max(abs(m[q] - value) for m in measured)
            scale[q] = abs(value) if abs(value) > 1e3 * distance else 1.0
            floors[q] = max(distance / scale[q], EIGENVALUE_ROUND_OFF if q.startswith("lambda") else ROUND_OFF)
        space = fine.potential.space
        for q, size, *distances in zip(PROFILES, profile_norms(space, fine.state), *(_difference(eq, fine) for eq in others), strict=True):
            scale[q], floors[q] = size, max(max(distances) / size, ROUND_OFF)
        return scale, floors

    def _stretch(self, fine: Equilibrium) -> tuple[float, float] | None:
        """Volumes between which the first limit point lies on the reference mesh."""
        first = usual_volume(fine.potential)
        if fine.volume <= first:
            return None
        branch = trace(fine.scene, start=first, until={"volume": fine.volume})
        volumes = [p.volume for p in branch.special_points or () if p.kind == "limit_point"]
        return (first, _TRACED_BEYOND * volumes[0]) if volumes else None

    def _first_limit(self, eq: Equilibrium) -> dict[str, float]:
        points = []
        if self.traced is not None:
            branch = trace(eq.scene, start=self.traced[0], until={"volume": self.traced[1]})
            points = [p for p in branch.special_points or () if p.kind == "limit_point"]
        return {f"limit_{q}": getattr(points[0], q) if points else np.nan for q in ("pressure", "volume")}


def _difference(eq: Equilibrium, fine: Equilibrium) -> tuple[float, float]:
    return profile_norms(eq.potential.space, eq.state, fine.potential.space, fine.state)


def _transferred(eq: Equilibrium, scene: Scene) -> Array:
    """The state interpolated on the mesh of another scene."""
    return transferred(eq.potential.space, eq.state, potential_of(scene).space)

"""Fits: numbers of a scene from measured tests, models side by side, and where to measure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..calibration.bulge import Bulge
from ..calibration.design import choose, errors_of, geometric_mean
from ..calibration.fitting import INTERVALS, fitted
from ..calibration.laws import Law
from ..calibration.measured import measured_tests
from ..calibration.models import MODELS, compared
from ..calibration.simple import KINDS, Simple
from ..calibration.statistics import DETERMINED
from ..checks import choice, number, whole
from ..errors import InputError, SolveError, Status
from ..potential import Array, potential_of
from ..results.fit import Comparison, Fit, Plan
from ..scene import Scene
from ..threads import one_thread
from .arguments import check_scene

#: most starts of a fit, measurements of a plan, data sets that are drawn
_MOST_STARTS, _MOST_POINTS, _MOST_SAMPLES = 100, 1000, 10**6


@one_thread
def fit(
    scene: Scene,
    data: Any,
    parameters: Sequence[str],
    *,
    noise: Any = None,
    units: str | None = None,
    starts: int | None = None,
    intervals: str = "auto",
    samples: int = 0,
) -> Fit:
    """Find the numbers of a scene that suit measured tests best, with intervals, and with what the data do not determine.

    Weighted least squares by scipy.optimize.least_squares. Predictions are made at held heights (or volumes, or stretches), where a limit
    point of the pressure is an ordinary point, with derivatives by the implicit function theorem.

    Parameters
    ----------
    scene : Scene
        The membrane; its numbers are where the fit starts.
    data : mapping, DataFrame, path, LabTest, or a list of these
        Columns with their units: ``center_height`` (or ``pole_height``), ``pressure``, ``volume``, ``pole_stretch``; ``state``, ``r`` and
        ``z`` of profiles; ``stretch`` with ``uniaxial_stress``, ``planar_stress`` or ``equibiaxial_stress`` (nominal). ``pressure_kPa`` has
        a unit, and ``pressure_sd_kPa`` is a standard deviation. Without units columns are in units of the package. The first of height,
        volume and stretch that has no deviation is held, and known exactly.
    parameters : sequence of str
        Numbers as scene files have them. With a modulus among them the shear modulus is free: ``material.mu``, ``material.c10`` and
        ``material.c01``, ``material.c1`` to ``c3`` of Yeoh's, ``material.mu.K`` of Ogden's, or ``scales.shear_modulus`` for any material.
        Without one it stays what it is, the unit of stress: ``material.ratio``, ``material.jm``, ``membrane.prestretch``, ...
    noise : mapping, str or float, optional
        Standard deviations by column: "1 %" of the value, "0.05 kPa", or a number in the unit of the column. One value alone is that of the
        pressure or stress. What nothing is said about is one unknown deviation for a column, which residuals tell.
    units : {"scaled", "si"}, optional
        What columns without a unit are, where the scene has scales.
    starts : int, optional
        Starts of the solver, the first at the scene. Left out: one for a single number, two for two, three for more.
    intervals : {"auto", "linear", "profile"}
        Whether profile likelihood replaces the linearised intervals where they differ, nowhere, or wherever it can be followed.
    samples : int
        Fits to so many data sets, drawn around the result with the deviations of the data: the parametric bootstrap. A fit of two numbers
        to 20 rows takes some 20 ms.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        For names that the scene does not have, and for tables with something wrong, named by row and column: negative, missing or repeated
        numbers, decimal commas, missing units, units that are wrong by 1000, fewer rows than numbers.
    SolveError
        When no start has a prediction for all rows.

    Examples
    --------
    The ratio of a Mooney-Rivlin rubber and its shear modulus, out of six heights:

    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.MooneyRivlin(ratio=0.3), mesh=fm.disc(8), degree=4)
    >>> table = {
    ...     "center_height": [0.2, 0.4, 0.6, 0.8, 1.0, 1.2],
    ...     "pressure": [0.101, 0.586, 1.256, 1.776, 2.086, 2.278],
    ... }
    >>> found = fm.fit(scene, table, ["material.c10", "material.c01"], noise="1 %")
    >>> print(found)
    parameter           value    error  95 % interval
    material.c10     0.453539    1.3 %  0.44206 to 0.46502
    material.c01    0.0459236    6.9 %  0.039739 to 0.052108
    determined
    """
    check_scene(scene)
    choice("intervals", intervals, INTERVALS)
    law = Law(scene, parameters)
    count = _starts(starts, len(law.names))
    drawn = whole("samples", samples, least=0, most=_MOST_SAMPLES)
    return fitted(law, measured_tests(law, data, noise, units), starts=count, intervals=intervals, samples=drawn)


def _starts(starts: int | None, numbers: int) -> int:
    return min(numbers, 3) if starts is None else whole("starts", starts, most=_MOST_STARTS)


@one_thread
def compare_models(
    scene: Scene, data: Any, *, models: Sequence[str] = tuple(MODELS), noise: Any = None, units: str | None = None, starts: int = 3
) -> Comparison:
    """Fit several strain energies to the same tests, each with a free shear modulus, and order them by AICc.

    Parameters
    ----------
    scene : Scene
        The membrane; its material plays no part.
    data : mapping, DataFrame, path, LabTest, or a list of these
        As for :func:`fit`.
    models : sequence of str
        Of "neo-hookean", "mooney-rivlin", "gent", "yeoh", "ogden-1", "ogden-2" and "ogden-3"; left out: all.
    noise, units
        As for :func:`fit`.
    starts : int
        Starts of each fit.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        As :func:`fit`.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(mesh=fm.disc(8), material=fm.NeoHookean())
    >>> rubber = {"stretch": [1.1, 1.3, 1.6, 2.0, 2.5], "equibiaxial_stress": [0.485, 1.04, 1.494, 1.944, 2.474]}
    >>> compare = fm.compare_models(scene, rubber, models=["neo-hookean", "mooney-rivlin"], noise="1 %", starts=1)
    >>> [model.name for model in compare]
    ['neo-hookean', 'mooney-rivlin']
    """
    check_scene(scene)
    if isinstance(models, str) or not models:
        raise InputError("models", models, f"a list of these is allowed: {', '.join(MODELS)}")
    return compared(scene, data, list(models), noise, units, whole("starts", starts, most=_MOST_STARTS))


@one_thread
def plan_fit(
    scene: Scene,
    parameters: Sequence[str],
    *,
    heights: ArrayLike | None = None,
    tests: Mapping[str, Any] | None = None,
    points: int = 20,
    noise: float = 0.01,
    most: int | None = None,
) -> Plan:
    """Which measurements would determine numbers best: D-optimal among candidates, by the numbers that the scene has now.

    Parameters
    ----------
    scene : Scene
        The membrane with numbers that are expected.
    parameters : sequence of str
        As for :func:`fit`.
    heights : array_like, optional
        Candidate heights of the pole (volumes, where no height can be held). Left out: 30 up to one and a half times the radius.
    tests : mapping, optional
        Further candidate tests by a name of your own: a scene (of another pre-stretch or radius), a pair (scene, heights), or a pair of
        "uniaxial", "planar" or "equibiaxial" and stretches.
    points : int
        Number of measurements.
    noise : float
        Standard deviation of a pressure or stress, over its value.
    most : int, optional
        How often one candidate may be measured. Left out: as often as it helps.

    Returns
    -------
    Plan

    Raises
    ------
    InputError, SolveError
        SolveError when a candidate has no state.

    Examples
    --------
    Gent's limit is felt at great heights alone, and the modulus at small ones:

    >>> import numpy as np, femmembrane as fm
    >>> scene = fm.Scene(material=fm.Gent(jm=30.0), mesh=fm.disc(8), degree=4)
    >>> plan = fm.plan_fit(scene, ["material.mu", "material.jm"], heights=np.linspace(0.1, 1.1, 11), points=10)
    >>> sorted({round(height, 2) for _, height in plan.points})
    [0.1, 1.1]
    """
    check_scene(scene)
    law = Law(scene, parameters)
    whole("points", points, most=_MOST_POINTS)
    number("noise", noise, "a part of the value > 0 is allowed, such as 0.01", above=0.0)
    if most is not None:
        whole("most", most, most=_MOST_POINTS)
    candidates = _candidates(law, scene, heights, tests or {}, noise)
    if most is not None and most * sum(len(values) for _, values, _ in candidates) < points:
        raise InputError("most", most, f"as many candidates as points are allowed: there are {sum(len(v) for _, v, _ in candidates)}")
    rows = np.concatenate([r for _, _, r in candidates])
    places = [(name, float(value)) for name, values, _ in candidates for value in values]
    chosen = sorted(choose(rows, points, most=most), key=lambda k: k)
    first = candidates[0][2]
    even = first[np.round(np.linspace(0, len(first) - 1, points)).astype(int)]
    best, usual = rows[chosen].T @ rows[chosen], even.T @ even
    errors, plain = errors_of(best), errors_of(usual)
    determined = bool((errors <= DETERMINED).all())
    alone = {}
    for name, _, own in candidates:
        both = own if name == candidates[0][0] else np.concatenate([first, own])
        picked = both[choose(both, points, most=most)]
        alone[name] = geometric_mean(picked.T @ picked)
    return Plan(
        parameters=law.names,
        points=tuple(places[k] for k in chosen),
        standard_errors=dict(zip(law.names, map(float, errors), strict=True)),
        even_errors=dict(zip(law.names, map(float, plain), strict=True)),
        determined=determined,
        verdict="determined" if determined else _not_determined(law, errors, points),
        gain=geometric_mean(usual) / geometric_mean(best) if math.isfinite(geometric_mean(usual)) else math.inf,
        tests=alone,
    )


def _not_determined(law: Law, errors: Array, points: int) -> str:
    bad = [f"{name} ({100 * error:.2g} %)" for name, error in zip(law.names, errors, strict=True) if not error <= DETERMINED]
    return f"not determined by {points} measurements among these candidates: {', '.join(bad)}; add candidates or measurements"


def _candidates(law: Law, scene: Scene, heights: Any, tests: Mapping[str, Any], noise: float) -> list[tuple[str, Array, Array]]:
    """Name, values and relative derivatives over deviations of the candidates of each test."""
    found = [("bulge", *_bulge(law, scene, heights, noise))]
    for name, given in tests.items():
        if isinstance(given, Scene):
            given = (given, None)
        try:
            kind, values = given
        except (TypeError, ValueError):
            raise InputError(f"tests[{name!r}]", given, "a scene, (scene, heights), or ('uniaxial', stretches) is allowed") from None
        if isinstance(kind, Scene):
            found.append((name, *_bulge(law, kind, heights if values is None else values, noise)))
            continue
        stretch = _numbers(f"tests[{name!r}]", values)
        predicted = Simple(law, choice(f"tests[{name!r}]", kind, KINDS)).predict(law.start, stretch)
        if predicted is None:
            raise SolveError(f"test {name!r} has no prediction at all stretches", status=Status.NOT_CONVERGED)
        found.append((name, stretch, _relative(law, predicted[0], predicted[1], noise)))
    return found


def _bulge(law: Law, scene: Scene, heights: Any, noise: float) -> tuple[Array, Array]:
    space = potential_of(scene).space
    held = "center_height" if space.pole < space.n_free else "volume"
    size = float(space.unit) ** (1 if held == "center_height" else 3)
    targets = np.linspace(0.05, 1.5, 30) * size if heights is None else _numbers("heights", heights)
    predictor = Bulge(law, scene, held)
    states = predictor.states(law.start, targets)
    if states is None:
        raise SolveError(f"a candidate has no state: {predictor.why}", status=Status.NO_EQUILIBRIUM)
    return targets, _relative(law, states.pressure, states.d_pressure, noise)


def _relative(law: Law, value: Array, derivatives: Array, noise: float) -> Array:
    size = np.where(law.start == 0, 1.0, np.abs(law.start))
    rows: Array = derivatives[:, :-1] * size / (noise * np.abs(value))[:, None]
    return rows


def _numbers(key: str, values: Any) -> Array:
    try:
        found = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(key, values, "a list of numbers > 0 is allowed") from None
    if found.ndim != 1 or not found.size or not (np.isfinite(found) & (found > 0)).all():
        raise InputError(key, values, "a list of numbers > 0 is allowed")
    return found

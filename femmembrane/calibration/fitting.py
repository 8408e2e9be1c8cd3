"""From tests and a law to the record of a fit."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ..errors import InputError, Status
from ..results.fit import Correlation, Fit, FittedColumn, percent
from .bulge import Bulge
from .design import errors_of
from .laws import Law
from .least_squares import Estimate, Problem
from .measured import Measured
from .readings import suspicions
from .resampling import refits
from .simple import Simple
from .statistics import (
    DETERMINED,
    Spread,
    determined_combinations,
    linear_intervals,
    profile_intervals,
    quantile,
    short_name,
    spread_of,
)

Array = NDArray[np.float64]

#: confidence of intervals and bands
LEVEL = 0.95
INTERVALS = ("auto", "linear", "profile")
#: seed of data sets that are drawn
_SEED = 7
#: probability of a larger scatter below which the deviations that were given are questioned
_IMPROBABLE = 1e-3
#: how many times the largest height of the data a further test is looked for, and how many heights are tried
_HIGHER, _TRIED = 3.0, 8


def check_count(law: Law, problem: Problem) -> None:
    """Refuse fewer measurements than numbers.

    Raises
    ------
    InputError
    """
    count, needed = problem.count - problem.free_states, len(law.names)
    if count < needed:
        rows = sum(len(test.table) for test in problem.tests)
        raise InputError(
            "data", f"{rows} rows", f"they give {count} predicted numbers for {needed} parameters; at least as many are allowed"
        )
    if count == needed and problem.has_unknown:
        allowed = f"as many as {needed} parameters leave nothing to judge the noise by; more rows are allowed, or noise= such as '1 %'"
        raise InputError("data", f"{count} rows", allowed)


def fitted(law: Law, tests: Sequence[Measured], *, starts: int, intervals: str, advise: bool = True, samples: int = 0) -> Fit:
    """Fit the numbers of a law to tests.

    Raises
    ------
    InputError, SolveError
        The latter when no start has a prediction.
    """
    clock = time.perf_counter()
    problem = Problem(law, tests)
    check_count(law, problem)
    estimate = problem.estimate(starts)
    values, spread = estimate.point.values, spread_of(estimate.point.jacobian, estimate.point.values)
    half = quantile(LEVEL, problem.freedom, problem.has_unknown)
    linear = linear_intervals(problem, estimate, spread, half)
    found, followed = linear, list[int]()
    if intervals != "linear":
        with np.errstate(all="ignore"):
            known = spread.errors <= DETERMINED * 2 * np.abs(values)
        which = [k for k in range(len(values)) if intervals == "profile" or known[k]]
        found, followed = profile_intervals(problem, estimate, spread, half, linear, which)
    determined, verdict = _verdict(law, problem, values, spread, estimate, advise)
    names = law.names
    chi_square = estimate.cost
    pair = {name: (float(a), float(b)) for name, (a, b) in zip(names, found, strict=True)}
    straight = {name: (float(a), float(b)) for name, (a, b) in zip(names, linear, strict=True)}
    fit = Fit(
        scene=law.fitted_scene(values),
        parameters=names,
        values=dict(zip(names, map(float, values), strict=True)),
        standard_errors=dict(zip(names, map(float, spread.errors), strict=True)),
        intervals=pair,
        linear_intervals=straight,
        units={name: law.unit_of(name) for name in names},
        correlation=Correlation(names, _frozen(spread.correlation)),
        covariance=_frozen(spread.covariance),
        determined=determined,
        verdict=verdict,
        combinations=int((spread.singular_values > 1 / DETERMINED).sum()),
        on_bounds=tuple(names[k] for k in estimate.on_bound),
        profiled=tuple(names[k] for k in followed),
        columns=tuple(_columns(problem, estimate, spread, half)),
        chi_square=chi_square,
        freedom=problem.freedom,
        noise={_column_name(t, b.name): b.level / t.table.factors.get(b.name, 1.0) for t, b in problem.blocks if b.noise.unknown},
        log_likelihood=_log_likelihood(problem, chi_square),
        status=Status.CONVERGED if estimate.converged else Status.NOT_CONVERGED,
        notes=(*_notes(law, problem, estimate), *(suspicions(law, tests, problem, estimate) if advise else ())),
        seconds=time.perf_counter() - clock,
        evaluations=problem.evaluations,
    )
    return replace(fit, samples=_drawn(problem, values, samples)) if samples else fit


def _drawn(problem: Problem, values: Array, count: int) -> dict[str, Array]:
    """Numbers of fits to data sets drawn around the result."""
    found = [refit.estimate.point.values for refit in refits(problem, values, count, _SEED) if refit is not None]
    columns = np.array(found).reshape(-1, len(values)).T
    return {name: _frozen(column) for name, column in zip(problem.law.names, columns, strict=True)}


def _frozen(array: Array) -> Array:
    array = np.array(array)
    array.flags.writeable = False
    return array


def _column_name(test: Measured, quantity: str) -> str:
    header = test.table.headers.get(quantity, quantity)
    return header if test.number == 0 else f"{header} of test {test.number + 1}"


def _log_likelihood(problem: Problem, chi_square: float) -> float:
    """Of normal errors; an unknown deviation is the most likely one, without the correction for what was adjusted."""
    total = 0.0
    point = problem.at(problem._known.values) if problem._known is not None else None
    for (_, block), rows in zip(problem.blocks, problem.slices, strict=True):
        deviation, n = block.deviation, len(block.measured)
        square = 0.0 if point is None else float(point.residuals[rows] @ point.residuals[rows])
        if block.noise.unknown:
            level = max(float(deviation[0]) * math.sqrt(square / n), 1e-300)
            total += -n * math.log(level) - n / 2
        else:
            total += -float(np.log(deviation).sum()) - square / 2
        total -= n / 2 * math.log(2 * math.pi)
    return total


def _columns(problem: Problem, estimate: Estimate, spread: Spread, half: float) -> list[FittedColumn]:
    found = []
    for test, predictions in zip(problem.tests, estimate.point.predictions, strict=True):
        targets, factors, headers = test.targets, test.table.factors, test.table.headers
        for block, (value, derivatives) in zip(test.blocks, predictions, strict=True):
            if block.name == test.target:
                continue
            unit = factors.get(block.name if block.name != "profile" else "z", 1.0)
            with np.errstate(all="ignore"):
                J = derivatives[:, :-1]
                band = half * np.sqrt(
                    np.maximum(np.einsum("ip,pq,iq->i", J, np.where(np.isfinite(spread.covariance), spread.covariance, 0.0), J), 0.0)
                )
            against = factors.get(test.target, 1.0)
            own = next((b for b in test.blocks if b.name == test.target), None)
            found.append(
                FittedColumn(
                    test=test.name,
                    quantity=block.name,
                    header=headers.get(block.name, block.name),
                    against=test.target,
                    against_header=headers.get(test.target, test.target),
                    held=_frozen(targets[block.state] / against),
                    held_measured=_frozen((targets if own is None else own.measured)[block.state] / against),
                    held_deviation=_frozen((np.zeros(test.count) if own is None else own.deviation)[block.state] / against),
                    measured=_frozen(block.measured / unit),
                    predicted=_frozen(value / unit),
                    deviation=_frozen(block.deviation / unit),
                    residual=_frozen((value - block.measured) / block.deviation),
                    slope=_frozen(derivatives[:, -1] / unit * against),
                    band=_frozen(band / unit),
                    rows=tuple(test.table.rows[int(k)] for k in block.rows),
                    states=tuple(int(k) for k in block.state),
                )
            )
    return found


def _notes(law: Law, problem: Problem, estimate: Estimate) -> list[str]:
    notes = [note for test in problem.tests for note in test.notes]
    for k in estimate.on_bound:
        name, value = law.names[k], float(estimate.point.values[k])
        notes.append(f"{name} = {value:.6g} stands on the bound of what is allowed: data ask for a number beyond it")
    if not estimate.converged:
        notes.append(f"the solver did not arrive ({estimate.message}); the numbers are those that suit the data best so far")
    freedom = problem.freedom
    if not problem.has_unknown and freedom > 0:
        ratio = math.sqrt(estimate.cost / freedom)
        if stats.chi2.sf(estimate.cost, freedom) < _IMPROBABLE:
            notes.append(
                f"residuals are {ratio:.3g} times the noise given: the model does not describe these data within it, or the noise is larger"
            )
    return notes


# --- the verdict


def _verdict(law: Law, problem: Problem, values: Array, spread: Spread, estimate: Estimate, advise: bool) -> tuple[bool, str]:
    with np.errstate(all="ignore"):
        relative = spread.errors / np.abs(values)
    bad = [k for k in range(len(values)) if not relative[k] <= DETERMINED and k not in estimate.on_bound]
    determined = not bad and not estimate.on_bound
    if determined:
        return True, "determined"
    if not bad:
        on = ", ".join(short_name(law.names[k]) for k in estimate.on_bound)
        return False, f"determined, but for {on}, which stands on a bound"
    combinations = determined_combinations(law, values, spread)
    advice = f": {_advice(law, problem, values, relative)}" if advise else ""
    if not combinations:
        count = int((spread.singular_values > 1 / DETERMINED).sum())
        seen = f" (only {count} of {len(values)} combinations of these numbers are)" if count else ""
        return False, f"not determined by these data{seen}{advice}"
    named = " and ".join(f"{c.name} (to {percent(c.error)})" for c in combinations)
    verb = "is" if len(combinations) == 1 else "are"
    return False, f"only {named} {verb} determined; {', '.join(short_name(law.names[k]) for k in bad)} not determined by these data{advice}"


def _advice(law: Law, problem: Problem, values: Array, relative: Array) -> str:
    """What to measure besides: greater heights of the first bulge test, else a simple test that would do, else fewer numbers."""
    J = np.concatenate([test_rows(problem, i) for i in range(len(problem.tests))]) if problem.tests else np.empty((0, len(values)))
    information = J.T @ J
    for test in problem.tests:
        if test.kind == "bulge":
            higher = _higher(law, test, values, information)
            if higher:
                return higher
    present = {test.kind for test in problem.tests}
    for kind in ("equibiaxial", "uniaxial", "planar"):
        if kind in present or hasattr(law.scene.material, "volume_ratio"):
            continue
        stretch = np.linspace(1.1, 4.0, 15)
        found = Simple(law, kind).predict(values, stretch)
        if found is None:
            continue
        rows = found[1][:, :-1] * np.abs(values) / (0.01 * np.abs(found[0]))[:, None]
        if (errors_of(information + rows.T @ rows) <= DETERMINED).all():
            return f"add a test in {kind} tension"
    return "fit fewer numbers, or add tests of other kinds"


def test_rows(problem: Problem, i: int) -> Array:
    """Rows of the relative Jacobian of one test at the estimate."""
    start = sum(sum(len(b.measured) for b in test.blocks) for test in problem.tests[:i])
    count = sum(len(b.measured) for b in problem.tests[i].blocks)
    point = problem._known
    if point is None:
        return np.empty((0, len(problem.law.names)))
    rows: Array = point.jacobian[start : start + count] * np.abs(point.values)
    return rows


def _higher(law: Law, test: Measured, values: Array, information: Array) -> str:
    """The least height from which on ten more rows with the noise of these would do; empty where none is found."""
    block = next((b for b in test.blocks if b.name in ("pressure", "volume") and b.name != test.target), None)
    if block is None:
        return ""
    top = float(np.max(np.abs(test.targets)))
    predictor = Bulge(law, test.scene, test.target)
    power = 1.0 if test.target == "center_height" else 3.0
    heights = top * np.linspace(1.05, _HIGHER, _TRIED) ** power
    noise = float(np.median(block.deviation / np.maximum(np.abs(block.measured), 1e-300)))
    rows, reached = [], []
    for height in heights:
        states = predictor.states(values, np.array([height]))
        if states is None:
            break
        value, derivatives = (states.pressure, states.d_pressure) if block.name == "pressure" else (states.volume, states.d_volume)
        rows.append(derivatives[0, :-1] * np.abs(values) / (noise * abs(float(value[0]))))
        reached.append(float(height))
        # as many rows, spread from the data to here
        own = np.array(rows)
        weight = len(block.measured) / len(own)
        if (errors_of(information + weight * own.T @ own) <= DETERMINED).all():
            shown = f"{top / test.table.factors.get(test.target, 1.0):.3g}"
            end = f"{reached[-1] / test.table.factors.get(test.target, 1.0):.3g}"
            header = test.table.headers.get(test.target, test.target)
            what = "heights" if test.target == "center_height" else "volumes"
            return f"add {what} above {shown}, up to about {end} ({header}), as many rows again"
    return ""

"""Other readings of a table that fits badly: columns exchanged, a unit that is another one, a sign, pressures with that of the air.

A fit has a free modulus most often, so that a pressure in a wrong unit only changes its number, and exchanged columns still have a fit.
What tells is how close it is. Where a fit is far from its data, the same numbers are read in the ways in which tables go wrong, and a
reading that comes far closer is named. Nothing is changed: it is a question.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, SolveError
from .laws import Law
from .least_squares import Estimate, Problem
from .measured import LabTest, Measured

Array = NDArray[np.float64]

#: misfit, over the size of the pressures, from which on a fit is far from its data; how much closer another reading comes, and to what
_FAR, _CLOSER, _CLOSE = 0.03, 4.0, 0.05
#: lengths that are taken for each other: by what a number is multiplied, and what it then was
_LENGTHS = (
    (10.0, "in cm in place of mm"),
    (0.1, "in mm in place of cm"),
    (25.4, "in inches in place of mm"),
    (1 / 25.4, "in mm in place of inches"),
    (2.54, "in inches in place of cm"),
    (1 / 2.54, "in cm in place of inches"),
)
_VOLUMES = ((1000.0, "in l in place of ml"), (1e-3, "in mm³ in place of ml"), (16.387064, "in cubic inches in place of ml"))
#: that of the air, in Pa
_AIR = 101325.0


def suspicions(law: Law, tests: Sequence[Measured], problem: Problem, estimate: Estimate) -> list[str]:
    """What a table that fits badly may have been meant as, a sentence for each test of which another reading comes far closer."""
    found = []
    for k, test in enumerate(tests):
        before = _misfit(test, problem, estimate)
        if before is None or before < _FAR:
            continue
        tried = [(_refitted(law, tests, k, other), words) for words, other in _readings(test)]
        after, words = min(
            ((misfit, words) for misfit, words in tried if misfit is not None), default=(np.inf, ""), key=lambda pair: pair[0]
        )
        if after < min(_CLOSE, before / _CLOSER):
            found.append(f"{test.name}: the fit misses the pressures by {before:.2g} of their size, and by {after:.2g} {words}")
    return found


def _misfit(test: Measured, problem: Problem, estimate: Estimate) -> float | None:
    """Root mean square of what is missed of the pressures of a test, over that of the pressures; None without pressures."""
    predictions = estimate.point.predictions[list(problem.tests).index(test)]
    for block, (value, _) in zip(test.blocks, predictions, strict=True):
        if block.name == "pressure":
            return float(np.linalg.norm(value - block.measured) / np.linalg.norm(block.measured))
    return None


def _refitted(law: Law, tests: Sequence[Measured], place: int, other: LabTest) -> float | None:
    """The misfit of one test read otherwise, beside the others as they are; None where that has no fit."""
    try:
        read = Measured(law, other, place)
        problem = Problem(law, [read if k == place else test for k, test in enumerate(tests)])
        return _misfit(read, problem, problem.estimate(1))
    except (InputError, SolveError):
        return None


def _readings(test: Measured) -> Iterator[tuple[str, LabTest]]:
    """In which ways the table of a bulge test may have been meant, in words."""
    columns, factors, headers = test.table.columns, test.table.factors, test.table.headers
    held = next((name for name in ("center_height", "volume") if name in columns), None)
    if test.kind != "bulge" or "pressure" not in columns or held is None:
        return
    pressure, place, own = columns["pressure"], columns[held], headers[held]
    swapped = {"pressure": place / factors[held] * factors["pressure"], held: pressure / factors["pressure"] * factors[held]}
    yield f"where {own!r} and {headers['pressure']!r} are exchanged: are these columns swapped?", _read(test, swapped)
    for factor, words in _LENGTHS if held == "center_height" else _VOLUMES:
        yield f"where {own!r} is {words}: is its unit right?", _read(test, {held: factor * place})
    yield f"where {own!r} has the other sign: which way is up?", _read(test, {held: -place})
    if test.scene.scales is not None:
        gauge = pressure - test.scene.scales.from_si("pressure", _AIR)
        yield (
            f"where {headers['pressure']!r} is less by that of the air, 101.325 kPa: are these absolute pressures?",
            _read(test, {"pressure": gauge}),
        )


def _read(test: Measured, changed: dict[str, Array]) -> LabTest:
    columns = {name: (changed.get(name, values)).tolist() for name, values in test.table.columns.items()}
    return LabTest(columns, scene=test.scene, kind="bulge", units="scaled")

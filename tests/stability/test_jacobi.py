"""The paper's tests of Legendre and Jacobi against the inertia of the second variation."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError
from femmembrane.solve.banded import negative_directions
from femmembrane.stability.jacobi import jacobi_test, legendre_test
from tests.cases import LIMIT_POINTS, POINTS, SCENES, Point, disc_scene


def negative(eq: fm.Equilibrium) -> int:
    """Negative directions under pressure control."""
    return negative_directions(eq.potential.evaluate(eq.state, eq.pressure).band, eq.potential.space.half_bandwidth)


@pytest.mark.parametrize("point", POINTS, ids=lambda p: p.name)
def test_corrected_form_counts_negative_directions(point: Point) -> None:
    eq = fm.equilibrium(point.scene, center_height=point.expected["center_height"])
    test = jacobi_test(eq)
    count = negative(eq)
    assert len(test.conjugate_points) == count == (point.expected["lambda_pressure"] < 0)
    assert test.conclusion == ("unstable" if count else "stable")
    assert legendre_test(eq).satisfied


@pytest.mark.parametrize("side", [0.995, 1.005])
@pytest.mark.parametrize("point", LIMIT_POINTS, ids=lambda p: p.name)
def test_both_sides_of_limit_points(point: Point, side: float) -> None:
    """The conjugate point enters through the rim exactly at the limit point."""
    eq = fm.equilibrium(point.scene, center_height=side * point.expected["center_height"])
    test = jacobi_test(eq)
    assert len(test.conjugate_points) == negative(eq)
    assert all(r > 0.9 for r in test.conjugate_points)


def test_both_sides_differ() -> None:
    """Of each pair in the test above one is stable and the other is not."""
    for point in LIMIT_POINTS:
        counts = {negative(fm.equilibrium(point.scene, center_height=side * point.expected["center_height"])) for side in (0.995, 1.005)}
        assert counts == {0, 1}


def test_printed_form_misses_the_limit_point() -> None:
    """On the falling part of P-V the energy falls in one direction, yet no conjugate point is found: with the pole pinned the mode that
    lifts it is not seen, and "stable" is wrong (pole height 1.5, lambda_pressure = -3.36 in data/disc.json)."""
    eq = fm.equilibrium(SCENES["neo_hookean_disc"], center_height=1.5)
    assert eq.verdict("pressure").stable is False
    printed = jacobi_test(eq, "printed")
    assert printed.conjugate_points.size == 0
    assert printed.conclusion == "stable"
    assert jacobi_test(eq, "corrected").conclusion == "unstable"


def test_printed_form_depends_on_where_it_starts() -> None:
    """P vanishes at the pole, where U = 0, U' = 1 therefore has no solution: the answer follows the radius at which integration starts.

    Past the volume fold above the membrane (pole height 4.9) a start at 1e-2 finds no conjugate point, one at 1e-4 does."""
    eq = fm.equilibrium(SCENES["dipole_above"], center_height=4.9)
    words = [jacobi_test(eq, "printed", start=start).conclusion for start in (1e-2, 1e-4)]
    assert words == ["stable", "unclear"]
    points = [jacobi_test(eq, start=start).conjugate_points for start in (1e-3, 1e-4, 1e-5)]
    # the corrected form converges at second order in the start
    assert float((points[0] - points[1])[0] / (points[1] - points[2])[0]) == pytest.approx(100, rel=0.1)
    np.testing.assert_allclose(points[1], points[2], rtol=1e-5)


def test_answer_does_not_depend_on_the_elements() -> None:
    """A state of degree 8 is used as it is; a coarser one of degree 2 is solved again first."""
    fine = fm.equilibrium(disc_scene(elements=16, degree=8), center_height=2.0)
    coarse = fm.equilibrium(disc_scene(elements=32), center_height=2.0)
    a, b = (jacobi_test(eq).conjugate_points for eq in (fine, coarse))
    np.testing.assert_allclose(a, b, rtol=1e-5)


def test_curve() -> None:
    """det U starts as r (rho column r, eta column 1) and ends at the rim."""
    test = jacobi_test(fm.equilibrium(SCENES["ogden_disc"], center_height=1.0))
    assert test.r[-1] == 1.0
    assert (np.diff(test.r) >= 0).all()
    first = test.r < 2e-3
    np.testing.assert_allclose(test.det[first], test.r[first], rtol=1e-3)
    assert (test.det > 0).all()


def test_legendre() -> None:
    """W_11 and W_1/lambda_1 at the natural state: 4 and 0, both halved; compression near a strong dipole is covered by the verdicts."""
    unloaded = fm.equilibrium(disc_scene(), pressure=0.0, solver="newton")
    flat = legendre_test(unloaded)
    assert not flat.satisfied
    assert flat.smallest_eigenvalue == 0
    test = legendre_test(fm.equilibrium(SCENES["ogden_disc"], center_height=1.0))
    assert test.satisfied
    assert test.smallest_determinant > 0
    assert 0 < test.where < 1
    assert jacobi_test(unloaded).conclusion == "short-wave unstable"


def test_refusals() -> None:
    eq = fm.equilibrium(disc_scene(elements=8), center_height=0.5)
    with pytest.raises(InputError, match="form"):
        jacobi_test(eq, "correct")
    with pytest.raises(InputError, match="start"):
        jacobi_test(eq, start=0.0)

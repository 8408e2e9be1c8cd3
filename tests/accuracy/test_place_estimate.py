"""Estimated errors of special points, against the same points on meshes with negligible errors."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from tests.cases import OGDEN, disc_scene

NEO = fm.NeoHookean()
WITH_WAVES = fm.Analysis(azimuthal_modes=(1,))

BRANCHES = {
    "disc": (disc_scene(OGDEN, (200, 6.5), elements=12, degree=2), {"start": 0.5, "until": {"center_height": 5.2}}),
    "balloon": (fm.Scene(material=NEO, mesh=fm.sphere(8), degree=2), {"start": 5.0, "until": {"volume": 20.0}}),
    "tube": (fm.Scene(material=OGDEN, mesh=fm.cylinder(4.0, 10, top="hub"), degree=2), {"start": 13.0, "until": {"volume": 60.0}}),
    "tipping": (
        disc_scene(OGDEN, (600, -3.5), elements=16, degree=2).replace(analysis=WITH_WAVES),
        {"start": 0.8, "until": {"center_height": 0.29}, "direction": -1},
    ),
}


@pytest.mark.parametrize("name", BRANCHES)
def test_true_errors(name):
    """Of P, V and height of every limit point, fold and onset: right in sign, and within a factor of two."""
    scene, how = BRANCHES[name]
    branch = fm.trace(scene, **how)
    finer = fm.trace(scene.replace(mesh=scene.mesh.refined(), degree=6), **how)
    points = [p for p in branch.special_points if p.kind != "branch_point"]
    assert points
    for point in points:
        alike = [p for p in finer.special_points if (p.kind, p.azimuthal) == (point.kind, point.azimuthal)]
        exact = min(alike, key=lambda p: abs(p.center_height - point.center_height))
        estimate = point.error_estimate()
        assert estimate.reason == ""
        for quantity in ("pressure", "volume", "center_height"):
            true = getattr(point, quantity) - getattr(exact, quantity)
            error = getattr(estimate, quantity).error
            assert error == pytest.approx(true, rel=0.6, abs=1e-7), (point.kind, quantity)


def test_what_has_no_estimate():
    scene = fm.Scene(material=OGDEN, mesh=fm.sphere(8), degree=4)
    branch = fm.trace(scene, start=5.0, until={"volume": 60.0})
    point = next(p for p in branch.special_points if p.kind == "branch_point")
    estimate = point.error_estimate()
    assert np.isnan(estimate.pressure.error)
    assert "a branch point is not located again" in str(estimate)
    assert estimate.pressure.value == point.pressure


def test_a_table():
    scene = disc_scene(NEO, elements=6, degree=2)
    text = str(fm.trace(scene, start=0.5, until={"center_height": 2.5}).special_points[0].error_estimate())
    assert "the point located again on elements of degree 3" in text
    assert "pole height" in text

"""Gaps of rigid bodies: signed distances with unit normals, curvatures of their lines of equal distance, and nearest points."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm

BODIES = {
    "plane": fm.Plane(0.5),
    "ball": fm.Ball(height=1.0, radius=0.3),
    "cylinder": fm.Cylinder(height=1.0, radius=0.5, length=0.4, rounding=0.05),
    "bottle": fm.Mould([(0.0, -1.0), (1.0, -1.0), (1.0, 1.0)], rounding=0.2, side="left"),
    "edge": fm.Mould([(0.0, 1.0), (1.0, 0.0), (2.0, 1.0)], side="right"),
}


@pytest.mark.parametrize("name", BODIES)
def test_derivatives_of_a_gap(name):
    """Central differences, away from the lines where the nearest piece changes."""
    body, rng, h = BODIES[name], np.random.default_rng(1), 1e-4
    rho, eta = rng.uniform(0.05, 0.9, 200), rng.uniform(-0.9, 0.4, 200)
    touch = body.touch(rho, eta)
    assert np.hypot(touch.n_rho, touch.n_eta) == pytest.approx(np.ones(200), abs=1e-14)
    slopes = [(body.gap(rho + a * h, eta + b * h) - body.gap(rho - a * h, eta - b * h)) / (2 * h) for a, b in ((1, 0), (0, 1))]
    t_rho, t_eta = -touch.n_eta * h, touch.n_rho * h
    bend = (body.gap(rho + t_rho, eta + t_eta) + body.gap(rho - t_rho, eta - t_eta) - 2 * touch.gap) / h**2
    smooth = np.abs(bend - touch.curvature) < 1e-2
    assert smooth.sum() > 180
    assert np.abs(slopes[0] - touch.n_rho)[smooth].max() < 1e-5
    assert np.abs(slopes[1] - touch.n_eta)[smooth].max() < 1e-5
    nearest = rho - touch.gap * touch.n_rho, eta - touch.gap * touch.n_eta
    assert np.abs(body.gap(*nearest)).max() < 1e-14


def test_a_gap_inside_a_body_is_negative():
    assert BODIES["ball"].gap(0.0, 1.1)[0] == pytest.approx(-0.2)
    assert BODIES["plane"].gap(0.3, 0.7)[0] == pytest.approx(-0.2)
    assert BODIES["cylinder"].gap(0.1, 0.85)[0] == pytest.approx(-0.05)


def test_a_magnet_with_a_body_is_a_cylinder_with_a_coating():
    magnet = fm.Magnet(height=1.0, radius=0.5, length=0.4, strength=0.1, body=True)
    assert magnet.obstacle.gap(0.0, 0.5)[0] == pytest.approx(0.28)
    assert fm.Magnet(height=1.0, radius=0.5, length=0.4, strength=0.1).obstacle is None
    with pytest.raises(fm.InputError, match=r"source\.body"):
        fm.Magnet(height=1.0, radius=0.5, length=0.4, strength=0.1, inner_radius=0.2, body=True)
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), sources=[magnet], susceptibility=1.0)
    assert fm.Scene.from_dict(scene.to_dict()) == scene
    assert scene.bodies == (magnet.obstacle,)

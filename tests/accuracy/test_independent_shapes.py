"""Three methods that share nothing but the formulas at a point agree on every smooth shape: elements, shooting, collocation."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.collocation import collocate
from femmembrane.accuracy.shooting import shoot, shoot_as_published
from femmembrane.accuracy.strong_form import Guess, StrongForm
from tests.cases import OGDEN

NEO = fm.NeoHookean()
FIELD = [fm.Dipole(10, 3.0)]

SCENES = {
    "annulus on a hub": (fm.Scene(material=OGDEN, mesh=fm.annulus(0.3, 12), sources=FIELD, susceptibility=1.0), {"volume": 0.8}),
    "stretched annulus": (fm.Scene(material=NEO, mesh=fm.annulus(0.3, 12, inner="clamped"), prestretch=1.2), {"volume": 1.0}),
    "annulus with a free edge": (fm.Scene(material=NEO, mesh=fm.annulus(0.4, 12, inner="free"), prestretch=1.3), {"pressure": 0.0}),
    "cap": (fm.Scene(material=OGDEN, mesh=fm.cap(0.6, 12), sources=FIELD, susceptibility=1.0), {"volume": 2.0}),
    "cap on a sliding ring": (
        fm.Scene(material=NEO, mesh=fm.cap(0.5, 24, rim="axial"), sources=[fm.Dipole(20, 3.0)], susceptibility=1.0),
        {"volume": 1.5},
    ),
    "bowl with a liquid": (fm.Scene(material=NEO, mesh=fm.cap(-0.4, 12), loads=[fm.Hydrostatic(0.6)]), {"volume": 1.5}),
    "cap with self-field": (
        fm.Scene(material=NEO, mesh=fm.cap(0.4, 12), sources=FIELD, susceptibility=1.0, demagnetization=True),
        {"volume": 1.5},
    ),
    "uneven cap": (fm.Scene(material=NEO, mesh=fm.cap(0.4, 16), thickness="1 - 0.3*R**2", modulus="1 + 0.2*Z"), {"volume": 1.5}),
    "uneven disc": (fm.Scene(material=NEO, mesh=fm.disc(16), thickness="1 - 0.4*R**2", sources=FIELD, susceptibility=1.0), {"volume": 1.5}),
    "sphere": (fm.Scene(material=OGDEN, mesh=fm.sphere(12)), {"volume": 6.0}),
    "sphere with a voltage": (fm.Scene(material=NEO, mesh=fm.sphere(12), electric=fm.Electric(voltage=0.3)), {"volume": 6.0}),
    "uneven sphere": (fm.Scene(material=OGDEN, mesh=fm.sphere(20), thickness="1 + 0.2*Z + 0.1*R**2"), {"volume": 7.0}),
    "tube": (fm.Scene(material=OGDEN, mesh=fm.cylinder(3.0, 12)), {"volume": 14.0}),
    "tube under a lid": (
        fm.Scene(material=OGDEN, mesh=fm.cylinder(3.0, 16, top="hub"), loads=[fm.HubForce(0.5, "first")]),
        {"volume": 14.0},
    ),
    "tube on a plate": (
        fm.Scene(material=OGDEN, mesh=fm.cylinder(2.0, 12, top="radial"), thickness="1 + 0.1*sin(s)"),
        {"volume": 8.0},
    ),
    "half a tube": (fm.Scene(material=OGDEN, mesh=fm.cylinder(2.0, 12, top="mirror")), {"volume": 8.0}),
    "torus": (fm.Scene(material=OGDEN, mesh=fm.torus(3.0, 24)), {"volume": 80.0}),
    "torus in a field": (
        fm.Scene(material=NEO, mesh=fm.torus(3.0, 48), sources=[fm.Uniform(1.0)], susceptibility=1.0, demagnetization=True),
        {"volume": 70.0},
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_three_methods_agree(name):
    scene, held = SCENES[name]
    elements = fm.equilibrium(scene.replace(degree=7), solver="newton", **held)
    guess = Guess.of(elements)
    found = [shoot(scene, guess=guess, **held), collocate(scene, guess=guess, tolerance=1e-9, **held)]
    s = np.linspace(*scene.mesh.breakpoints()[[0, -1]], 23)
    for one in found:
        assert one.converged, one.message
        for quantity in ("pressure", "volume", "center_height", "elastic_energy", "magnetic_energy"):
            assert getattr(one, quantity) == pytest.approx(getattr(elements, quantity), rel=1e-8, abs=1e-9), quantity
        mine, theirs = one.profile(s), elements.profile(s)
        for column in ("rho", "eta", "stretch_1", "stretch_2"):
            assert mine[column] == pytest.approx(theirs[column], abs=1e-5), column


def test_a_mesh_without_elements_enough_is_found_out():
    """The same comparison sees the error of four elements of degree 2: it can fail."""
    scene, held = SCENES["cap"]
    coarse = fm.equilibrium(scene.replace(mesh=fm.cap(0.6, 4), degree=2), solver="newton", **held)
    exact = shoot(scene, guess=Guess.of(coarse), **held)
    assert exact.converged
    assert 1e-5 < abs(coarse.pressure / exact.pressure - 1) < 1e-2
    assert coarse.error_estimate().pressure.error == pytest.approx(coarse.pressure - exact.pressure, rel=0.3)


def test_held_pole():
    """The height of a pole is prescribed on a cap; a sphere on which nothing acts along the axis has no such height."""
    scene, held = SCENES["cap"]
    at = fm.equilibrium(scene.replace(degree=7), solver="newton", **held)
    for method in (shoot, collocate):
        found = method(scene, guess=Guess.of(at), center_height=at.center_height)
        assert found.converged
        assert found.pressure == pytest.approx(at.pressure, rel=1e-7)
    sphere = SCENES["sphere"][0]
    guess = Guess.of(fm.equilibrium(sphere, volume=6.0))
    with pytest.raises(fm.InputError, match=r"center_height = 1\.0: nothing holds this membrane along the axis"):
        shoot(sphere, guess=guess, center_height=1.0)
    tube = SCENES["tube"][0]
    with pytest.raises(fm.InputError, match="first end of this meridian is held"):
        shoot(tube, guess=Guess.of(fm.equilibrium(tube, volume=14.0)), center_height=1.0)


def test_what_has_kinks_is_refused():
    points = [(0.0, 0.5), (0.5, 0.4), (1.0, 0.0)]
    with pytest.raises(fm.InputError, match=r"mesh.shape = .*kinks"):
        StrongForm(fm.Scene(material=NEO, mesh=fm.meridian_from_points(points)))
    with pytest.raises(fm.InputError, match=r"membrane.thickness = .*kinks and jumps"):
        StrongForm(fm.Scene(material=NEO, mesh=fm.disc(8), thickness=[(0.0, 1.0), (0.5, 1.0), (1.0, 0.6)]))
    scene, held = SCENES["cap"]
    with pytest.raises(fm.InputError, match=r"mesh.shape = .*the disc is allowed"):
        shoot_as_published(scene, guess=Guess(1.0, 0.7, 1.1), **held)

"""Shooting, collocation and finite elements share the formulas of material and sources and nothing else: they find the same equilibria.

At every listed point of the reference tables (tests/data/README.md), at its height of the pole: pressure, volume and both energies.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.collocation import collocate
from femmembrane.accuracy.shooting import shoot, shoot_as_published
from femmembrane.accuracy.strong_form import Guess

from ..cases import POINTS

QUANTITIES = ("pressure", "volume", "elastic_energy", "magnetic_energy")
METHODS = ("newton shooting", "collocation", "finite elements")

#: next to the dipole the *tables* are less accurate than the methods: these three agree with each other to 1e-9 (tested below), and the
#: spectral reference differs from all of them alike, by so much in the worst quantity (recorded on 2026-11-24)
REFERENCE_MISSES = {"dipole_above-4.7": 2.4e-8, "dipole_above-4.9": 1.8e-6, "dipole_above-5": 1.8e-5}
#: and there 16 elements of degree 8 are a little coarse for the tip (2.6e-7 recorded on 2026-11-24; 32 of them leave 1.4e-9)
ELEMENTS_MISS = {"dipole_above-5": 4e-7}


@cache
def solutions(point):
    height = point.expected["center_height"]
    guess = Guess.of(_finite_elements(point, 8, 6))
    return {
        "newton shooting": shoot(point.scene, guess=guess, center_height=height),
        "collocation": collocate(point.scene, guess=guess, center_height=height, tolerance=1e-9),
        "finite elements": _finite_elements(point, 16, 8),
    }


def _finite_elements(point, elements, degree):
    scene = point.scene.replace(mesh=fm.disc(elements=elements), degree=degree)
    start = fm.equilibrium(scene, volume=min(point.expected["volume"], 75.0), solver="newton")
    return fm.equilibrium(scene, center_height=point.expected["center_height"], start=start)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("point", POINTS, ids=lambda p: p.name)
def test_reference(point, method):
    found = solutions(point)[method]
    tolerance = REFERENCE_MISSES.get(point.name, 1e-8)
    for quantity in QUANTITIES:
        expected = point.expected.get(quantity, 0.0) if point.scene.sources or quantity != "magnetic_energy" else 0.0
        assert getattr(found, quantity) == pytest.approx(expected, rel=tolerance, abs=0), quantity


@pytest.mark.parametrize("point", POINTS, ids=lambda p: p.name)
def test_methods_agree_with_each_other(point):
    """To 1e-10 for the two that solve the strong form: also where the tables are less accurate."""
    shot, collocated, elements = (solutions(point)[m] for m in METHODS)
    assert shot.converged
    assert collocated.converged
    for quantity in QUANTITIES:
        assert getattr(shot, quantity) == pytest.approx(getattr(collocated, quantity), rel=1e-10), quantity
        assert getattr(elements, quantity) == pytest.approx(getattr(collocated, quantity), rel=ELEMENTS_MISS.get(point.name, 1e-8)), (
            quantity
        )


@pytest.mark.parametrize("point", [p for p in POINTS if p.name not in REFERENCE_MISSES], ids=lambda p: p.name)
@pytest.mark.parametrize("method", ["newton shooting", "collocation"])
def test_profile(point, method):
    expected = point.profile
    profile = solutions(point)[method].profile(expected["r"])
    for name in ("rho", "eta", "stretch_1", "stretch_2"):
        # relative to the size of the membrane or the stretch; the tables list twelve digits
        assert np.abs(profile[name] - expected[name]).max() < 1e-9 * np.abs(expected[name]).max(), name


@pytest.mark.parametrize("control", ["volume", "pressure"])
@pytest.mark.parametrize("method", [shoot, collocate])
@pytest.mark.parametrize("name", ["dipole_above-4", "dipole_below-2"])
def test_other_controls(name, method, control):
    """A volume or a pressure prescribed in place of the height, from a coarse guess."""
    point = next(p for p in POINTS if p.name == name)
    found = method(point.scene, guess=Guess.of(_finite_elements(point, 8, 2)), **{control: point.expected[control]}, tolerance=1e-9)
    assert found.converged
    for quantity in (*QUANTITIES, "center_height"):
        assert getattr(found, quantity) == pytest.approx(point.expected[quantity], rel=1e-7), quantity


@pytest.mark.parametrize(("name", "tolerance"), [("neo_hookean_disc-2", 1e-6), ("dipole_above-0.5", 1e-5)])
def test_the_paper_s_method(name, tolerance):
    """From 2 per cent beside the solution to its own tolerance: of the rim's position, which P and V share up to a factor of ten."""
    point = next(p for p in POINTS if p.name == name)
    near = Guess.of(solutions(point)["finite elements"])
    guess = Guess(1.02 * near.pressure, near.center_height, 0.98 * near.stretch)
    found = shoot_as_published(point.scene, guess=guess, center_height=point.expected["center_height"], tolerance=tolerance)
    assert found.converged
    assert found.residual <= tolerance
    for quantity in ("pressure", "volume", "elastic_energy"):
        assert getattr(found, quantity) == pytest.approx(point.expected[quantity], rel=10 * tolerance), quantity

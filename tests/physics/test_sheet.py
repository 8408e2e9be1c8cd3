"""Uneven sheets: thickness and modulus along the meridian, against an independent shooting solver and laws of scale."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.shooting import Guess, shoot
from femmembrane.physics.along import Along
from femmembrane.potential import potential_of
from femmembrane.stability.azimuthal_operator import azimuthal_operator
from tests.cases import effect

PLAIN = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), degree=6)
STEPPED = [(0.0, 1.0), (0.53, 1.0), (0.53, 2.0), (1.0, 1.5)]


@pytest.mark.parametrize("point", effect("thickness_1-0.4r2_neo"), ids=lambda p: f"height {p['center_height']:.1f}")
@pytest.mark.parametrize("thickness", ["1 - 0.4*R**2", "1 - 0.4*r**2", lambda R, Z, s: 1 - 0.4 * s**2], ids=["R", "r", "function"])
def test_reference(point, thickness):
    """Shooting by others (data/effects.json), to its digits and those of the mesh."""
    eq = fm.equilibrium(PLAIN.replace(thickness=thickness), center_height=point["center_height"])
    for quantity in ("pressure", "volume", "energy"):
        assert getattr(eq, quantity) == pytest.approx(point[quantity], rel=5e-11), quantity


@pytest.mark.parametrize("name", ["thickness", "modulus"])
def test_twice_as_much_everywhere(name):
    """P and energies double at the same shape; frequencies stay where the mass doubles too, and grow by the root of 2 where it does not."""
    one, two = (fm.equilibrium(scene, center_height=0.6) for scene in (PLAIN, PLAIN.replace(**{name: 2.0})))
    assert two.pressure == pytest.approx(2 * one.pressure, rel=1e-12)
    assert two.energy == pytest.approx(2 * one.energy, rel=1e-12)
    assert two.volume == pytest.approx(one.volume, rel=1e-12)
    grown = 1.0 if name == "thickness" else 2.0
    for n in (0, 1, 2):
        before, after = (np.array([mode.eigenvalue for mode in eq.frequencies(azimuthal=n)]) for eq in (one, two))
        assert after == pytest.approx(grown * before, rel=1e-9)
    stresses = [eq.profile()["mechanical_stress_1"] for eq in (one, two)]
    assert stresses[1] == pytest.approx(grown * stresses[0], rel=1e-9)


def test_weight_and_magnetic_energy_go_with_the_thickness():
    surroundings = {"sources": [fm.Dipole(strength=200, height=6.5)], "susceptibility": 2.5, "loads": [fm.Weight(weight=0.3)]}
    one = fm.equilibrium(PLAIN.replace(**surroundings), center_height=0.6)
    two = fm.equilibrium(PLAIN.replace(**surroundings, thickness=2.0), center_height=0.6)
    assert (two.pressure, two.magnetic_energy, two.load_energy) == pytest.approx(
        (2 * one.pressure, 2 * one.magnetic_energy, 2 * one.load_energy), rel=1e-11
    )


def test_elements_end_at_a_jump():
    """With a jump inside an element the order would be lost: 8 elements of degree 6 have ten digits, wherever the jump is."""
    coarse, fine = (fm.equilibrium(PLAIN.replace(mesh=fm.disc(n), thickness=STEPPED), center_height=0.7) for n in (8, 40))
    assert 0.53 in potential_of(coarse.scene).space.ends
    assert coarse.pressure == pytest.approx(fine.pressure, rel=1e-9)
    assert coarse.verdict("volume").smallest_eigenvalue == pytest.approx(fine.verdict("volume").smallest_eigenvalue, rel=1e-6)
    inside = PLAIN.replace(mesh=fm.disc(8), thickness=lambda R, Z, s: np.where(R < 0.53, 1.0, 2 - (R - 0.53) / 0.94))
    smeared = fm.equilibrium(inside, center_height=0.7)
    assert abs(smeared.pressure - fine.pressure) > 1e3 * abs(coarse.pressure - fine.pressure)


def test_the_waves_of_an_uneven_sphere():
    """At n = 0 waves and verdict have one operator; at n = 1 the material of a sphere with a thick pole cannot move at no cost."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.sphere(16), degree=4, thickness="1 + 0.3*R**2 - 0.2*Z")
    eq = fm.equilibrium(scene, volume=6.0)
    potential = potential_of(scene)
    none = azimuthal_operator(potential, eq.state, eq.pressure, 0).band
    assert none == pytest.approx(potential.evaluate(eq.state, eq.pressure).band, abs=1e-9)
    assert azimuthal_operator(potential, eq.state, eq.pressure, 1).spin is None
    assert eq.verdict(azimuthal=1).stable


def test_an_even_sheet_costs_nothing():
    """Nothing of it is built: as many operations at a point, and no column of data."""
    assert potential_of(PLAIN.replace(thickness=1.0)) is potential_of(PLAIN)
    assert potential_of(PLAIN).sheet is None
    assert "membrane.thickness" not in str(PLAIN.to_dict())
    uneven = potential_of(PLAIN.replace(thickness="1 - 0.4*R**2"))
    assert uneven.point_data.shape[0] == potential_of(PLAIN).point_data.shape[0] + 1


@pytest.mark.parametrize("given", ["1 - 0.4*R**2", STEPPED, 0.5], ids=["expression", "table", "number"])
def test_files_say_the_same(given):
    scene = PLAIN.replace(thickness=given, modulus=given)
    assert fm.Scene.from_dict(scene.to_dict()) == scene
    assert pickle.loads(pickle.dumps(scene)) == scene


def test_a_function_has_no_name_in_files():
    with pytest.raises(fm.InputError, match=r"membrane\.thickness.*no name in scene files"):
        PLAIN.replace(thickness=lambda R, Z, s: 1 + R).to_dict()


BAD = {
    "1 - 2*R": "at s = 0.5 it is 0",
    "cosh(R)": "cosh is not known; known: R",
    "q": "q is not known",
    "R.real": "a number, an expression",
    "1 +": "a number, an expression",
    "__import__('os')": "a number, an expression|__import__ is not known",
    "9**9**9**9": "it is no number",
    "R" * 600: "up to 500 characters",
    ((0, 1),): "two or more pairs",
    ((0, 1), (1, -1)): "a factor > 0",
    ((0.5, 1), (0, 1)): "places increase",
    ((0, 1), (1, "a")): r"a pair \(s, factor\) of finite",
    True: "a number, an expression",
    0.0: "a factor > 0",
    float("nan"): "a number, an expression",
}


@pytest.mark.parametrize("given", BAD, ids=str)
def test_refused(given):
    with pytest.raises(fm.InputError, match=rf"membrane\.thickness.*(?:{BAD[given]})"):
        PLAIN.replace(thickness=given)


def test_a_stranger_s_function_may_fail():
    def fails(R, Z, s):
        raise RuntimeError("not today")

    with pytest.raises(fm.InputError, match=r"must answer arrays .*not today"):
        PLAIN.replace(modulus=fails)


def test_shooting_refuses():
    """Kinks end the strong form; smooth sheets have it (three methods agree on them)."""
    with pytest.raises(fm.InputError, match=r"membrane.thickness = .*kinks and jumps"):
        shoot(PLAIN.replace(thickness=STEPPED), guess=Guess(1.0, 0.5, 1.2), center_height=0.5)


def test_a_factor_is_asked_beyond_a_jump_on_its_right():
    factor = Along.of("membrane.thickness", STEPPED)
    s = np.array([0.0, 0.52, 0.53, 1.0])
    assert factor.at(s, 0 * s, s) == pytest.approx([1, 1, 2, 1.5])
    assert factor.ends == (0.53,)

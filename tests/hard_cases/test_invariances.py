"""The invariances of :mod:`.invariance` as properties: for any scene of a kind, not for one."""

from __future__ import annotations

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

import femmembrane as fm

from ..cases import OGDEN, disc_scene
from .invariance import deviation, from_files

FEW = settings(max_examples=8, derandomize=True, deadline=None, database=None)

strengths = st.floats(1.0, 300.0)
heights = st.floats(5.5, 9.0)
volumes = st.floats(0.6, 20.0)
materials = st.sampled_from([OGDEN, fm.NeoHookean()])
fractions = st.floats(0.01, 0.99)


def state(scene: fm.Scene, volume: float) -> fm.Equilibrium:
    return fm.equilibrium(scene, volume=volume, solver="newton")


@given(strengths, heights, volumes, materials)
@FEW
def test_mirror(strength, height, volume, material):
    """z -> -z: eta, h, V and P change sign, nothing else; verdicts do not change."""
    here, there = (state(disc_scene(material, dipole=(strength, s * height), elements=6), s * volume) for s in (1, -1))
    assert deviation(here, there, -1) < 1e-9
    for control in ("pressure", "volume"):
        one, other = (eq.verdict(control).smallest_eigenvalue for eq in (here, there))
        assert other == pytest.approx(one, rel=1e-7, abs=1e-9)


@given(strengths, heights, volumes, fractions)
@FEW
def test_a_source_split_in_two(strength, height, volume, fraction):
    """Fields add: sqrt(m1) + sqrt(m2) = sqrt(M)."""
    whole = disc_scene(dipole=(strength, height), elements=6)
    parts = [fm.Dipole(f**2 * strength, height) for f in (fraction, 1 - fraction)]
    assert deviation(state(whole, volume), state(whole.replace(sources=parts), volume)) < 1e-9


@given(strengths, heights, st.floats(-9.0, -5.5), volumes)
@FEW
def test_a_source_of_no_strength(strength, height, other, volume):
    plain = disc_scene(dipole=(strength, height), elements=6)
    more = plain.replace(sources=[fm.Dipole(0.0, other), *plain.sources])
    assert deviation(state(plain, volume), state(more, volume)) < 1e-9


@given(st.floats(1e-7, 1e2), st.floats(1e-5, 1e-1), st.floats(1e2, 1e10), volumes)
@FEW
def test_units(radius, slenderness, modulus, volume):
    """Scales change no bit, and to_si and from_si undo each other."""
    scales = fm.Scales(radius=radius, thickness=slenderness * radius, shear_modulus=modulus)
    plain = disc_scene(elements=6)
    one, other = state(plain, volume), state(plain.replace(scales=scales), volume)
    assert (one.pressure, one.volume, one.energy) == (other.pressure, other.volume, other.energy)
    assert np.array_equal(one.state, other.state)
    for quantity in ("length", "volume", "pressure", "stress", "energy", "dipole_strength"):
        assert scales.from_si(quantity, scales.to_si(quantity, volume)) == pytest.approx(volume, rel=4e-16 * 4)


@given(volumes, st.integers(1, 6), st.integers(1, 4), materials)
@FEW
def test_bisection_never_raises_the_minimum(volume, elements, degree, material):
    """The spaces are nested; quadrature is exact to far less than the gain, or both are at round-off."""
    coarse, fine = (state(disc_scene(material, elements=n, degree=degree), volume).energy for n in (2 * elements, 4 * elements))
    assert fine <= coarse + 1e-9 * coarse


@given(st.floats(1.0, 3.0), st.floats(0.1, 1.0), st.integers(0, 2**32 - 1))
@FEW
def test_the_order_of_a_mesh_file(volume, height, seed):
    """Nodes and cells of a cap in any order, to the last bit."""
    assert from_files(fm.cap(height, 6), volume, "order", seed) == 0


@given(volumes, st.lists(volumes, min_size=1, max_size=3))
@FEW
def test_there_and_back(volume, others):
    """The flat-topped part of the branch below the first fold in volume is one branch, whatever the way along it."""
    run = fm.inflate(disc_scene(dipole=(200.0, 6.5), elements=6), volumes=[volume, *others, volume], solver="newton")
    assert deviation(run[0], run[-1]) < 1e-9

"""Remarks on a membrane inside a source."""

from __future__ import annotations

import femmembrane as fm


def coiled(**coil: float) -> fm.Scene:
    coil = {"strength": 1e-6, "height": 0.8, "radius": 0.7, "length": 0.4} | coil
    return fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), sources=[fm.Solenoid(**coil)], susceptibility=0.1)


def test_a_membrane_in_the_bore_of_a_solenoid_is_remarked_upon():
    branch = fm.inflate(coiled(), volumes=[0.3, 1.2])
    profile = branch[1].profile()
    inside = int(((profile["rho"] <= 0.7) & (abs(profile["eta"] - 0.8) <= 0.2)).sum())
    assert inside > 1
    (note,) = branch.notes
    assert note.startswith(f"the membrane is inside source 0, a solenoid, in 1 of 2 equilibria, with {inside} nodes in step 1")
    assert note in str(branch)


def test_a_solenoid_above_the_membrane_has_no_remark():
    assert fm.inflate(coiled(height=3.0), volumes=[0.3, 1.2]).notes == ()

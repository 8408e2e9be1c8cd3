"""A remark on loads that were most likely meant in other units."""

from __future__ import annotations

import dataclasses

import pytest

import femmembrane as fm
from femmembrane.scene.absurd_loads import remarks_on_direction, remarks_on_loads, remarks_on_scales

#: mu T/R0 = 1360 Pa, as R0 = 5 cm, T = 50 um, mu = 1.36 MPa
SCALES = fm.Scales(radius=0.05, thickness=5e-5, shear_modulus=1.36e6)


def scene(mesh=None, **run):
    return fm.Scene(fm.NeoHookean(), mesh=mesh or fm.disc(4), run=fm.Run(**run), scales=SCALES)


def test_a_pressure_meant_in_pascals():
    (remark,) = remarks_on_loads(scene(control="pressure", start=0.1, stop=5000, steps=3))
    assert remark.startswith("run.stop = 5000 is P = 5000, that is 6.8 MPa: over 100 times the modulus times the thickness over the size")
    assert remark.endswith('if the number is meant in SI units, give the scene file units = "si"')
    bare = scene(control="pressure", start=0.1, stop=5000, steps=3).replace(scales=None)
    (remark,) = remarks_on_loads(bare)
    assert "MPa" not in remark
    assert remark.endswith('units = "si" and [scales]')


@pytest.mark.parametrize(
    ("run", "key"),
    [
        ({"control": "pressure", "values": [0.1, -101.0, 1.0]}, "run.values = -101"),
        ({"control": "volume", "start": 1.0, "stop": 2e6, "steps": 2}, "run.stop = 2e+06 is V = 2e+06, that is 250 m³"),
        ({"control": "height", "start": 101.0, "stop": 1.0, "steps": 2}, "run.start = 101 is pole height = 101, that is 5.05 m"),
        ({"control": "arc-length", "start": 1.0, "until": {"pressure": 300}}, "run.until = 300 is P = 300, that is 408 kPa"),
    ],
)
def test_every_load_of_a_run_is_looked_at(run, key):
    (remark,) = remarks_on_loads(scene(**run))
    assert remark.startswith(key)


@pytest.mark.parametrize(
    "run",
    [
        {"control": "pressure", "values": [99.0]},
        {"control": "volume", "values": [9e5]},
        {"control": "height", "values": [-99.0]},
        {"control": "arc-length", "start": 1.0, "until": {"center_height": 50}},
    ],
)
def test_large_loads_are_not_remarkable(run):
    assert remarks_on_loads(scene(**run)) == ()


def test_size_and_sheet_count_and_the_unit_of_length_does_not():
    """A sphere of a mesh file in millimetres, R = 20: P over mu T/R0 is 1/20 of that of a unit sphere, V is 8000 times as large."""
    points = [(20 * r, 20 * z) for r, z in zip(*fm.sphere(elements=16).position(fm.sphere(elements=16).breakpoints()), strict=True)]
    large = fm.meridian_from_points(points)
    assert len(remarks_on_loads(scene(large, control="pressure", values=[5.1]))) == 1
    assert remarks_on_loads(scene(large, control="pressure", values=[4.9])) == ()
    assert remarks_on_loads(scene(large, control="volume", values=[7e9])) == ()
    stiff = scene(control="pressure", values=[150.0]).replace(modulus=2.0)
    assert remarks_on_loads(stiff) == ()
    assert len(remarks_on_loads(stiff.replace(thickness="1 - 0.5*R"))) == 0  # thick at the pole
    assert len(remarks_on_loads(stiff.replace(modulus=1.0))) == 1


def test_the_branch_says_so():
    branch = fm.pressurize(fm.Scene(fm.NeoHookean(), mesh=fm.disc(4)), pressures=[0.5])
    assert branch.notes == ()
    asked = scene(control="pressure", start=0.5, stop=5000, steps=2)
    (note,) = dataclasses.replace(branch, scene=asked).notes
    assert note == remarks_on_loads(asked)[0]
    assert note in str(dataclasses.replace(branch, scene=asked))


@pytest.mark.parametrize(
    ("scales", "said"),
    [
        ((25.0, 3e-7, 4e5), "scales.thickness = 3e-07 m is 1.2e-08 times the radius, 25 m"),
        ((0.025, 0.3, 4e5), "scales.thickness = 0.3 m is 12 times the radius, 0.025 m"),
        ((2.5e4, 0.3, 4e5), "scales.radius = 25000 m"),
        ((0.025, 3e-4, 0.4), "scales.shear_modulus = 0.4 Pa"),
    ],
)
def test_scales_meant_in_other_units(scales, said):
    (remark,) = remarks_on_scales(fm.Scales(*scales))
    assert remark.startswith(said)
    assert '"25 mm" and "0.4 MPa" are understood too' in remark


def test_scales_of_cells_and_balloons_are_not_remarkable():
    for radius, thickness, modulus in ((5e-6, 5e-9, 1e3), (20.0, 2e-5, 1e8), (0.05, 5e-5, 1.36e6), (0.01, 5e-3, 1e4)):
        assert remarks_on_scales(fm.Scales(radius, thickness, modulus)) == ()
    assert remarks_on_scales(None) == ()


def test_a_branch_that_sets_out_away_from_its_end_is_remarked_before_it_is_followed():
    (remark,) = remarks_on_direction(scene(control="arc-length", start=5.0, until={"volume": 1.0}))
    assert remark == "run.direction = 1: it sets out from V = 5, away from run.until.volume = 1; -1 sets out the other way"
    for run in (
        {"start": 5.0, "until": {"volume": 1.0}, "direction": -1},
        {"start": 1.0, "until": {"volume": 5.0}},
        {"start": 5.0, "until": {"center_height": 1.0}},  # which turns back
    ):
        assert remarks_on_direction(scene(control="arc-length", **run)) == ()

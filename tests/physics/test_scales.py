"""Physical scales: conversions by hand and there and back, what a scene makes of them, and what it writes in Pa."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.constants import mu_0

import femmembrane as fm
from femmembrane import cli
from femmembrane.errors import InputError
from femmembrane.physics.scales import SQUARED
from femmembrane.potential import potential_of
from femmembrane.quantities import SI_UNITS, caption, written
from femmembrane.results import table
from femmembrane.scene.variation import Parameter
from femmembrane.views import picture
from tests.cases import OGDEN, disc_scene

#: R0 = 5 cm, T = 50 um, mu = 0.4 MPa: R0/T = 1000, mu T/R0 = 400 Pa, R0^3 = 1.25e-4 m^3, mu T R0^2 = 0.05 J
TABLE = {"radius": 0.05, "thickness": 5e-5, "shear_modulus": 4e5}
RUBBER = fm.Scales(**TABLE)
#: with mu0 = 4e-7 pi (true to 1e-9): M = 1e-7 m^2/(4 pi R0^6 mu) = 1e-7 144/(4 pi 6.25e-3) for m = 12 A m^2
MOMENT, STRENGTH = 12.0, 1.8334649444186344e-4
MAGNET = fm.Scales(**TABLE, dipole_moment=MOMENT)
LINEAR = sorted(SI_UNITS.keys() - set(SQUARED))


# --- conversions


@pytest.mark.parametrize(
    ("quantity", "si", "unit"),
    [
        ("length", 0.05, "m"),
        ("volume", 1.25e-4, "m^3"),
        ("pressure", 400.0, "Pa"),
        ("stress", 4e5, "Pa"),
        ("energy", 0.05, "J"),
        ("force", 1.0, "N"),
        ("area", 2.5e-3, "m^2"),
        ("remanence", math.sqrt(mu_0 * 4e5), "T"),
        ("magnetization", math.sqrt(4e5 / mu_0), "A/m"),
    ],
)
def test_units_by_hand(quantity, si, unit):
    assert RUBBER.to_si(quantity, 3.0) == pytest.approx(3 * si, rel=1e-14)
    assert RUBBER.from_si(quantity, -3 * si) == pytest.approx(-3.0, rel=1e-14)
    assert RUBBER.units(quantity) == unit


def test_strength_by_hand():
    assert MAGNET.strength == pytest.approx(STRENGTH, rel=1e-9)
    assert MAGNET.from_si("dipole_strength", [0.0, 12.0, 24.0]) == pytest.approx([0.0, STRENGTH, 4 * STRENGTH], rel=1e-9)
    # M = 200: m^2 = 200 4 pi 6.25e-3/1e-7 = 1e8 pi/2
    assert RUBBER.to_si("dipole_strength", 200) == pytest.approx(1e4 * math.sqrt(math.pi / 2), rel=1e-9)
    assert RUBBER.units("dipole_strength") == "A m^2"
    assert RUBBER.radius_to_thickness == pytest.approx(1000, rel=1e-15)


@pytest.mark.parametrize("height", [0.8, -6.5])
def test_strength_gives_the_field_of_the_moment(height):
    """On its axis, a distance d away, a moment m has the field H = 2 m/(4 pi d^3), and |h|^2 = mu0 H^2/mu."""
    field = 2 * MOMENT / (4 * math.pi * (abs(height) * 0.05) ** 3)
    assert fm.Dipole(MAGNET.strength, height).intensity(0.0, 0.0) == pytest.approx(mu_0 * field**2 / 4e5, rel=1e-13)


def test_energy_is_pressure_times_volume_and_stress_times_volume_of_material():
    assert RUBBER.to_si("pressure", 1.0) * RUBBER.to_si("volume", 1.0) == pytest.approx(RUBBER.to_si("energy", 1.0), rel=1e-14)
    assert RUBBER.to_si("stress", 1.0) * 0.05**2 * 5e-5 == pytest.approx(RUBBER.to_si("energy", 1.0), rel=1e-14)


decades = st.tuples(st.floats(1, 10), st.integers(-9, 9)).map(lambda pair: pair[0] * 10.0 ** pair[1])
any_scales = st.builds(fm.Scales, radius=decades, thickness=decades, shear_modulus=decades)


@settings(deadline=None)
@given(scales=any_scales, quantity=st.sampled_from(LINEAR), value=decades, sign=st.sampled_from([1, -1]))
def test_there_and_back(scales, quantity, value, sign):
    assert scales.from_si(quantity, scales.to_si(quantity, sign * value)) == pytest.approx(sign * value, rel=1e-15)
    assert scales.to_si(quantity, scales.from_si(quantity, sign * value)) == pytest.approx(sign * value, rel=1e-15)


@given(scales=any_scales, value=decades)
def test_strength_and_moment_there_and_back(scales, value):
    assert scales.from_si("dipole_strength", scales.to_si("dipole_strength", value)) == pytest.approx(value, rel=2e-15)
    assert scales.to_si("dipole_strength", scales.from_si("dipole_strength", value)) == pytest.approx(value, rel=2e-15)


@given(scales=any_scales, factor=decades, moment=decades)
def test_a_strength_is_the_square_of_the_moment(scales, factor, moment):
    one, other = (scales.from_si("dipole_strength", m) for m in (moment, factor * moment))
    assert other == pytest.approx(factor**2 * one, rel=2e-15)


def test_arrays_and_numbers():
    values = np.array([[1, 2], [3, 4]])
    np.testing.assert_allclose(RUBBER.to_si("pressure", values), 400.0 * values, rtol=1e-15)
    np.testing.assert_allclose(RUBBER.from_si("stress", [4e5, -2e5]), [1.0, -0.5], rtol=1e-15)
    for value in (2, 2.0, np.float32(2), np.array(2.0)):
        assert type(RUBBER.to_si("pressure", value)) is float
    assert math.isnan(RUBBER.to_si("stress", math.nan))


def test_scales_are_plain_numbers():
    scales = fm.Scales(1, np.float32(0.5), np.int64(2), dipole_moment=3)
    assert (scales.radius, scales.thickness, scales.shear_modulus, scales.dipole_moment) == (1.0, 0.5, 2.0, 3.0)
    assert all(type(v) is float for v in (scales.radius, scales.thickness, scales.shear_modulus, scales.dipole_moment))
    assert hash(scales) == hash(fm.Scales(1.0, 0.5, 2.0, 3.0))


@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf, True, np.True_, "0.05", 10**400, [1.0], 1j])
@pytest.mark.parametrize("name", ["radius", "thickness", "shear_modulus", "dipole_moment"])
def test_refused_numbers(name, value):
    with pytest.raises(InputError, match="a finite number > 0 is allowed") as caught:
        fm.Scales(**{**TABLE, name: value})
    assert caught.value.key == f"scales.{name}"


@pytest.mark.parametrize("name", ["radius", "thickness", "shear_modulus"])
def test_none_is_no_scale(name):
    with pytest.raises(InputError, match=rf"scales\.{name} = None"):
        fm.Scales(**{**TABLE, name: None})


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"radius": 1e150}, "volume"),
        ({"radius": 1e-120}, "volume"),
        ({"thickness": 1e-300, "shear_modulus": 1e-30}, "pressure|energy"),
        ({"radius": 1e50, "thickness": 1e-270, "shear_modulus": 1e200}, "radius over thickness"),
        ({"dipole_moment": 1e200}, "strength of dipole_moment"),
        ({"dipole_moment": 1e-200}, "strength of dipole_moment"),
    ],
)
def test_units_beyond_floats_are_refused(change, what):
    with pytest.raises(InputError, match=rf"scales = Scales.*({what}).* would be (0|inf)"):
        fm.Scales(**{**TABLE, **change})


@pytest.mark.parametrize("convert", [RUBBER.to_si, RUBBER.from_si])
def test_refused_values(convert):
    with pytest.raises(InputError, match=r"quantity = 'presure'.*did you mean 'pressure'"):
        convert("presure", 1.0)
    with pytest.raises(InputError, match="quantity = 3: unknown"):
        convert(3, 1.0)
    for value in ("1", None, True, [True], [1.0, "2"], [[1.0], [2.0, 3.0]], 1j):
        with pytest.raises(InputError, match=r"value = .*a number or an array of numbers"):
            convert("pressure", value)
    for value in (-1.0, [1.0, -1.0], math.nan):
        with pytest.raises(InputError, match=r"value = .*>= 0 is allowed.*orientation"):
            convert("dipole_strength", value)


def test_refused_unit():
    with pytest.raises(InputError, match=r"quantity = 'lenght'.*did you mean 'length'"):
        RUBBER.units("lenght")
    with pytest.raises(InputError, match=r"scales\.dipole_moment = None"):
        RUBBER.strength  # noqa: B018


# --- scenes

PLAIN = fm.Scene(fm.NeoHookean(), mesh=fm.disc(8))
MAGNETIC = PLAIN.replace(sources=[fm.Dipole(MAGNET.strength, 6.5)], susceptibility=2.5)


def tables(*sources, ratio=None, **more):
    """A scene file with scales, whose keys ``more`` adds to."""
    membrane = {"susceptibility": 2.5, **({} if ratio is None else {"radius_to_thickness": ratio})}
    found = [{"kind": "dipole", "height": 6.5, **source} for source in sources]
    return {"material": {"model": "neo-hookean"}, "membrane": membrane, "source": found, "scales": {**TABLE, **more}}


def test_scene_without_scales_is_as_it_was():
    assert PLAIN.scales is None
    assert PLAIN.radius_to_thickness == 1000.0
    assert fm.Scene(fm.NeoHookean(), mesh=fm.disc(8), radius_to_thickness=1000) == PLAIN
    assert "scales" not in PLAIN.to_dict()
    assert PLAIN.to_dict()["membrane"] == {"radius_to_thickness": 1000.0}


def test_ratio_follows():
    thick = fm.Scales(radius=0.05, thickness=1e-3, shear_modulus=4e5)
    scene = fm.Scene(fm.NeoHookean(), scales=thick)
    assert type(scene.radius_to_thickness) is float
    assert scene.radius_to_thickness == pytest.approx(50, rel=1e-15)
    assert scene.to_dict()["scales"] == {"radius": 0.05, "thickness": 1e-3, "shear_modulus": 4e5}
    assert "membrane" not in scene.to_dict()
    # in agreement there is one ratio, to the last bit
    assert fm.Scene(fm.NeoHookean(), scales=thick, radius_to_thickness=50 * (1 + 5e-10)) == scene


@pytest.mark.parametrize("ratio", [500, 1000 * (1 + 2e-9), 1000 * (1 - 2e-9)])
def test_a_ratio_that_contradicts_is_refused(ratio):
    with pytest.raises(InputError, match=r"scales\.radius / scales\.thickness = 1000; leave radius_to_thickness out") as caught:
        fm.Scene.from_dict(tables(ratio=ratio))
    assert (caught.value.key, caught.value.value) == ("membrane.radius_to_thickness", ratio)


@pytest.mark.parametrize("ratio", [0, True, "1000"])
def test_a_ratio_is_a_number_with_scales_too(ratio):
    with pytest.raises(InputError, match=r"membrane\.radius_to_thickness = .*> 0"):
        fm.Scene.from_dict(tables(ratio=ratio))


def test_ratio_follows_new_scales():
    thick = fm.Scales(radius=0.05, thickness=1e-3, shear_modulus=4e5)
    scene = PLAIN.replace(scales=thick)
    assert scene.radius_to_thickness == thick.radius_to_thickness
    assert scene.replace(scales=RUBBER).radius_to_thickness == RUBBER.radius_to_thickness
    assert scene.replace(degree=3).radius_to_thickness == thick.radius_to_thickness
    assert scene.replace(scales=None).radius_to_thickness == thick.radius_to_thickness
    with pytest.raises(InputError, match="leave radius_to_thickness out"):
        scene.replace(scales=RUBBER, radius_to_thickness=50.0)


def test_strength_of_a_dipole_left_out():
    scene = fm.Scene.from_dict(tables({}, dipole_moment=MOMENT))
    assert scene.scales == MAGNET
    assert scene.sources == (fm.Dipole(MAGNET.strength, 6.5),)
    scene = fm.Scene.from_dict(tables({"strength": 3.0}, {"height": -2.0, "orientation": -1}, dipole_moment=MOMENT))
    assert scene.sources == (fm.Dipole(3.0, 6.5), fm.Dipole(MAGNET.strength, -2.0, -1))


def test_no_strength_and_no_moment():
    for found in (tables({}), {**tables({}), "scales": TABLE}):
        with pytest.raises(InputError, match=r"source\.strength = None: missing; give it, or scales\.dipole_moment in A m\^2"):
            fm.Scene.from_dict(found)
    with pytest.raises(InputError, match=r"source\[1\]\.strength = None: missing; .*scales\.dipole_moment"):
        fm.Scene.from_dict(tables({"strength": 1.0}, {}))
    # a misspelt strength is told as such
    for more in ({}, {"dipole_moment": MOMENT}):
        with pytest.raises(InputError, match=r"source\.strenght = 1\.0: unknown; did you mean 'strength'"):
            fm.Scene.from_dict(tables({"strenght": 1.0}, **more))


def test_a_moment_beside_strengths_is_that_of_one_of_them():
    for strength in (MAGNET.strength, MAGNET.strength * (1 + 5e-10)):
        for others in ((), ({"strength": 3.0},)):
            scene = fm.Scene.from_dict(tables(*others, {"strength": strength, "height": 4.0}, dipole_moment=MOMENT))
            assert scene.sources[-1].strength == strength
    for sources in ((), ({"strength": MAGNET.strength * (1 + 2e-9)},), ({"strength": 200}, {"strength": 3.0})):
        with pytest.raises(InputError, match=r"its strength, 0\.000183346.*it would do nothing; leave it out") as caught:
            fm.Scene.from_dict(tables(*sources, dipole_moment=MOMENT))
        assert (caught.value.key, caught.value.value) == ("scales.dipole_moment", MOMENT)
    with pytest.raises(InputError, match=r"scales\.dipole_moment"):
        PLAIN.replace(scales=MAGNET)


@pytest.mark.parametrize(
    ("table", "key", "advice"),
    [
        ({}, "scales.radius", "missing; it has no default"),
        ({"radius": 0.05, "thickness": 5e-5}, "scales.shear_modulus", "missing"),
        ({**TABLE, "radius": 0}, "scales.radius", "> 0"),
        ({**TABLE, "thickness": "thin"}, "scales.thickness", "> 0"),
        ({**TABLE, "shear_modulus": True}, "scales.shear_modulus", "> 0"),
        ({**TABLE, "dipole_moment": -12.0}, "scales.dipole_moment", "> 0"),
        ({**TABLE, "shear_moduls": 1.0}, "scales.shear_moduls", "did you mean 'shear_modulus'"),
        ({**TABLE, "susceptibility": 1.0}, "scales.susceptibility", "belongs in [membrane]"),
        (0.05, "scales", "a table"),
    ],
)
def test_refused_tables(table, key, advice):
    with pytest.raises(InputError) as caught:
        fm.Scene.from_dict({"material": {"model": "neo-hookean"}, "scales": table})
    assert caught.value.key == key
    assert advice in caught.value.allowed


@pytest.mark.parametrize("value", [1.0, TABLE, fm.Scales])
def test_refused_in_python(value):
    with pytest.raises(InputError, match=r"scales = .*Scales\(radius=\.\.\., thickness=\.\.\., shear_modulus=\.\.\.\) is allowed"):
        fm.Scene(fm.NeoHookean(), scales=value)


@given(scales=any_scales, moment=st.none() | decades, other=st.floats(0, 600), written=st.booleans())
def test_scene_there_and_back(scales, moment, other, written, tmp_path_factory):
    """With and without a moment, whose strength is written or left out."""
    given = {"radius": scales.radius, "thickness": scales.thickness, "shear_modulus": scales.shear_modulus}
    found = tables({"strength": other}, {"height": -2.0}, **given)
    if moment is None or written:
        found["source"][1]["strength"] = other if moment is None else scales.from_si("dipole_strength", moment)
    if moment is not None:
        found["scales"]["dipole_moment"] = moment
    scene = fm.Scene.from_dict(found)
    path = tmp_path_factory.getbasetemp() / "scales.toml"
    scene.to_toml(path)
    for back in (fm.Scene.from_dict(scene.to_dict()), fm.Scene.from_toml(path)):
        assert back == scene
        assert hash(back) == hash(scene)
    assert scene.scales.dipole_moment == moment


def test_scales_change_no_equilibrium():
    assert potential_of(PLAIN.replace(scales=RUBBER)) is potential_of(PLAIN)
    assert potential_of(MAGNETIC.replace(scales=MAGNET)) is potential_of(MAGNETIC)


# --- a number of the scene that varies


def test_a_moment_goes_when_its_strength_varies():
    scene = MAGNETIC.replace(scales=MAGNET)
    strength = Parameter(scene, "source.0.strength")
    assert strength.scene_at(strength.value) == scene
    for value in (0.0, 200.0):
        varied = strength.scene_at(value)
        assert varied.scales == RUBBER
        assert varied.sources == (fm.Dipole(value, 6.5),)
    assert Parameter(scene, "source.0.height").scene_at(5.0).scales == MAGNET
    assert Parameter(scene, "membrane.susceptibility").scene_at(1.0).scales == MAGNET


def test_a_moment_stays_while_another_dipole_has_it():
    scene = MAGNETIC.replace(sources=[fm.Dipole(3.0, -2.0), *MAGNETIC.sources], scales=MAGNET)
    assert Parameter(scene, "source.0.strength").scene_at(4.0).scales == MAGNET
    assert Parameter(scene, "source.1.strength").scene_at(4.0).scales == RUBBER


def test_fold_curve_in_the_strength_of_a_moment():
    """The fold's scenes keep the scales that apply, and a start with the moment of the strength that varies is no obstacle."""
    scales = fm.Scales(**TABLE, dipole_moment=RUBBER.to_si("dipole_strength", 200.0))
    scene = disc_scene(OGDEN, (scales.strength, 6.5), elements=8).replace(scales=scales)
    limit = fm.trace(scene, start=0.5, until={"volume": 12.0}).special_points[0]
    curve = fm.fold_curve(scene, start=limit, parameter="source.0.strength", bounds=(150.0, 250.0))
    assert curve.values[-1] == 250.0
    assert curve.equilibria[0].scene.scales == scales
    assert curve.equilibria[-1].scene.scales == RUBBER


# --- output in Pa

STRESSES = ("mechanical_stress_1", "mechanical_stress_2", "total_stress_1", "total_stress_2")
IN_SI = ("volume_m3", "pressure_pa", "center_height_m", "elastic_energy_j", "magnetic_energy_j")
IN_PA = tuple(f"{name}_pa" for name in STRESSES)


@pytest.fixture(scope="module")
def bare() -> fm.Branch:
    return fm.inflate(MAGNETIC, volumes=[1.0, 2.0])


@pytest.fixture(scope="module")
def scaled() -> fm.Branch:
    return fm.inflate(MAGNETIC.replace(scales=MAGNET), volumes=[1.0, 2.0])


def test_profile_in_pa(bare, scaled):
    for r in (None, [0.0, 0.3, 1.0]):
        profile, plain = scaled[1].profile(r), bare[1].profile(r)
        assert list(profile) == [*plain, *IN_PA]
        for name in STRESSES:
            np.testing.assert_array_equal(profile[name], plain[name])
            np.testing.assert_allclose(profile[f"{name}_pa"], 4e5 * plain[name], rtol=1e-15)


def test_total_stress_takes_the_ratio_of_the_scales(bare):
    """The pressure through the thickness is P T/R0 over mu: p itself, in Pa."""
    scene = MAGNETIC.replace(scales=fm.Scales(radius=0.05, thickness=1e-3, shear_modulus=4e5))
    (thick,) = fm.inflate(scene, volumes=[1.0])
    through = scene.scales.to_si("pressure", thick.pressure), MAGNET.to_si("pressure", bare[0].pressure)
    for name in ("total_stress_1", "total_stress_2"):
        expected = 4e5 * bare[0].profile()[name] - through[0] + through[1]
        np.testing.assert_allclose(thick.profile()[f"{name}_pa"], expected, rtol=1e-12)


def test_column(bare, scaled):
    np.testing.assert_allclose(scaled.column("pressure_pa"), 400.0 * scaled.column("pressure"), rtol=1e-15)
    assert scaled[:0].column("pressure_pa").shape == (0,)
    with pytest.raises(InputError, match=r"column = 'pressure_p'.*did you mean 'pressure_pa'"):
        scaled.column("pressure_p")
    with pytest.raises(InputError, match=r"column = 'pressure_pa': unknown; did you mean 'pressure'\?") as caught:
        bare.column("pressure_pa")
    assert "_pa" not in caught.value.allowed


def test_columns_in_si_units_by_hand(scaled):
    """R0 = 5 cm, R0^3 = 1.25e-4 m^3, mu T R0^2 = 0.05 J, mu T/R0 = 400 Pa."""
    units = {"volume": ("m3", 1.25e-4), "pressure": ("pa", 400.0), "center_height": ("m", 0.05)}
    units |= dict.fromkeys(("elastic_energy", "magnetic_energy"), ("j", 0.05))
    for name, (suffix, unit) in units.items():
        np.testing.assert_allclose(scaled.column(f"{name}_{suffix}"), unit * scaled.column(name), rtol=1e-14)


def test_special_points_in_si_units(tmp_path):
    scene = disc_scene(elements=8).replace(scales=RUBBER)
    branch = fm.trace(scene, start=2.0, until={"volume": 30.0})
    assert len(branch.special_points) == 2
    table.write_special_points_csv(branch, tmp_path / "points.csv")
    with (tmp_path / "points.csv").open(encoding="utf-8") as file:
        row, _ = csv.DictReader(file)
    for name, column, unit in (
        ("volume", "volume_m3", 1.25e-4),
        ("pressure", "pressure_pa", 400),
        ("center_height", "center_height_m", 0.05),
    ):
        assert float(row[column]) == pytest.approx(unit * float(row[name]), rel=1e-13)


def test_a_printed_branch_has_readable_units(bare, scaled):
    """Of a membrane of 5 cm: 125 ml, 400 Pa."""
    head, first = str(scaled).splitlines()[:2]
    assert head.split()[-10:] == ["V", "in", "ml", "p", "in", "Pa", "pole", "height", "in", "mm"]
    assert [float(word) for word in first.split()[-3:]] == pytest.approx(
        [125 * scaled[0].volume, 400 * scaled[0].pressure, 50 * scaled[0].center_height], rel=1e-4
    )
    assert "in ml" not in str(bare)


def test_table(bare, scaled, tmp_path):
    names = table.columns(bare)
    place = names.index("residual")
    assert table.columns(scaled) == [*names[:place], *IN_SI, *names[place:]]
    table.write_csv(scaled, tmp_path / "branch.csv")
    with (tmp_path / "branch.csv").open(encoding="utf-8") as file:
        found = [float(row["pressure_pa"]) for row in csv.DictReader(file)]
    assert found == scaled.column("pressure_pa").tolist()
    assert scaled.to_dataframe()["pressure_pa"].tolist() == found


def test_netcdf(bare, scaled, tmp_path):
    import xarray

    scaled.save(tmp_path / "branch.nc")
    with xarray.open_dataset(tmp_path / "branch.nc", engine="h5netcdf") as dataset:
        assert set(dataset.variables) - set(bare.to_xarray().variables) == {*IN_SI, *IN_PA}
        assert dataset["pressure_pa"].attrs == {"long_name": "pressure p", "units": "Pa"}
        assert dataset["total_stress_1_pa"].attrs == {"long_name": "meridional total stress", "units": "Pa"}
        assert {dataset[name].attrs["units"] for name in IN_PA} == {"Pa"}
        assert {dataset[name].attrs["units"] for name in STRESSES} == {"1"}
        np.testing.assert_array_equal(dataset["pressure_pa"].values, scaled.column("pressure_pa"))
        for name in IN_PA:
            np.testing.assert_array_equal(dataset[name].values, [e.profile()[name] for e in scaled])
    loaded = fm.load(tmp_path / "branch.nc")
    assert loaded.scene == scaled.scene
    assert loaded.column("pressure_pa").tolist() == scaled.column("pressure_pa").tolist()


def test_surfaces(bare, scaled, tmp_path):
    import pyvista

    for branch, name in ((bare, "bare"), (scaled, "scaled")):
        branch[:1].to_vtk(tmp_path / f"{name}.pvd")
    plain, grid = (pyvista.read(tmp_path / name / f"{name}_0000.vtu") for name in ("bare", "scaled"))
    assert set(grid.point_data) - set(plain.point_data) == set(IN_PA)
    for name in STRESSES:
        np.testing.assert_allclose(grid.point_data[f"{name}_pa"], 4e5 * plain.point_data[name], rtol=1e-15)


def test_rendered(bare, scaled, tmp_path):
    picture.render(scaled, tmp_path / "stress.png", quantity="total_stress_1_pa", size=(200, 150))
    assert (tmp_path / "stress.png").stat().st_size > 0
    with pytest.raises(InputError, match="total_stress_1_pa") as caught:
        picture.render(bare, tmp_path / "none.png", quantity="total_stress_1_pa")
    assert "_pa" not in caught.value.allowed


def test_a_trace_continued_with_scales_has_them_from_its_start():
    """Scales change no equilibrium, so a branch without them may be continued with them; all rows then have the same columns."""
    scene = MAGNETIC.replace(scales=MAGNET)
    half = fm.trace(MAGNETIC, start=1.0, until={"volume": 4.0}, max_steps=4, throw=False)
    whole = fm.trace(scene, start=half, until={"volume": 4.0})
    assert len(whole) > len(half)
    assert {eq.scene for eq in whole} == {p.equilibrium.scene for p in whole.special_points} == {scene}
    assert whole.to_xarray()["total_stress_1_pa"].shape == (len(whole), 17)  # 8 quadratic elements


def test_zones_of_a_continued_trace_are_those_of_its_scene():
    """Total stresses depend on R0/T, and so on the scales; zones asked for before may not be carried along."""
    thick = MAGNETIC.replace(radius_to_thickness=2.0, analysis=fm.Analysis(wrinkling="total"))
    half = fm.trace(MAGNETIC, start=0.6, until={"volume": 4.0}, max_steps=3)
    before = half[0].zones("total")
    whole = fm.trace(thick, start=half, until={"volume": 4.0})
    fresh = fm.trace(thick, start=0.6, until={"volume": 4.0})
    assert whole[0].zones() == fresh[0].zones() != before


@pytest.mark.parametrize(("quantity", "value"), [("stress", 1e305), ("stress", [1.0, 1e305]), ("energy", -1e308)])
def test_values_that_no_float_holds(quantity, value):
    scales = fm.Scales(0.02, 2e-5, 4e5) if quantity == "stress" else fm.Scales(2e3, 2e1, 4e5)
    with pytest.raises(InputError, match=r"^value = ") as caught:
        scales.to_si(quantity, value)
    assert "a float can hold" in str(caught.value)
    assert scales.to_si(quantity, np.inf) == np.inf


@pytest.mark.parametrize("text", ["1e400 Pa", "1e308 MPa"])
def test_a_text_that_is_too_large_for_a_float_is_refused(text):
    scales = fm.Scales(radius=0.05, thickness=1e-3, shear_modulus=1e5)
    with pytest.raises(fm.InputError, match="a float can hold in Pa"):
        scales.from_si("pressure", text)


@pytest.mark.parametrize(("quantity", "value"), [("volume", 1e305), ("dipole_strength", 1e300)])
def test_si_values_that_no_float_holds(quantity, value):
    with pytest.raises(InputError, match=r"^value = "):
        fm.Scales(0.02, 2e-5, 4e5).from_si(quantity, value)


def test_run_of_a_scene_file(tmp_path):
    """From a moment in A m^2 to a pressure in Pa: the folder is the same as for a scene with the strength written out, and has two numbers
    more.
    """
    text = """
        [material]
        model = "neo-hookean"
        [membrane]
        susceptibility = 2.5
        [scales]
        radius = 0.05
        thickness = 5.0e-5
        shear_modulus = 4.0e5
        dipole_moment = 12.0
        [[source]]
        kind = "dipole"
        height = 6.5
        [mesh]
        elements = 8
        [run]
        values = [1.0, 2.0]
    """
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    assert cli.main(["run", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out")]) == 0
    with (tmp_path / "out" / "branch.csv").open(encoding="utf-8") as file:
        found = list(csv.DictReader(file))
    expected = fm.inflate(MAGNETIC, volumes=[1.0, 2.0]).column("pressure")
    np.testing.assert_allclose([float(row["pressure"]) for row in found], expected, rtol=1e-12)
    np.testing.assert_allclose([float(row["pressure_pa"]) for row in found], 400.0 * expected, rtol=1e-12)


def test_scales_and_loads_are_texts_with_units() -> None:
    """mu T/R0 = 400 Pa and R0^3 = 125 ml."""
    texts = fm.Scales(radius="5 cm", thickness="50 um", shear_modulus="0.4 MPa", dipole_moment="12 A m^2")
    assert texts == MAGNET
    with pytest.raises(InputError, match=r"scales\.radius.*a length such as"):
        fm.Scales(radius="5 kPa", thickness=5e-5, shear_modulus=4e5)
    bare = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), scales=RUBBER)
    pressures = fm.pressurize(bare, pressures=["0.2 kPa", 1.0]).column("pressure")
    np.testing.assert_allclose(pressures, [0.5, 1.0], rtol=1e-12)
    assert fm.inflate(bare, volumes="125 ml")[0].volume == pytest.approx(1.0, rel=1e-12)
    assert fm.equilibrium(bare, pressure="0.2 kPa").pressure == pytest.approx(0.5, rel=1e-12)
    for scene, text in ((bare, "1 mm"), (bare.replace(scales=None), "1 kPa"), (bare, "1")):
        with pytest.raises(InputError, match="pressures"):
            fm.pressurize(scene, pressures=[text])


def test_a_load_that_is_not_reached_is_also_given_in_si_units() -> None:
    bare = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), scales=RUBBER)
    with pytest.raises(fm.SolveError, match=r"^pressure 3 \(1\.2 kPa\) was not reached: "):
        fm.pressurize(bare, pressures=[1.0, 3.0])


def test_zero_is_printed_without_a_sign() -> None:
    assert written("pressure", -0.0, 4) == "   0"
    assert written("step", 3) == "3"
    assert caption(-0.0, -0.0) == "V = 0  P = 0"
    flat = fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), prestretch=1.5), pressure=-0.0)
    assert "-0" not in repr((flat.pressure, flat.volume, flat.center_height)).replace("e-0", "")

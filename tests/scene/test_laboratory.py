"""Scenes in the units of a laboratory: conversions by hand, there and back, refusals."""

from __future__ import annotations

import copy
import dataclasses
import math

import numpy as np
import pytest
from scipy.constants import mu_0

import femmembrane as fm
from femmembrane.errors import InputError
from femmembrane.scene.laboratory import _KINDS, number_kind, scaled
from femmembrane.scene.toml import ELECTRIC_KEYS, LOADS, OBSTACLES, SOURCES

#: R0 = 20 mm, T = 0.3 mm, mu = 0.4 MPa: mu T/R0 = 6000 Pa, R0^3 = 8 ml
SCALES = {"radius": 0.02, "thickness": 3e-4, "shear_modulus": 4e5}
PLAIN = {"units": "si", "scales": SCALES, "material": {"model": "neo-hookean"}, "mesh": {"shape": "disc", "elements": 4}}


def scene(**tables):
    return fm.Scene.from_dict({**copy.deepcopy(PLAIN), **tables})


# --- loads and lengths


@pytest.mark.parametrize(
    ("control", "si", "text", "scaled"),
    [("pressure", 3000.0, "30 mbar", 0.5), ("volume", 4e-6, "4 ml", 0.5), ("height", 0.03, "30 mm", 1.5)],
)
def test_loads_by_hand(control, si, text, scaled):
    bare = scene(run={"control": control, "values": [si]})
    assert bare.run.values == pytest.approx([scaled], rel=1e-15)
    assert scene(run={"control": control, "values": [text]}) == bare
    assert scene(units="scaled", run={"control": control, "values": [text]}) == bare
    ends = scene(run={"control": control, "start": 0.5 * si, "stop": text, "steps": 3}).run
    assert ends.loads() == pytest.approx([0.5 * scaled, 0.75 * scaled, scaled], rel=1e-15)


def test_arc_length_starts_with_a_volume_and_ends_where_asked():
    run = scene(run={"control": "arc-length", "start": "0.8 ml", "until": {"center_height": "5 cm"}}).run
    assert (run.start, run.until["center_height"]) == pytest.approx((0.1, 2.5), rel=1e-15)
    assert scene(run={"control": "arc-length", "start": 8e-7, "until": {"pressure": 1200}}).run.until["pressure"] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        ({"shape": "annulus", "inner_radius": "5 mm", "elements": 4}, fm.annulus(0.25, elements=4)),
        ({"shape": "cap", "height": 0.01, "elements": 4}, fm.cap(0.5, elements=4)),
        ({"shape": "cylinder", "length": "60 mm", "elements": 4}, fm.cylinder(3.0, elements=4)),
        ({"shape": "torus", "aspect": 3, "elements": 4}, fm.torus(3.0, elements=4)),
        ({"shape": "disc", "radii": [0, 0.005, 0.02]}, fm.disc(radii=[0, 0.25, 1])),
        (
            {"shape": "disc", "elements": 4, "rim": {"kind": "clamped", "radius": "24 mm", "height": 0.002}},
            fm.disc(4, rim={"kind": "clamped", "radius": 1.2, "height": 0.1}),
        ),
    ],
)
def test_shapes_by_hand(mesh, expected):
    found = scene(mesh=mesh).mesh
    assert found.breakpoints() == pytest.approx(expected.breakpoints(), rel=1e-14)
    for end, other in zip(found.supports(), expected.supports(), strict=True):
        assert (end.radius, end.height) == (pytest.approx(other.radius), pytest.approx(other.height))


def test_a_mesh_file_has_a_unit(tmp_path):
    s = [20 * math.sin(math.pi * k / 40) for k in range(21)]
    c = [20 * math.cos(math.pi * k / 40) for k in range(21)]
    fm.write_meridian(fm.meridian_from_points(list(zip(s, c, strict=True))), tmp_path / "dome.vtu")
    millimetres = {"file": str(tmp_path / "dome.vtu"), "unit": "mm"}
    for units in ("si", "scaled"):
        R, Z = scene(units=units, mesh=millimetres).mesh.position(scene(mesh=millimetres).mesh.breakpoints())
        assert (max(R), max(Z)) == pytest.approx((1, 1), rel=1e-14)
    metres = scene(mesh={"file": str(tmp_path / "dome.vtu")}).mesh  # numbers of the file are metres
    assert max(metres.position(metres.breakpoints())[0]) == pytest.approx(1000, rel=1e-14)
    bare = fm.Scene(fm.NeoHookean(), mesh=fm.read_meridian(tmp_path / "dome.vtu"))
    assert max(bare.mesh.position(bare.mesh.breakpoints())[0]) == pytest.approx(20, rel=1e-14)
    with pytest.raises(InputError, match=r"mesh.unit = '1 mPa'|mesh.unit.*a length"):
        scene(mesh={**millimetres, "unit": "mPa"})
    with pytest.raises(InputError, match=r"mesh.unit = .*needs \[scales\], where radius, thickness, shear_modulus is missing"):
        fm.Scene.from_dict({"material": PLAIN["material"], "mesh": millimetres})


def test_thickness_and_modulus_are_factors_unless_they_have_a_unit():
    assert scene(membrane={"thickness": "0.24 mm", "modulus": "0.2 MPa"}) == scene(membrane={"thickness": 0.24e-3 / 3e-4, "modulus": 0.5})
    table = scene(membrane={"thickness": [["5 mm", "0.6 mm"], [0.01, 1.5]]}).thickness
    assert np.array(table.given) == pytest.approx(np.array([[0.25, 2.0], [0.5, 1.5]]))
    assert scene(membrane={"thickness": "1 - 0.4*R**2"}).thickness == fm.Scene(fm.NeoHookean(), thickness="1 - 0.4*R**2").thickness


# --- sources and other loads


def source(**table):
    return scene(source=[table], membrane={"susceptibility": 1.0}, mesh={"shape": "annulus", "inner_radius": 0.005, "elements": 4}).sources[
        0
    ]


def test_a_dipole_has_the_field_of_its_moment():
    """On its axis, a distance d away, the moment m has the field H = 2 m/(4 pi d^3), and |h|^2 = mu0 H^2/mu."""
    for dipole in (source(kind="dipole", strength=0.5, height=0.05), source(kind="dipole", strength="500 mA m^2", height="50 mm")):
        assert dipole.height == 2.5
        assert dipole.intensity(0.0, 0.0) == pytest.approx(mu_0 * (2 * 0.5 / (4 * math.pi * 0.05**3)) ** 2 / 4e5, rel=1e-12)


def test_a_loop_has_the_field_of_its_current():
    """H = I/(2 a) at the centre of a loop of the radius a."""
    loop = source(kind="loop", strength="20 A", height="50 mm", radius="10 mm")
    assert loop.intensity(0.0, 2.5) == pytest.approx(mu_0 * (20 / 0.02) ** 2 / 4e5, rel=1e-12)
    moment = source(kind="loop", strength=20 * math.pi * 1e-4, height=0.05, radius=0.01)
    assert moment.strength == pytest.approx(loop.strength, rel=1e-14)


def test_a_cylindrical_magnet_has_the_field_of_its_remanence():
    """B = B_r/2 ((d + L)/sqrt((d + L)^2 + a^2) - d/sqrt(d^2 + a^2)) on the axis, a distance d from its face."""
    magnet = source(kind="solenoid", strength="1.2 T", height="50 mm", radius="5 mm", length="10 mm", loops=24)
    d, L, a = 0.045, 0.01, 0.005
    B = 0.6 * ((d + L) / math.hypot(d + L, a) - d / math.hypot(d, a))
    assert magnet.intensity(0.0, 0.0) == pytest.approx(B**2 / (mu_0 * 4e5), rel=1e-9)
    others = (f"{1.2 / mu_0!r} A/m", f"{0.01 * 1.2 / mu_0!r} A", 1.2 / mu_0 * math.pi * 25e-6 * 0.01)
    for strength in others:
        again = source(kind="solenoid", strength=strength, height=0.05, radius=0.005, length=0.01, loops=24)
        assert again.strength == pytest.approx(magnet.strength, rel=1e-12)


def test_a_wire_and_a_uniform_field_by_hand():
    """H = I/(2 pi rho); a uniform field of the flux density B has |h|^2 = B^2/(mu0 mu)."""
    wire = source(kind="wire", strength=30.0)
    assert wire == source(kind="wire", strength="30 A")
    assert wire.intensity(0.5, 0.0) == pytest.approx(mu_0 * (30 / (2 * math.pi * 0.01)) ** 2 / 4e5, rel=1e-12)
    uniform = source(kind="uniform", strength="100 mT")
    assert uniform.strength == pytest.approx(0.01 / (mu_0 * 4e5), rel=1e-12)
    assert source(kind="uniform", strength=0.1) == uniform
    assert source(kind="uniform", strength=f"{0.1 / mu_0!r} A/m").strength == pytest.approx(uniform.strength, rel=1e-12)


def test_loads_besides_the_pressure_by_hand():
    """w = rho g R0/mu = 960 9.80665 0.02/4e5, gamma = rho g R0/(mu T/R0) = 1000 9.80665 0.02/6000, F/(mu T R0) = 0.6/2.4."""
    mesh = {"shape": "annulus", "inner_radius": 0.005, "elements": 4}
    loads = [{"kind": "weight", "weight": 960}, {"kind": "hydrostatic", "gamma": "1 g/cm^3"}, {"kind": "hub-force", "force": "600 mN"}]
    weight, liquid, hub = scene(load=loads, mesh=mesh).loads
    assert weight.weight == pytest.approx(960 * 9.80665 * 0.02 / 4e5, rel=1e-14)
    assert liquid.gamma == pytest.approx(9806.65 * 0.02 / 6000, rel=1e-14)
    assert hub.force == pytest.approx(0.25, rel=1e-14)


def test_tables_of_other_physics_by_hand():
    """Numbers that a scene keeps in SI units lose their unit alone; gas p V over mu T R0^2 = 0.048 J."""
    tables = scaled(
        {
            **PLAIN,
            "chamber": {"volume": "40 ml", "atmosphere": 6000},
            "electric": {"voltage": "3 kV", "breakdown": "40 MV/m", "from": "10 mm"},
            "membrane": {"remanence": "100 mT", "saturation": 0.1},
            "source": [{"kind": "magnet", "remanence": "1300 mT", "height": 0.05, "inner_radius": "2 mm"}],
            "run": {"control": "gas", "start": "24 mJ", "hold": {"pressure": "3 kPa"}},
        }
    )
    assert tables["chamber"] == {"volume": pytest.approx(5.0), "atmosphere": pytest.approx(1.0)}
    assert tables["electric"] == {"voltage": 3000.0, "breakdown": 4e7, "from": 0.5}
    magnetization = 0.1 / mu_0 / math.sqrt(4e5 / mu_0)
    assert tables["membrane"] == {"remanence": pytest.approx(magnetization), "saturation": pytest.approx(magnetization)}
    assert tables["source"][0] == {"kind": "magnet", "remanence": 1.3, "height": 2.5, "inner_radius": 0.1}
    assert tables["run"] == {"control": "gas", "start": pytest.approx(0.5), "hold": {"pressure": pytest.approx(0.5)}}


BODIES = [
    ({"kind": "plane", "height": 0.012}, {"kind": "plane", "height": "12 mm"}, fm.Plane(0.6)),
    ({"kind": "ball", "height": 0.03, "radius": 0.01}, {"kind": "ball", "height": "3 cm", "radius": "10 mm"}, fm.Ball(1.5, 0.5)),
    (
        {"kind": "cylinder", "height": 0.03, "radius": 0.004, "length": 0.01, "rounding": 0.001},
        {"kind": "cylinder", "height": "30 mm", "radius": "4 mm", "length": "10 mm", "rounding": "1 mm"},
        fm.Cylinder(1.5, 0.2, 0.5, rounding=0.05),
    ),
    (
        {"kind": "mould", "points": [[0, 0.012], [0.02, 0.01]], "rounding": 0.001},
        {"kind": "mould", "points": [[0, "12 mm"], ["2 cm", "10 mm"]], "rounding": "1 mm"},
        fm.Mould(((0, 0.6), (1, 0.5)), rounding=0.05, side="right"),
    ),
]


@pytest.mark.parametrize(("si", "text", "expected"), BODIES, ids=[body[0]["kind"] for body in BODIES])
def test_obstacles_by_hand(si, text, expected):
    """Lengths over R0 = 20 mm, in SI numbers and with their units."""
    for found in (scene(obstacle=[si]), scene(obstacle=[text]), scene(units="scaled", obstacle=[text])):
        (body,) = found.obstacles
        for field in dataclasses.fields(expected):
            one, other = getattr(body, field.name), getattr(expected, field.name)
            assert one == other if isinstance(other, str) else np.allclose(one, other, rtol=1e-14, atol=0), field.name


def test_the_file_of_a_mould_has_a_unit(tmp_path):
    (tmp_path / "mould.txt").write_text("0 12\n20 10\n", encoding="utf-8")
    body = {"kind": "mould", "file": str(tmp_path / "mould.txt")}
    for tables in ({}, {"units": "scaled"}):
        (mould,) = scene(**tables, obstacle=[{**body, "unit": "mm"}]).obstacles
        assert np.allclose(mould.points, [[0, 0.6], [1, 0.5]], rtol=1e-14)
    (mould,) = scene(obstacle=[body]).obstacles  # numbers of the file are metres
    assert np.allclose(mould.points, [[0, 600], [1000, 500]], rtol=1e-14)
    (mould,) = scene(units="scaled", obstacle=[body]).obstacles
    assert mould.points == ((0, 12), (20, 10))
    with pytest.raises(InputError, match=r"obstacle.unit.*a length"):
        scene(obstacle=[{**body, "unit": "kPa"}])


def test_every_number_of_a_scene_file_has_a_kind_or_is_a_ratio():
    """A number with a unit would stay a text where nobody says what it is."""
    ratios = {"orientation", "loops", "tolerance", "strength", "body", "kind", "hub", "side"}  # a strength is told by its source
    classes = {"source": SOURCES, "load": LOADS, "obstacle": OBSTACLES}
    for table, registry in classes.items():
        names = {f.name for cls in registry.values() for f in dataclasses.fields(cls) if f.init}
        assert names - ratios == {name for name in names if number_kind(f"{table}.0.{name}")}, table
    for table, cls in (("chamber", fm.Chamber), ("electric", fm.Electric)):
        for field in dataclasses.fields(cls):
            assert field.name in ("relative_permittivity",) or ELECTRIC_KEYS.get(field.name, field.name) in _KINDS[table], field.name


@pytest.mark.parametrize(
    ("control", "value", "expected"), [("source.0.height", "50 mm", 2.5), ("source.0.strength", 0.5, None), ("mesh.rim.radius", 0.022, 1.1)]
)
def test_numbers_of_the_scene_as_loads(control, value, expected):
    dipole = {"kind": "dipole", "strength": "0.5 A m^2", "height": 0.05}
    run = {"control": "arc-length", "over": control, "start": value, "until": {control: value}}
    tables = scaled({**PLAIN, "source": [dipole], "run": run})
    wanted = tables["source"][0]["strength"] if expected is None else expected
    assert tables["run"]["start"] == tables["run"]["until"][control] == pytest.approx(wanted)
    assert scaled({**PLAIN, "source": [dipole], "run": {"control": control, "values": [value, value]}})["run"]["values"] == pytest.approx(
        [wanted, wanted]
    )


# --- materials


@pytest.mark.parametrize(
    ("table", "material", "shear_modulus"),
    [
        ({"model": "neo-hookean", "mu": "0.4 MPa"}, fm.NeoHookean(), 4e5),
        ({"model": "varga", "mu": "4 bar"}, fm.Varga(), 4e5),
        ({"model": "gent", "mu": "30 kPa", "jm": 50}, fm.Gent(50), 3e4),
        ({"model": "arruda-boyce", "mu": "30 kPa", "links": 25}, fm.ArrudaBoyce(25), 3e4),
        ({"model": "mooney-rivlin", "c10": "160 kPa", "c01": "40 kPa"}, fm.MooneyRivlin(0.25), 4e5),
        ({"model": "mooney-rivlin", "mu": "160 kPa", "ratio": 0.25}, fm.MooneyRivlin(0.25), 1.6e5),
        ({"model": "yeoh", "c1": "0.2 MPa", "c2": "-4 kPa", "c3": "0.8 kPa"}, fm.Yeoh(-0.01, 0.002), 4e5),
        ({"model": "yeoh", "mu": "0.4 MPa", "c2": "4 kPa"}, fm.Yeoh(0.01), 4e5),
        # 6.3 1.3 + 0.012 5 + 0.1 2 = 8.45 = 2 4.225, as in Ogden (1972)
        (
            {"model": "ogden", "mu": ["0.63 MPa", "1.2 kPa", "-0.01 MPa"], "alpha": [1.3, 5.0, -2.0]},
            fm.Ogden((0.63 / 0.4225, 0.0012 / 0.4225, -0.01 / 0.4225), (1.3, 5.0, -2.0)),
            422500.0,
        ),
        # as other programs write it: mu_1 + mu_2 = 0.4 MPa, and 2 mu/alpha = 0.3 and -0.1 MPa
        (
            {"model": "ogden", "mu": ["0.3 MPa", "0.1 MPa"], "alpha": [2.0, -2.0], "convention": "2mu/alpha^2"},
            fm.Ogden((0.75, -0.25), (2.0, -2.0)),
            4e5,
        ),
        ({"model": "polynomial", "c10": "160 kPa", "c01": "40 kPa", "c20": "4 kPa"}, fm.Polynomial(c10=0.4, c01=0.1, c20=0.01), 4e5),
        ({"model": "lopez-pamies", "mu1": "30 kPa", "mu2": "10 kPa", "alpha1": 1, "alpha2": 3}, fm.LopezPamies(1, 3, 0.25), 4e4),
        ({"model": "lopez-pamies", "mu1": "30 kPa", "alpha1": 2}, fm.LopezPamies(2), 3e4),
        ({"model": "gent-gent", "c1": "5 kPa", "c2": "3 kPa", "jm": 50}, fm.GentGent(50, 1 / 6), 1.2e4),
        (
            {"model": "extended-tube", "gc": "100 kPa", "ge": "98 kPa", "beta": 0.3, "delta": 0.1},
            fm.ExtendedTube(0.3, 0.1, 0.5),
            1.96e5,
        ),
        ({"model": "veronda-westmann", "c1": "5 kPa", "b": 2}, fm.VerondaWestmann(2), 1e4),
        ({"model": "hooke", "young_modulus": "1 MPa", "poisson_ratio": 0.25}, fm.Hooke(0.25), 4e5),
        ({"model": "hooke", "mu": "1 MPa", "poisson_ratio": 0.25}, fm.Hooke(0.25), 1e6),
    ],
)
def test_moduli_by_hand(table, material, shear_modulus):
    found = scene(units="scaled", material=table, scales={"radius": "20 mm", "thickness": "0.3 mm"})
    assert found.scales.shear_modulus == pytest.approx(shear_modulus, rel=1e-14)
    assert type(found.material) is type(material)
    assert numbers(found.material) == pytest.approx(numbers(material), rel=1e-14)
    measured, modulus = fm.measured(**table)
    assert (measured, modulus) == (found.material, found.scales.shear_modulus)
    bare = {name: in_pascals(value) for name, value in table.items()}
    assert scene(material=bare, scales={"radius": 0.02, "thickness": 3e-4}) == found


def numbers(material):
    parts = [getattr(material, name) for name in material.__dataclass_fields__]
    return [n for part in parts if not isinstance(part, str) for n in (part if isinstance(part, tuple) else (part,))]


def in_pascals(value):
    if isinstance(value, list):
        return [in_pascals(one) for one in value]
    number, _, unit = value.partition(" ") if isinstance(value, str) else ("", "", "")
    power = {"MPa": "e6", "kPa": "e3", "bar": "e5"}.get(unit)
    return float(number + power) if power else value


STRETCHES = (math.log(1.3), math.log(1.1))


def invariants():
    l1, l2 = 1.3**2, 1.1**2
    l3 = 1 / (l1 * l2)
    return l1 + l2 + l3 - 3, l1 * l2 + l2 * l3 + l3 * l1


@pytest.mark.parametrize(
    ("table", "energy"),
    [
        (
            {"model": "gent-gent", "c1": 5e3, "c2": 3e3, "jm": 50},  # Pucci and Saccomandi (2002)
            lambda J, I2: -5e3 * 50 * math.log(1 - J / 50) + 3e3 * math.log(I2 / 3),
        ),
        (
            {"model": "veronda-westmann", "c1": 5e3, "b": 2},  # Veronda and Westmann (1970)
            lambda J, I2: 5e3 * (math.exp(2 * J) - 1) - 5e3 * 2 / 2 * (I2 - 3),
        ),
        (
            {"model": "lopez-pamies", "mu1": 3e4, "mu2": 1e4, "alpha1": 1, "alpha2": 3},  # Lopez-Pamies (2010)
            lambda J, I2: 3e4 / 2 * J + 1e4 * 3**-2 / 6 * ((J + 3) ** 3 - 27),
        ),
        (
            {"model": "extended-tube", "gc": 1e5, "ge": 5e4, "beta": 0.3, "delta": 0.1},  # Kaliske and Heinrich (1999)
            lambda J, I2: (
                5e4 * (0.99 * J / (1 - 0.01 * J) + math.log(1 - 0.01 * J)) + 1e5 / 0.09 * (1.3**-0.3 + 1.1**-0.3 + (1.3 * 1.1) ** 0.3 - 3)
            ),
        ),
        ({"model": "polynomial", "c10": 1e5, "c01": 2e4, "c11": 5e3}, lambda J, I2: 1e5 * J + (2e4 + 5e3 * J) * (I2 - 3)),
        (
            {"model": "ogden", "mu": [3e5, 1e5], "alpha": [2.0, -2.0], "convention": "2mu/alpha^2"},  # 2 mu/4 of I1 - 3 and I2 - 3
            lambda J, I2: 1.5e5 * J + 0.5e5 * (I2 - 3),
        ),
    ],
)
def test_energies_in_si_units_are_those_of_the_literature(table, energy):
    material, shear_modulus = fm.measured(**table)
    assert shear_modulus * material.energy(*STRETCHES) == pytest.approx(energy(*invariants()), rel=1e-12)


def test_youngs_modulus_is_the_slope_of_simple_tension():
    sheet, mu = fm.measured("hooke", young_modulus=1e6, poisson_ratio=0.3)
    e = 1e-6
    across, _ = sheet.natural_width(e)
    assert mu * sheet.stress(e, across)[0] == pytest.approx(1e6 * e, rel=1e-5)


def test_a_real_material_has_its_shear_modulus():
    sizes = {"radius": "20 mm", "thickness": "0.3 mm"}
    for units in ("si", "scaled"):
        found = scene(units=units, material={"name": "vhb-4910"}, scales=sizes)
        assert (found.scales.shear_modulus, found.material) == (fm.material_data("vhb-4910").shear_modulus, fm.material("vhb-4910"))
        assert fm.Scene.from_dict(found.to_dict()) == found
        assert scene(units=units, material={"name": "vhb-4910"}, scales={**sizes, "shear_modulus": "14.62 kPa"}) == found
        with pytest.raises(InputError, match=r"scales.shear_modulus = '14.6 kPa': .* 14620 Pa"):
            scene(units=units, material={"name": "vhb-4910"}, scales={**sizes, "shear_modulus": "14.6 kPa"})
    assert fm.Scene.from_dict({"material": {"name": "vhb-4910"}}).scales is None
    with pytest.raises(InputError, match=r"scales.shear_modulus = 400000.0: vhb-4910 has a shear modulus of 14620 Pa"):
        fm.Scene(fm.material("vhb-4910"), scales=fm.Scales(0.02, 3e-4, 4e5))


def test_si_moduli_may_come_from_the_scales():
    assert scene(material={"model": "gent", "jm": 50}).scales.shear_modulus == 4e5
    assert scene(material={"model": "yeoh", "c2": 4e3}).material == fm.Yeoh(0.01)
    assert scene(material={"model": "neo-hookean", "mu": 4e5}) == scene()


@pytest.mark.parametrize(
    ("table", "key", "text"),
    [
        ({"model": "neo-hookean", "mu": "0.3 MPa"}, "scales.shear_modulus", "shear modulus of 300000 Pa"),
        ({"model": "neo-hookean", "mu": "3 mm"}, "material.mu", "a pressure or modulus such as"),
        ({"model": "neo-hookean", "mu": "-3 MPa"}, "material.mu", "a shear modulus > 0 in Pa"),
        ({"model": "neo-hookean", "mu": True}, "material.mu", "a finite number in Pa"),
        ({"model": "mooney-rivlin", "c01": "3 MPa"}, "material.c10", "missing"),
        ({"model": "mooney-rivlin", "c10": "3 MPa", "c01": -1.0}, "material.c01", "a modulus >= 0"),
        ({"model": "mooney-rivlin", "c10": "3 MPa", "mu": 1.0}, "material.c10", "leave one out"),
        ({"model": "mooney-rivlin", "c10": "3 MPa", "ratio": 1.0}, "material.ratio", "leave one out"),
        ({"model": "yeoh", "c1": "1 MPa", "mu": "2 MPa", "c2": 0}, "material.c1", "leave one out"),
        ({"model": "yeoh", "c1": "0.2 MPa", "c2": "-1 MPa"}, "material.c2", "a number >= 0"),
        ({"model": "ogden", "mu": ["-0.4 MPa"], "alpha": [2]}, "material.mu", "shear modulus, > 0 in Pa"),
        ({"model": "ogden", "mu": ["0.4 MPa", "1 Pa"], "alpha": [2]}, "material.alpha", "as many exponents"),
        ({"model": "gent", "mu": "0.4 MPa"}, "material.jm", "missing"),
        ({"model": "mooney-rivlin", "c01": "3 MPa", "ratio": 1.0}, "material.ratio", "leave one out"),
        ({"model": "mooney-rivlin", "c10": "3 MPa", "c01": [1.0]}, "material.c01", "a finite number in Pa"),
        ({"model": "polynomial", "c10": ["3 MPa"]}, "material.c10", "a finite number in Pa"),
        ({"model": "polynomial", "c20": "3 MPa"}, "material.c10", "sum of c10 and c01"),
        ({"model": "lopez-pamies", "mu1": "3 kPa", "share": 0.1, "alpha1": 1}, "material.share", "leave one out"),
        ({"model": "lopez-pamies", "mu2": "3 kPa", "alpha1": 1}, "material.mu1", "missing"),
        ({"model": "gent-gent", "c1": "3 kPa", "c2": "-1 kPa", "jm": 9}, "material.c2", "a modulus >= 0"),
        ({"model": "gent-gent", "c1": "3 kPa", "mu": "1 kPa", "jm": 9}, "material.c1", "leave one out"),
        ({"model": "extended-tube", "gc": "3 kPa", "beta": 0.3}, "material.delta", "missing"),
        ({"model": "veronda-westmann", "c1": "3 kPa", "b": "2 kPa"}, "material.b", "number"),
        ({"model": "hooke", "young_modulus": "3 kPa", "poisson_ratio": -1}, "material.poisson_ratio", "above -1"),
        ({"name": "vhb"}, "material.name", "did you mean 'vhb-4910'"),
    ],
)
def test_moduli_that_are_refused(table, key, text):
    with pytest.raises(InputError) as caught:
        scene(material=table)
    assert caught.value.key == key
    assert text in str(caught.value)


# --- what a file says


def test_an_si_scene_is_written_in_units_of_the_package_and_reads_back(tmp_path):
    table = {"model": "mooney-rivlin", "c10": "160 kPa", "c01": "40 kPa"}
    made = scene(
        material=table,
        source=[{"kind": "dipole", "strength": "0.5 A m^2", "height": "70 mm"}],
        membrane={"susceptibility": 0.4, "prestretch": 1.1},
        run={"control": "pressure", "start": "1 mbar", "stop": "1 kPa", "steps": 4},
    )
    made.to_toml(tmp_path / "scene.toml")
    assert fm.Scene.from_toml(tmp_path / "scene.toml") == made
    assert "units" not in made.to_dict()
    assert made.prestretch == 1.1


@pytest.mark.parametrize("units", ["SI", 1, None, "metric"])
def test_units_that_are_refused(units):
    with pytest.raises(InputError, match="known: scaled, si"):
        scene(units=units)


@pytest.mark.parametrize(
    ("tables", "key", "text"),
    [
        ({"run": {"control": "height", "values": ["5 kPa"]}}, "run.values[0]", "a length such as"),
        ({"run": {"control": "pressure", "values": ["5 kPas"]}}, "run.values[0]", "'kPas' is no unit known here"),
        ({"run": {"control": "arc-length", "start": 1e-6, "until": {"pressure": "5 mm"}}}, "run.until.pressure", "a pressure"),
        ({"mesh": {"shape": "cap", "height": "5 kPa"}}, "mesh.height", "a length"),
        ({"obstacle": [{"kind": "plane", "height": "5 kPa"}]}, "obstacle.height", "a length"),
        ({"source": [{"kind": "dipole", "strength": "5 T", "height": 1}]}, "source.strength", "a magnetic moment"),
        ({"source": [{"kind": "dipole", "strength": -0.5, "height": 1}]}, "source.strength", ">= 0"),
        ({"load": [{"kind": "weight", "weight": "5 N"}, {"kind": "weight", "weight": 1}]}, "load[0].weight", "a density"),
        ({"membrane": {"thickness": "5 kPa"}}, "membrane.thickness", "a length"),
        ({"membrane": {"prestretch": "5 mm"}}, "membrane.prestretch", "number"),
        ({"scales": {**SCALES, "radius": "5 kPa"}}, "scales.radius", "a length"),
        ({"scales": {"radius": 1, "thickness": 1}}, "scales.shear_modulus", "moduli of [material] in Pa"),
        (
            {"source": [{"kind": "dipole", "height": 0.1, "strength": 1}], "scales": {"radius": 1, "thickness": 1}},
            "source.height",
            "moduli in Pa",
        ),
        ({"source": [{"kind": "5 cm"}]}, "source.kind", "known"),
        ({"run": {"control": "volume", "values": [1], "max_steps": "3 kPa"}}, "run.max_steps", "only arc-length"),
        ({"scales": {**SCALES, "radus": 1}}, "scales.radus", "radius"),
        ({"scales": 3}, "scales", "table"),
        ({"run": {"control": "pressure", "values": [1e300]}}, "run.values[0]", "size"),
    ],
)
def test_numbers_that_are_refused(tables, key, text):
    with pytest.raises(InputError) as caught:
        scene(**tables)
    assert caught.value.key == key
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("tables", "start"),
    [
        ({"mesh": {"shape": "annulus", "elements": 4, "inner_radius": "50 mm"}}, "mesh.inner_radius = '50 mm': a number between 0 and 1"),
        ({"mesh": {"shape": "annulus", "elements": 4, "inner_radius": 0.05}}, "mesh.inner_radius = 0.05: a number between 0 and 1"),
        ({"mesh": {"shape": "disc", "radii": ["0 m", "12 mm", "9 mm", "2 cm"]}}, "mesh.radii[2] = '9 mm'"),
        ({"source": [{"kind": "loop", "strength": 1, "height": 1, "radius": "-5 mm"}]}, "source.radius = '-5 mm'"),
        (
            {"source": [{"kind": "uniform", "strength": 1}, {"kind": "dipole", "strength": 1, "height": "0 mm"}]},
            "source[1].height = '0 mm'",
        ),
        ({"source": [{"kind": "wire", "strength": "-3 A"}]}, "source.strength = '-3 A'"),
        ({"obstacle": [{"kind": "ball", "height": "1 cm", "radius": "-4 mm"}]}, "obstacle.radius = '-4 mm'"),
        ({"load": [{"kind": "hub-force", "force": "3e90 N"}]}, "load.force = '3e90 N'"),
        ({"run": {"control": "pressure", "values": ["1 kPa", "3e90 kPa"]}}, "run.values[1] = '3e90 kPa'"),
        ({"membrane": {"thickness": "-0.1 mm"}}, "membrane.thickness = '-0.1 mm'"),
        ({"material": {"model": "yeoh", "c1": "0.2 MPa", "c2": "-4 kPa"}}, "material.c2 = '-4 kPa'"),
        ({"material": {"model": "neo-hookean", "mu": "-3 MPa"}}, "material.mu = '-3 MPa'"),
        ({"scales": {**SCALES, "radius": "-3 mm"}}, "scales.radius = '-3 mm'"),
    ],
)
def test_errors_show_what_the_user_wrote(tables, start):
    with pytest.raises(InputError) as caught:
        scene(**{"membrane": {"susceptibility": 1.0}, **tables})
    assert str(caught.value).startswith(start)
    assert "(converted: " in str(caught.value)


def test_errors_about_numbers_of_the_package_stay_as_they_are():
    with pytest.raises(InputError) as caught:
        scene(membrane={"prestretch": -1.0})
    assert "converted" not in str(caught.value)
    with pytest.raises(InputError, match=r"material.c2 = '-4 kPa'"):
        fm.measured("yeoh", c1="0.2 MPa", c2="-4 kPa")
    with pytest.raises(InputError, match=r"value = '-3 A m\^2'"):
        fm.Scales(**SCALES).from_si("dipole_strength", "-3 A m^2")
    with pytest.raises(InputError, match=r"value = '3e999 m': .*float"):
        fm.Scales(**SCALES).from_si("length", "3e999 m")


def test_a_number_with_a_unit_needs_scales():
    bare = {"material": {"model": "neo-hookean"}, "run": {"control": "pressure", "values": ["5 kPa"]}}
    with pytest.raises(InputError, match=r"run.values\[0\] = '5 kPa': a number in SI units needs \[scales\], where radius, thickness"):
        fm.Scene.from_dict(bare)
    with pytest.raises(InputError, match=r'material.mu = 400000.0: its unit is missing: "0.4 MPa"'):
        fm.Scene.from_dict({"material": {"model": "neo-hookean", "mu": 4e5}})


def test_scales_read_numbers_with_a_unit():
    scales = fm.Scales(**SCALES)
    assert scales.from_si("pressure", "30 mbar") == pytest.approx(0.5, rel=1e-15)
    with pytest.raises(InputError, match="a pressure or modulus"):
        scales.from_si("pressure", "30 mm")
    with pytest.raises(InputError, match="known"):
        scales.from_si("presure", "30 mm")

"""Wrinkling zones: borders against closed forms, and what a run says of them when asked, and only then."""

from __future__ import annotations

import csv
import dataclasses
import json
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

import femmembrane as fm
from femmembrane.cli import main
from femmembrane.discretization.space import space_of
from femmembrane.physics.tension_field import TensionField
from femmembrane.results import output, store, table
from femmembrane.results.analyses.wrinkled_zones import ZONE_COLUMNS, write_zones_csv
from femmembrane.results.zones import KINDS, Zones
from femmembrane.stability import zones as zones_module
from femmembrane.stability.profile import profile_at
from femmembrane.stability.zones import find_zones
from tests.cases import OGDEN, disc_scene

NEO = fm.NeoHookean()


def state(scene: fm.Scene, u, w) -> np.ndarray:
    """Coefficients of the displacement u(s), w(s), interpolated."""
    space = space_of(scene.mesh, scene.degree)
    s = space.interpolation_points()
    return space.interpolate(u(s) + 0 * s, w(s) + 0 * s)


def equilibrium(scene: fm.Scene, x: np.ndarray, pressure: float = 0.0) -> fm.Equilibrium:
    """A record of any state, in balance or not: zones are a matter of stress alone."""
    return fm.Equilibrium(pressure, 0.0, 0.0, 0.0, 0.0, 0.0, 0, fm.Status.CONVERGED, scene, x)


def zero(s):
    return 0 * s


# --- closed forms
#
# Flat state u = c s (1 - s), w = 0: lambda_1 = 1 + c (1 - 2 s), lambda_2 = 1 + c (1 - s), both exact in elements of degree >= 2. For every
# isotropic incompressible material s_11 vanishes at lambda_1^2 lambda_2 = 1 and s_22 at lambda_1 lambda_2^2 = 1: the natural width.


def natural_width(c: float, power_1: int, power_2: int) -> float:
    """The one root in (0, 1) of lambda_1^power_1 lambda_2^power_2 = 1 for the state above."""
    polynomial = np.poly1d([-2 * c, 1 + c]) ** power_1 * np.poly1d([-c, 1 + c]) ** power_2 - 1
    (root,) = [r.real for r in polynomial.roots if abs(r.imag) < 1e-12 and 1e-9 < r.real < 1 - 1e-9]
    return float(root)


@pytest.mark.parametrize(("elements", "degree"), [(7, 2), (10, 3), (4, 5), (64, 2), (1, 4)])
@pytest.mark.parametrize("material", [NEO, OGDEN])
def test_borders_in_closed_form(material, elements, degree):
    """Inside elements and the same on every mesh: compressed at the pole, and compressed at the rim."""
    scene = fm.Scene(material, mesh=fm.disc(elements), degree=degree)
    for c, kinds in ((-0.3, ("double", "radial", "taut")), (0.3, ("taut", "circumferential", "double"))):
        found = equilibrium(scene, state(scene, lambda s, c=c: c * s * (1 - s), zero)).zones("mechanical")
        assert found.kinds == kinds
        assert found.borders == pytest.approx([natural_width(c, 2, 1), natural_width(c, 1, 2)], abs=1e-11)
        edges = np.array([0.0, *found.borders, 1.0])
        np.testing.assert_allclose([zone.area_fraction for zone in found], np.diff(edges**2), atol=1e-11)
        deformed = edges + c * edges * (1 - edges)  # a flat ring stays one
        np.testing.assert_allclose([zone.rho for zone in found], np.stack([deformed[:-1], deformed[1:]], axis=1), atol=1e-12)
        np.testing.assert_allclose([zone.deformed_area_fraction for zone in found], np.diff(deformed**2), atol=1e-11)


def test_zones_of_a_tension_field():
    """Slack where both stretches are below 1 (lambda_1 = 1 at s = 1/2), then wrinkled to the natural width; no stress across wrinkles."""
    scene = fm.Scene(OGDEN, mesh=fm.disc(7), tension_field=True)
    found = equilibrium(scene, state(scene, lambda s: -0.3 * s * (1 - s), zero))
    assert found.zones("mechanical").kinds == ("double", "radial", "taut")
    assert found.zones("mechanical").borders == pytest.approx([0.5, natural_width(-0.3, 1, 2)], abs=1e-11)
    profile = found.profile(np.array([0.2, 0.6, 0.95]))
    assert [list(profile[f"mechanical_stress_{i}"] > 0) for i in (1, 2)] == [[False, True, True], [False, False, True]]
    assert (profile["mechanical_stress_2"][:2] == 0).all()


def test_tension_field_on_arrays():
    """A relaxed energy is the same for arrays and for symbols: the energy at the natural strains, here written out case by case."""
    e1, e2 = np.array([0.2, 0.2, -0.3, -0.1]), np.array([0.1, -0.3, 0.2, -0.2])
    natural = np.array([0.2, 0.2, -0.1, 0.0]), np.array([0.1, -0.1, 0.2, 0.0])
    np.testing.assert_allclose(TensionField(OGDEN).energy(e1, e2), OGDEN.energy(*natural), atol=1e-16)
    s1, s2 = TensionField(OGDEN).stress(e1, e2)
    np.testing.assert_allclose(s1, OGDEN.stress(*natural)[0] * [1, 1, 0, 0], atol=1e-16)
    np.testing.assert_allclose(s2, OGDEN.stress(*natural)[1] * [1, 0, 1, 0], atol=1e-16)


def test_total_stresses_in_closed_form():
    """A flat neo-Hookean state over a dipole: paper eqs. 46-56 with the field at (rho, 0), h_t = h_rho and h_n = h_z."""
    c, strength, height, chi, pressure, ratio = 0.6, 0.5, -1.1, 2.5, 0.3, 2.0
    scene = fm.Scene(NEO, fm.disc(9), 3, [fm.Dipole(strength, height)], chi, ratio)

    def stresses(s):
        l1, l2 = 1 + c * (1 - 2 * s), 1 + c * (1 - s)
        z, rho = -height, s * l2
        distance = np.hypot(rho, z)
        h_t, h_n = 3 * z * rho / distance**5, 3 * z**2 / distance**5 - 1 / distance**3
        s11 = l1**2 - (l1 * l2) ** -2 - pressure / ratio + strength * (chi + 0.5) * (h_t**2 - h_n**2)
        s22 = l2**2 - (l1 * l2) ** -2 - pressure / ratio - strength * ((h_t**2 + h_n**2) / 2 + chi * h_n**2)
        return np.stack([s11, s22])

    grid = np.linspace(0, 1, 2001)
    i, k = np.nonzero(np.diff(stresses(grid) < 0, axis=1))
    expected = sorted(brentq(lambda s, i=i: stresses(s)[i], grid[k], grid[k + 1], xtol=1e-14) for i, k in zip(i, k, strict=True))
    found = equilibrium(scene, state(scene, lambda s: c * s * (1 - s), zero), pressure).zones("total")
    assert len(expected) == 4
    assert found.borders == pytest.approx(expected, abs=1e-10)
    middles = np.array([sum(zone.r) / 2 for zone in found])
    assert found.kinds == tuple(KINDS[code] for code in np.dot((2, 1), stresses(middles) < 0))


@pytest.mark.parametrize("middle", [0.3, 0.4, 0.47, 0.77])
def test_thin_zones_are_found(middle):
    """A tenth of an element: for u = 0 and w with the slope 0.2 + 4 (s - m)^2, s_22 = 1 - 1/lambda_1^2 is least at m; P cuts it off."""
    half = 0.0125

    def slope(s):
        return 0.2 + 4 * (s - middle) ** 2

    pressure = 1 - 1 / (1 + slope(middle + half) ** 2)
    scene = fm.Scene(NEO, mesh=fm.disc(4), degree=3, radius_to_thickness=1.0)
    found = equilibrium(scene, state(scene, zero, lambda s: 0.2 * (s - 1) + 4 / 3 * ((s - middle) ** 3 - (1 - middle) ** 3)), pressure)
    assert found.zones("total").kinds == ("taut", "radial", "taut")
    assert found.zones("total").borders == pytest.approx([middle - half, middle + half], abs=1e-9)


def test_border_at_a_jump_is_the_end_of_the_element():
    """From degree 4 on the elements give the slopes: with u = s/10, then (1 - s)/10, the meridian is stretched to 1.1, then to 0.9."""
    scene = fm.Scene(NEO, mesh=fm.disc(4), degree=4)
    found = equilibrium(scene, state(scene, lambda s: np.minimum(s, 1 - s) / 10, zero)).zones("mechanical")
    assert found.kinds == ("taut", "circumferential", "double")
    assert found.borders[0] == 0.5
    # s_22 = 0 where 0.9 lambda_2^2 = 1 with lambda_2 = 1 + (1/s - 1)/10
    assert found.borders[1] == pytest.approx(1 / (10 * (0.9**-0.5 - 1) + 1), abs=1e-11)


@pytest.mark.parametrize("tension_field", [False, True])
@pytest.mark.parametrize("criterion", ["total", "mechanical"])
def test_flat_membrane_at_rest_is_taut(criterion, tension_field):
    scene = fm.Scene(OGDEN, mesh=fm.disc(8), tension_field=tension_field)
    found = equilibrium(scene, state(scene, zero, zero)).zones(criterion)
    assert (found.kinds, found.borders) == (("taut",), ())


@pytest.mark.parametrize("degree", [1, 2, 4])
@pytest.mark.parametrize("material", [NEO, OGDEN])
def test_inflated_disc_without_source_is_taut(material, degree):
    for found in fm.inflate(disc_scene(material, elements=12, degree=degree), volumes=[1e-3, 0.1, 1.0, 5.0, 40.0]):
        for criterion in ("total", "mechanical"):
            assert found.zones(criterion).kinds == ("taut",)
            assert found.zones(criterion).fraction("taut") == 1.0


# --- invariants

numbers = st.lists(st.floats(-1, 1), min_size=3, max_size=3)


@given(
    u=numbers,
    w=numbers,
    pressure=st.floats(-2, 2),
    criterion=st.sampled_from(["total", "mechanical"]),
    tension_field=st.booleans(),
    mesh=st.sampled_from([(1, 3), (6, 2), (5, 1), (4, 6)]),
)
@settings(max_examples=80, deadline=None)
def test_zones_tile_the_membrane(u, w, pressure, criterion, tension_field, mesh):
    """Any state: no gap, no overlap, neighbours differ, fractions add up, and the signs agree with the profile."""
    scene = fm.Scene(NEO, fm.disc(mesh[0]), mesh[1], [fm.Dipole(1.0, 4.0)], 2.5, 1.0, tension_field)
    wave = [lambda s, k=k: np.cos(k * np.pi * s) / 5 for k in range(3)]
    x = state(
        scene,
        lambda s: s * (1 - s) * sum(a * f(s) for a, f in zip(u, wave, strict=True)),
        lambda s: (1 - s**2) * sum(a * f(s) for a, f in zip(w, wave, strict=True)),
    )
    eq = equilibrium(scene, x, pressure)
    found = eq.zones(criterion)
    assert found[0].r[0] == 0
    assert found[-1].r[1] == found[-1].rho[1] == 1
    for before, after in pairwise(found):
        assert before.r[1] == after.r[0] > before.r[0]
        assert before.rho[1] == after.rho[0]
        assert before.kind != after.kind
    assert sum(map(found.fraction, KINDS)) == pytest.approx(1, abs=1e-12)
    assert sum(zone.deformed_area_fraction for zone in found) == pytest.approx(1, abs=1e-12)
    # at the points of an element where the signs are looked at, but for those at its ends, where slopes may jump
    s = (np.arange(mesh[0])[:, None] + np.arange(1, 12) / 12).ravel() / mesh[0]
    s = s[np.abs(s[:, None] - [*found.borders, 9.0]).min(axis=1) > 1e-8]
    profile = profile_at(scene, x, pressure, s)
    e1, e2 = profile.strain
    natural = e1 + np.maximum(e2, 0) / 2, e2 + np.maximum(e1, 0) / 2
    s11, s22 = profile.total if criterion == "total" else natural if tension_field else profile.mechanical
    np.testing.assert_array_equal(found.numbers(s), 2 * (s11 < 0) + (s22 < 0))


# --- equilibria of the paper's figure 7: a dipole at height 4, total stresses


@cache
def figure_7(strength: float, elements: int = 64, degree: int = 2) -> fm.Branch:
    scene = disc_scene(OGDEN, (strength, 4.0), elements, degree)
    return fm.inflate(scene, volumes=[0.5, 0.55, 0.6, 0.65, 0.7], solver="newton")


def test_zones_of_figure_7():
    """Double wrinkles around the pole, radial ones further out; they shrink with the volume and grow with the strength."""
    weak, strong = figure_7(100.0), figure_7(200.0)
    for branch in (weak, strong):
        assert {eq.zones().kinds[:2] for eq in branch} == {("double", "radial")}
        double, wrinkled = branch.column("fraction_double"), 1 - branch.column("fraction_taut")
        assert (np.diff(double) < 0).all()
        assert (np.diff(wrinkled) < 1e-12).all()
        assert wrinkled[-1] < wrinkled[0]
    assert (strong.column("fraction_double") > weak.column("fraction_double")).all()
    assert (strong.column("fraction_taut") < weak.column("fraction_taut")).all()
    assert all(eq.zones("mechanical").kinds == ("taut",) for eq in weak)


def test_borders_agree_between_degrees():
    """64 quadratic elements against 16 of degree 6: apart by the error of the former, 2e-6 at most (recorded on 2026-11-24)."""
    for coarse, fine in zip(figure_7(100.0), figure_7(100.0, 16, 6), strict=True):
        assert coarse.zones().kinds == fine.zones().kinds == ("double", "radial", "taut")
        assert coarse.zones().borders == pytest.approx(fine.zones().borders, abs=5e-6)
        ours, theirs = ([z.area_fraction for z in eq.zones()] for eq in (coarse, fine))
        assert ours == pytest.approx(theirs, abs=2e-6)


@pytest.mark.parametrize(("degree", "recorded"), [(1, 2.0e-5), (2, 9.6e-8), (3, 5.0e-11)])
def test_borders_converge_at_the_order_of_the_stress(degree, recorded):
    """One order better than the derivative of the solution, as recovered slopes are.

    The error of a border depends on where in its element it lies. So it is averaged over ten borders; with 128 elements as recorded on
    2026-11-24 against 24 elements of degree 8.
    """

    def borders(*mesh):
        return np.array([border for eq in figure_7(100.0, *mesh) for border in eq.zones().borders])

    sizes = (16, 32, 64, 128)
    errors = [np.sqrt(np.mean((borders(n, degree) - borders(24, 8)) ** 2)) for n in sizes]
    order = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order == pytest.approx(degree + 1, abs=0.5)
    assert errors[-1] == pytest.approx(recorded, rel=0.5)


# --- what is asked and answered


def test_criteria():
    scene = fm.Scene(NEO, mesh=fm.disc(4), analysis=fm.Analysis(wrinkling="mechanical"))
    eq = equilibrium(scene, state(scene, lambda s: 0.3 * s * (1 - s), zero))
    assert eq.zones() is eq.zones("mechanical")
    assert eq.zones("total").criterion == "total"
    assert equilibrium(scene.replace(analysis=fm.Analysis()), eq.state).zones().criterion == "total"
    for wrong in ("Total", 3, ["total"]):
        with pytest.raises(fm.InputError, match=r"criterion = .*known: mechanical, total"):
            eq.zones(wrong)
    with pytest.raises(fm.InputError, match="did you mean 'radial'"):
        eq.zones().fraction("radiall")
    branch = fm.Branch(scene, (eq,))
    with pytest.raises(fm.InputError, match="did you mean 'fraction_taut'"):
        branch.column("fraction_tau")


def test_zones_read_well():
    scene = fm.Scene(NEO, mesh=fm.disc(4))
    found = equilibrium(scene, state(scene, lambda s: -0.3 * s * (1 - s), zero)).zones("mechanical")
    assert isinstance(found, Zones)
    assert (len(found), found[-1].kind, len(found[:2])) == (3, "taut", 2)
    lines = str(found).splitlines()
    assert lines[0] == "zones by the signs of the mechanical stresses"
    assert [line.split()[0] for line in lines[1:]] == ["double", "radial", "taut"]
    # areas between the closed-form borders squared
    inner, outer = natural_width(-0.3, 2, 1) ** 2, natural_width(-0.3, 1, 2) ** 2
    assert found.summary == f"radial {100 * (outer - inner):.3g}%, double {100 * inner:.3g}%"


def test_scene_key(tmp_path):
    scene = fm.Scene(NEO, analysis=fm.Analysis(wrinkling="total"))
    scene.to_toml(tmp_path / "scene.toml")
    assert 'wrinkling = "total"' in (tmp_path / "scene.toml").read_text()
    assert fm.Scene.from_toml(tmp_path / "scene.toml") == scene
    assert "analysis" not in fm.Scene(NEO).to_dict()
    for wrong in ("totl", True, ["total"]):
        with pytest.raises(fm.InputError, match=r"analysis\.wrinkling = .*known: mechanical, total"):
            fm.Analysis(wrinkling=wrong)


# --- what a run leaves behind


@pytest.fixture(scope="module")
def asked() -> fm.Branch:
    """Two wrinkled equilibria and a taut one."""
    scene = disc_scene(OGDEN, (100.0, 4.0), 16).replace(analysis=fm.Analysis(("volume",), wrinkling="total"))
    return fm.inflate(scene, volumes=[0.4, 0.6, 1.5])


def test_off_means_off(asked, tmp_path, monkeypatch):
    def refuse(*_):
        raise AssertionError("zones were looked for")

    monkeypatch.setattr(zones_module, "find_zones", refuse)
    scene = asked.scene.replace(analysis=fm.Analysis(("volume",)))
    plain = dataclasses.replace(asked, scene=scene, equilibria=tuple(dataclasses.replace(e, scene=scene, _answers={}) for e in asked))
    written = output.write_run(plain, tmp_path)
    assert not [path for path in tmp_path.iterdir() if "zones" in path.name]
    assert not [path for path in written if "zones" in path.name]
    assert not [name for name in table.columns(plain) if name.startswith("fraction")]
    assert not [name for name in store.to_xarray(plain).variables if str(name).startswith(("fraction", "zone"))]
    assert "zones" not in str(plain)
    from femmembrane.views.plots import plot_profiles

    assert len(plot_profiles(plain).axes[0].get_legend().get_texts()) == 4  # three meridians and the dipole


def test_columns_and_print(asked):
    names = table.columns(asked)
    place = names.index("residual")
    assert names[place - 4 : place] == [f"fraction_{kind}" for kind in ("taut", "radial", "circumferential", "double")]
    for name in names[place - 4 : place]:
        expected = [eq.zones("total").fraction(name.removeprefix("fraction_")) for eq in asked]
        assert asked.to_dataframe()[name].tolist() == asked.column(name).tolist() == expected
    lines = str(asked).splitlines()
    assert lines[0].endswith("zones")
    assert lines[-1].endswith("taut")
    assert lines[1].endswith(asked[0].zones().summary)


def zone_numbers(branch):
    return [(step, z.kind, *z.r, *z.rho, z.area_fraction, z.deformed_area_fraction) for step, eq in enumerate(branch) for z in eq.zones()]


def test_zones_csv(asked, tmp_path):
    write_zones_csv(asked, tmp_path / "zones.csv")
    with (tmp_path / "zones.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["step", "kind", "r_start", "r_end", "rho_start", "rho_end", "area_fraction", "deformed_area_fraction"]
    assert [(int(row.pop("step")), row.pop("kind"), *map(float, row.values())) for row in rows] == zone_numbers(asked)


def test_netcdf(asked, tmp_path):
    import xarray

    asked.save(tmp_path / "branch.nc")
    with xarray.open_dataset(tmp_path / "branch.nc", engine="h5netcdf") as data:
        assert data["zone_r_end"].dims == ("zone",)
        columns = (data[f"zone_{name}"].values.tolist() for name in ZONE_COLUMNS)
        assert list(zip(*columns, strict=True)) == zone_numbers(asked)
        for name in (n for n in map(str, data.variables) if n.startswith(("zone", "fraction"))):
            assert data[name].attrs["units"] == "1"
            assert data[name].attrs["long_name"] not in ("", name)
    loaded = fm.load(tmp_path / "branch.nc")
    assert [eq.zones() for eq in loaded] == [eq.zones() for eq in asked]
    none = dataclasses.replace(asked, equilibria=())
    none.save(tmp_path / "none.nc")
    assert len(fm.load(tmp_path / "none.nc")) == 0


def test_older_file_has_no_zones(asked, tmp_path):
    """A file without a word of wrinkling loads as ever, and its zones can be asked for."""
    dataset = store.to_xarray(asked)
    dataset = dataset.drop_vars([n for n in dataset.variables if str(n).startswith(("zone", "fraction"))])
    dataset.attrs["scene"] = dataset.attrs["scene"].replace('wrinkling = "total"\n', "")
    dataset.to_netcdf(tmp_path / "old.nc", engine="h5netcdf")
    loaded = fm.load(tmp_path / "old.nc")
    assert loaded.scene.analysis.wrinkling is None
    assert loaded[0].zones("total") == asked[0].zones("total")


def test_vtu_shows_zones_at_nodes(asked, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    asked.to_vtk(tmp_path / "m.pvd")
    for path in sorted((tmp_path / "m").glob("*.vtu")):
        grid = pyvista.read(path)
        zone = grid.point_data["zone"]
        assert np.issubdtype(zone.dtype, np.integer)
        s11, s22 = grid.point_data["total_stress_1"], grid.point_data["total_stress_2"]
        np.testing.assert_array_equal(zone, 2 * (s11 < 0) + (s22 < 0))


def test_stale_files_go(asked, tmp_path):
    names = {path.name for path in output.write_run(asked, tmp_path)}
    assert {"zones.csv", "zones.png"} <= names
    output.write_run(dataclasses.replace(asked, equilibria=()), tmp_path)
    assert (tmp_path / "zones.csv").read_text() == ",".join(ZONE_COLUMNS) + "\n"
    assert not (tmp_path / "zones.png").exists()
    output.write_run(dataclasses.replace(asked, scene=asked.scene.replace(analysis=fm.Analysis()), equilibria=()), tmp_path)
    assert not (tmp_path / "zones.csv").exists()


@pytest.mark.parametrize("effects", ["", "[effects]\ntension_field = true\n"])
def test_command_line(tmp_path, effects):
    scene = (
        '[material]\nmodel = "neo-hookean"\n[membrane]\nsusceptibility = 2.5\n[[source]]\nkind = "dipole"\nstrength = 100\nheight = 4\n'
        + "[mesh]\nelements = 12\n[run]\nvalues = [0.4, 0.8]\n"
        + effects
        + '[analysis]\nwrinkling = "total"\n'
    )
    (tmp_path / "scene.toml").write_text(scene)
    assert main(["run", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out")]) == 0
    with (tmp_path / "out" / "branch.csv").open() as file:
        fractions = [[float(row[f"fraction_{kind}"]) for kind in KINDS] for row in csv.DictReader(file)]
    with (tmp_path / "out" / "zones.csv").open() as file:
        rows = list(csv.DictReader(file))
    branch = fm.load(tmp_path / "out" / "branch.nc")
    for step, values in enumerate(fractions):
        parts = [sum(float(row["area_fraction"]) for row in rows if (row["step"], row["kind"]) == (str(step), kind)) for kind in KINDS]
        assert values == pytest.approx(parts, abs=1e-15)
        assert values == [branch[step].zones().fraction(kind) for kind in KINDS]
        assert sum(values) == pytest.approx(1, abs=1e-12)
    assert fractions[0][0] < fractions[1][0]
    assert json.loads((tmp_path / "out" / "run.json").read_text())["scene"]["analysis"] == {"wrinkling": "total"}
    assert (tmp_path / "out" / "zones.png").stat().st_size > 5_000


def test_a_thousand_elements_cost_as_many_points(monkeypatch):
    """The number of points at which stresses are asked for grows with the elements, not faster."""
    counted = []
    monkeypatch.setattr(zones_module, "profile_at", lambda *a: counted.append(a[-1].size) or profile_at(*a))
    totals = []
    for elements in (10, 1000):
        scene = fm.Scene(NEO, mesh=fm.disc(elements))
        counted.clear()
        find_zones(scene, state(scene, lambda s: 0.3 * s * (1 - s), zero), 0.0, "mechanical")
        totals.append(sum(counted))
        assert len(counted) < 10
    assert totals[1] < 100 * totals[0]


def test_one_equilibrium_is_a_folder_too(asked, tmp_path):
    output.write_run(asked[:1], tmp_path)
    assert (tmp_path / "zones.png").stat().st_size > 5_000

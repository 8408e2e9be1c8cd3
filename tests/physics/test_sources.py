"""Loops, solenoids, wires, uniform and tabulated fields: closed forms, digits, derivatives, and membranes beside them."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe, ellipk

import femmembrane as fm
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from femmembrane.physics.magnetics import distance_to_polyline, magnetic_energy_density, magnetic_field, swept
from femmembrane.physics.sources import loop_field
from femmembrane.potential import Family, Potential, potential_of
from femmembrane.potential.expressions import casadi_answers_numpy
from femmembrane.scene.variation import Parameter, names
from femmembrane.solve.contact import Watch, touches_source
from femmembrane.solve.controls import PressureControl
from femmembrane.solve.guess import spherical_dome
from femmembrane.solve.newton import correct
from femmembrane.stability.azimuthal_operator import azimuthal_operator
from femmembrane.stability.profile import profile_at
from femmembrane.views import plots
from tests.cases import OGDEN, disc_scene
from tests.stability.test_azimuthal import Cap

RADII, HEIGHTS = np.linspace(0, 2.0, 12), np.linspace(-1.0, 2.5, 16)


def table_of(source, **more):
    h_rho, h_z, _ = source.field(*np.meshgrid(RADII, HEIGHTS, indexing="ij"))
    return fm.Tabulated(RADII, HEIGHTS, h_rho, h_z, **more)


LOOP = fm.Loop(200.0, 5.0, 1.5)
SOLENOID = fm.Solenoid(200.0, 5.5, 0.5, 1.0, orientation=-1)
TABLE = table_of(LOOP, tolerance=1e-9)
WIRE = fm.Wire(3.0)
ALL = {"loop": LOOP, "solenoid": SOLENOID, "uniform": fm.Uniform(0.3), "tabulated": TABLE, "wire": WIRE, "dipole": fm.Dipole(200.0, 6.5)}
everyone = pytest.mark.parametrize("name", ALL)
POINTS = [(0.2, 0.1), (0.9, 0.4), (1.5, 1.7), (1e-3, 0.9)]


# --- closed forms


@pytest.mark.parametrize("a", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("rho", [0.05, 0.7, 0.999, 1.01, 4.0])
@pytest.mark.parametrize("z", [-2.0, 0.01, 0.6])
def test_loop_is_the_textbook_expression(a, rho, z):
    """With complete elliptic integrals; Smythe, Static and Dynamic Electricity, 7.10, in which mu0 I/(2 pi) is 2 sqrt(M)/(pi a^2) here."""
    far, near = (a + rho) ** 2 + z**2, (a - rho) ** 2 + z**2
    K, E = ellipk(4 * a * rho / far), ellipe(4 * a * rho / far)
    unit = 4 / (np.pi * a**2) / 2 / np.sqrt(far)
    h_z = unit * (K + (a**2 - rho**2 - z**2) / near * E) * 1.0
    h_rho = unit * z / rho * (-K + (a**2 + rho**2 + z**2) / near * E)
    found = loop_field(a, rho, z)
    size = 1e-12 * np.hypot(h_rho, h_z)  # the textbook's differences lose digits near the axis
    assert found[1] == pytest.approx(h_z, rel=1e-12, abs=size)
    assert found[0] == pytest.approx(h_rho, rel=1e-11, abs=size)


def exact_loop(a, rho, z, n=4096):
    """The integrals around the loop in extended precision by the trapezoidal rule, which converges geometrically."""
    f = 2 * np.pi * np.arange(n, dtype=np.longdouble) / n
    a, rho, z = (np.longdouble(v) for v in (a, rho, z))
    cube = (a * a + rho * rho + z * z - 2 * a * rho * np.cos(f)) ** np.longdouble(1.5)
    # cos f/cube integrates to order rho: subtracting the mean of 1/cube's value at rho = 0 changes nothing and keeps the digits
    h_rho = 2 * z / a * (np.cos(f) * (1 / cube - 1 / (a * a + rho * rho + z * z) ** np.longdouble(1.5))).mean()
    return float(h_rho), float(2 / a * ((a - rho * np.cos(f)) / cube).mean())


@pytest.mark.parametrize(
    ("a", "rho", "z", "digits"),
    [
        (0.5, 1e-7, 0.2, 1e-11),  # extended precision has 19 digits, and rho takes seven of them
        (0.5, 1e-3, 0.2, 1e-14),
        (0.01, 0.5, 3.0, 1e-13),  # far away the integrals nearly cancel
        (0.5, 0.5, 0.02, 1e-14),  # next to the wire
        (0.5, 0.49, 0.001, 1e-13),
        (5.0, 0.8, 0.3, 1e-14),
    ],
)
def test_loop_keeps_its_digits(a, rho, z, digits):
    found, exact = loop_field(a, rho, z), exact_loop(a, rho, z)
    assert found[0] == pytest.approx(exact[0], rel=digits)
    assert found[1] == pytest.approx(exact[1], rel=digits)


@pytest.mark.parametrize("z", [-4.0, -0.1, 0.0, 3.0])
def test_on_the_axis(z):
    """Loop: 2 sqrt(M)/(a^2 + z^2)^(3/2); solenoid: the mean of that over its length; the radial component is 0."""
    a, length = 1.5, 1.0
    assert fm.Loop(9.0, 0.0, a).field(0.0, z) == (0, pytest.approx(6 / (a**2 + z**2) ** 1.5, rel=1e-14), 0)
    up, down = z + length / 2, z - length / 2
    expected = 6 / (length * a**2) * (up / np.hypot(up, a) - down / np.hypot(down, a))
    assert fm.Solenoid(9.0, 0.0, a, length, loops=12).field(0.0, z) == (0, pytest.approx(expected, rel=1e-12), 0)


@pytest.mark.parametrize(("rho", "z"), [(0.5, 1.4), (2.0, 0.1), (0.0, 2.0)])
def test_solenoid_is_an_integral_over_loops(rho, z):
    one = fm.Solenoid(1.0, 0.0, 0.8, 1.0, loops=16)
    for k in range(2):
        expected = quad(lambda t: loop_field(0.8, rho, z - t)[k], -0.5, 0.5, epsabs=1e-14, epsrel=1e-13)[0]  # noqa: B023  # used at once
        assert one.field(rho, z)[k] == pytest.approx(expected, rel=1e-10, abs=1e-13)


def test_inside_a_long_solenoid_the_field_is_uniform():
    """h_z = m/(pi a^2 l) with m = 4 pi sqrt(M) for a dipole's D = m/(4 pi): 4 sqrt(M)/(a^2 l), less by 2 a^2/l^2."""
    a, length = 0.5, 8.0
    h = fm.Solenoid(9.0, 0.0, a, length, loops=64).field(np.array([0.0, 0.1]), np.zeros(2))
    assert h[1] == pytest.approx(4 * 3 / (a**2 * length) / np.sqrt(1 + 4 * a**2 / length**2), rel=1e-3)


@pytest.mark.parametrize("make", [lambda r: fm.Loop(4.0, 1.0, r), lambda r: fm.Solenoid(4.0, 1.0, r, r)])
def test_far_away_it_is_a_dipole_of_the_same_strength(make):
    """Relative error of order (radius/distance)^2."""
    rho, eta = np.array([0.0, 0.6, 2.0]), np.array([3.0, 2.5, 0.3])
    expected = fm.Dipole(4.0, 1.0).field(rho, eta)[:2]
    errors = [max(np.abs(np.subtract(make(r).field(rho, eta)[:2], expected)).ravel() / np.hypot(*expected).max()) for r in (0.02, 0.01)]
    assert errors[1] < 1e-3
    assert 3.9 < errors[0] / errors[1] < 4.1


@everyone
@pytest.mark.parametrize("point", POINTS)
def test_no_divergence_and_no_curl(name, point):
    source, (rho, eta), d = ALL[name], point, 1e-4
    right, left, up, down = (source.field(rho + i * d, eta + j * d) for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1)))
    scale = np.linalg.norm(source.field(rho, eta)) / min(rho, 1) + abs(right[1])
    divergence = ((rho + d) * right[0] - (rho - d) * left[0]) / (2 * d * rho) + (up[1] - down[1]) / (2 * d)
    curl = (up[0] - down[0]) / (2 * d) - (right[1] - left[1]) / (2 * d)
    axial_curl = ((rho + d) * right[2] - (rho - d) * left[2]) / (2 * d * rho)
    assert max(abs(divergence), abs(curl), abs(axial_curl)) < 1e-6 * scale


@everyone
def test_casadi_differentiates_it_exactly(name):
    """Energy density and gradient against NumPy with a complex step; second derivatives against differences of the gradient."""
    y = ca.SX.sym("y", 2)
    with casadi_answers_numpy():
        energy = magnetic_energy_density([ALL[name]], 2.5, y[0], y[1])
    hessian, gradient = ca.hessian(energy, y)
    function = ca.Function("f", [y], [ca.densify(ca.vertcat(energy, gradient, ca.vec(hessian)))])

    def at(rho, eta):
        return np.array(function([rho, eta])).ravel()

    for rho, eta in POINTS:
        found, step, h = at(rho, eta), 1e-30j, 1e-6
        size = abs(found[0])
        steps = np.array([0, step, 0]), np.array([0, 0, step])
        values = magnetic_energy_density([ALL[name]], 2.5, rho + steps[0], eta + steps[1])
        assert found[0] == pytest.approx(values[0].real, rel=1e-13)
        assert found[1:3] == pytest.approx(values[1:].imag / 1e-30, rel=1e-10, abs=1e-12 * size)
        along = [(at(rho + i * h, eta + j * h)[1:3] - at(rho - i * h, eta - j * h)[1:3]) / (2 * h) for i, j in ((1, 0), (0, 1))]
        assert found[3:] == pytest.approx(np.ravel(along), rel=1e-5, abs=1e-6 * size / min(rho, 1) ** 2)


def test_sums_superpose_and_orientations_cancel():
    rho, eta = np.array([0.3, 0.9]), np.array([0.1, 0.5])
    sources = [LOOP, SOLENOID, fm.Uniform(0.3), WIRE, fm.Dipole(200.0, 6.5)]
    total = magnetic_field(sources, rho, eta)
    assert np.array(total) == pytest.approx(sum(np.array([c + 0 * rho for c in s.field(rho, eta)]) for s in sources))
    assert magnetic_energy_density(sources, 2.0, rho, eta) == pytest.approx(-(np.array(total) ** 2).sum(axis=0))
    opposite = [fm.Loop(9.0, 2.0, 0.7), fm.Loop(9.0, 2.0, 0.7, orientation=-1), fm.Wire(2.0), fm.Wire(2.0, orientation=-1)]
    assert magnetic_energy_density(opposite, 2.5, rho, eta) == pytest.approx([0, 0], abs=1e-30)


# --- tables


def test_table_reproduces_its_field_between_its_points():
    rho, z = np.random.default_rng(0).uniform([[0], [-1]], [[2], [2.5]], (2, 100))
    found, expected = TABLE.field(rho, z), LOOP.field(rho, z)
    assert np.abs(np.subtract(found[:2], expected[:2])).max() < 1e-8 * np.abs(expected[1]).max()
    assert np.isnan(TABLE.field(np.array([2.1, 0.5, 0.5]), np.array([0.0, 2.6, -1.1]))[1]).all()
    assert np.isnan(TABLE.field(0.5, 2.6)[1])


def test_table_smooths_noise():
    """One part in a thousand of noise at 192 points: the fit is nearer to the truth than its points are."""
    noise = np.random.default_rng(1).normal(size=(2, RADII.size, HEIGHTS.size)) * 1e-3
    grid = np.meshgrid(RADII, HEIGHTS, indexing="ij")
    exact = np.array(LOOP.field(*grid)[:2])
    size = np.abs(exact).max()
    table = fm.Tabulated(RADII, HEIGHTS, *(exact + size * noise / 3), tolerance=1.3e-3)
    assert (np.array(table.field(*grid)[:2]) - exact).std() < 0.8 * (size * noise / 3).std()
    with pytest.raises(fm.InputError, match=r"source.h_rho = '192 points': no field in free space is closer to them than 0.0"):
        fm.Tabulated(RADII, HEIGHTS, *(exact + size * noise / 3), tolerance=1e-5)


def test_table_with_a_source_in_it_is_refused():
    with pytest.raises(fm.InputError, match="leave out the neighbourhood of magnets and currents"):
        table_of(fm.Loop(1.0, 0.53, 0.77), tolerance=1e-3)


def test_table_from_a_file(tmp_path):
    rho, z = (a.ravel() for a in np.meshgrid(RADII, HEIGHTS, indexing="ij"))
    columns = np.column_stack([rho, z, *LOOP.field(rho, z)[:2]])
    path = tmp_path / "field.csv"
    np.savetxt(path, np.random.default_rng(0).permutation(columns), delimiter=",", header="rho,z,h_rho,h_z", comments="", fmt="%.17g")
    assert fm.Tabulated.from_csv(path, tolerance=1e-9) == TABLE
    np.savetxt(path, columns[1:], delimiter=",", header="rho,z,h_rho,h_z", comments="")
    with pytest.raises(fm.InputError, match="every radius with every height is needed, once: 12 x 16"):
        fm.Tabulated.from_csv(path)
    with pytest.raises(fm.InputError, match="a CSV file with columns rho, z, h_rho, h_z"):
        fm.Tabulated.from_csv(tmp_path / "missing.csv")


# --- what is refused


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fm.Loop(-1.0, 1.0, 1.0), r"source.strength = -1.0"),
        (lambda: fm.Loop(1.0, np.nan, 1.0), r"source.height = nan"),
        (lambda: fm.Loop(1.0, 1.0, 0.0), r"source.radius = 0.0: a finite number > 0"),
        (lambda: fm.Solenoid(1.0, 1.0, 1.0, -2.0), r"source.length = -2.0"),
        (lambda: fm.Solenoid(1.0, 1.0, 1.0, 1.0, loops=0), r"source.loops = 0"),
        (lambda: fm.Wire(1.0, orientation=0), r"source.orientation = 0"),
        (lambda: fm.Uniform(True), r"source.strength = True"),
        (lambda: fm.Tabulated([0, 1], HEIGHTS, [[0.0]], [[0.0]]), r"source.rho = \[0, 1\]: three or more increasing"),
        (lambda: fm.Tabulated(RADII, HEIGHTS, [[0.0]], [[0.0]]), r"source.h_rho = 'shape \(1, 1\)': one row for each radius"),
        (lambda: fm.Tabulated(RADII, HEIGHTS, [[0.0], [0.0, 1.0]], [[0.0]]), r"source.h_rho = .* lists of finite numbers"),
        (lambda: table_of(LOOP, tolerance=1.0), r"source.tolerance = 1.0"),
    ],
)
def test_unusable_numbers(make, message):
    with pytest.raises(fm.InputError, match=message):
        make()


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (fm.Wire(1.0), r"source.kind = Wire.*pierces the pole; a membrane without a pole is allowed"),
        (fm.Loop(1.0, 0.0, 0.53), r"source.height = 0.0: the source lies on the membrane"),
        (fm.Loop(1.0, 0.0, 1.0), r"source.height = 0.0: the source lies on the membrane"),
        (fm.Tabulated(RADII / 4, HEIGHTS, *np.zeros((2, 12, 16))), r"source.rho = \(0.0, .*the table must cover the undeformed membrane"),
    ],
)
def test_sources_in_the_membrane(source, message):
    with pytest.raises(fm.InputError, match=message):
        disc_scene(elements=8).replace(sources=[source])


def test_a_loop_around_the_membrane_is_allowed():
    assert disc_scene(elements=8).replace(sources=[fm.Loop(1.0, 0.0, 1.2)]).sources


def test_scene_files(tmp_path):
    scene = disc_scene(elements=4).replace(sources=[LOOP, SOLENOID, fm.Uniform(0.3), TABLE])
    scene.to_toml(tmp_path / "scene.toml")
    assert fm.Scene.from_toml(tmp_path / "scene.toml") == scene
    with pytest.raises(fm.InputError, match=r"source.radius = None: missing"):
        fm.Scene.from_dict({"material": {"model": "varga"}, "source": [{"kind": "loop", "strength": 1.0, "height": 3.0}]})


# --- membranes


def magnetic_scene(*sources, elements=16, degree=5):
    return disc_scene(OGDEN, elements=elements, degree=degree).replace(sources=sources)


@pytest.mark.parametrize(
    "sources",
    [(fm.Loop(20.0, 3.0, 1.2),), (fm.Solenoid(20.0, 3.5, 0.5, 0.6, loops=2),), (fm.Dipole(90.0, 4.0), fm.Uniform(0.1)), (TABLE,)],
    ids=["loop", "solenoid", "dipole in a uniform field", "table"],
)
def test_shooting_agrees(sources):
    scene = magnetic_scene(*sources)
    eq = fm.equilibrium(scene, center_height=1.2)
    found = shoot(scene, center_height=1.2, guess=Guess.of(eq))
    assert found.converged
    assert (eq.pressure, eq.volume) == pytest.approx((found.pressure, found.volume), rel=1e-8)
    assert eq.magnetic_energy == pytest.approx(found.magnetic_energy, rel=1e-8)
    plain = fm.equilibrium(disc_scene(OGDEN, elements=16, degree=5), center_height=1.2)
    assert abs(eq.pressure - plain.pressure) > 1e-4  # the source is felt


def test_a_small_loop_is_felt_as_a_dipole():
    """Difference of order radius^2 in P."""
    dipole = fm.equilibrium(magnetic_scene(fm.Dipole(200.0, 4.0)), volume=2.0).pressure
    errors = [abs(fm.equilibrium(magnetic_scene(fm.Loop(200.0, 4.0, r)), volume=2.0).pressure - dipole) for r in (0.1, 0.05)]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


def test_a_uniform_field_alone_exerts_no_force():
    plain = fm.equilibrium(disc_scene(OGDEN, elements=8), volume=2.0)
    eq = fm.equilibrium(disc_scene(OGDEN, elements=8).replace(sources=[fm.Uniform(5.0)]), volume=2.0)
    assert eq.pressure == pytest.approx(plain.pressure, rel=1e-12)
    assert eq.magnetic_energy == pytest.approx(-np.pi * 2.5 / 2 * 5.0, rel=1e-12)


class Gradient(fm.Source):
    """h = k (-rho/2, z), the field around the middle of two opposite coils: all that a source of one's own needs."""

    def __init__(self, k):
        self.k = k

    def field(self, rho, eta):
        return -self.k * rho / 2, self.k * eta, 0.0


def test_a_source_of_ones_own():
    scene = magnetic_scene(Gradient(0.2))
    eq = fm.equilibrium(scene, volume=2.0)
    assert eq.pressure == pytest.approx(shoot(scene, volume=2.0, guess=Guess.of(eq)).pressure, rel=1e-8)
    assert eq.verdict(azimuthal=1).stable is True
    assert scene.to_dict()["source"] == [{"kind": f"{__name__}:Gradient", "k": 0.2}]  # files: tests/scene/test_own.py
    with pytest.raises(fm.InputError, match="derived from Source"):
        magnetic_scene(type("Mine", (), {"field": Gradient.field})())


def test_a_membrane_cannot_leave_its_table():
    scene = magnetic_scene(TABLE, elements=8, degree=3)
    with pytest.raises(fm.SolveError) as raised:
        fm.equilibrium(scene, center_height=2.7)
    assert raised.value.status is fm.Status.STEP_UNDERFLOW
    assert fm.equilibrium(scene, center_height=2.2).center_height == pytest.approx(2.2, rel=1e-12)


@pytest.mark.parametrize(("elements", "degree"), [(96, 3), (32, 6)])
def test_no_branch_goes_through_a_wire(elements, degree):
    """A loop around the axis above the rim: the membrane swells towards it and is drawn there until its meridian is compressed.

    With 16 and 24 cubic elements stresses are compressive from V = 2.07 and 1.96 on, with 96 from 1.817 on (recorded on 2026-11-28).
    """
    scene = magnetic_scene(fm.Loop(1.0, 1.0, 1.3), elements=elements, degree=degree)
    branch = fm.trace(scene, start=0.5, until={"volume": 30.0}, throw=False)
    assert branch.status is fm.Status.LEGENDRE_FAILURE
    assert 1.7 < branch[-1].volume < 1.82
    assert [p.kind for p in branch.special_points] == ["limit_point", "height_fold", "volume_fold"]
    assert not any(potential_of(scene).passed_source(branch[0].state, eq.state) for eq in branch)


def test_a_step_across_a_wire_is_noticed():
    """Two domes on either side of the circle, or both on one."""
    potential = potential_of(magnetic_scene(fm.Loop(1.0, 1.0, 0.7), elements=4, degree=2))
    low, high, higher = (spherical_dome(potential, volume) for volume in (1.0, 4.0, 5.0))
    assert potential.passed_source(low, high)
    assert potential.passed_source(high, low)
    assert not potential.passed_source(high, higher)


def test_the_region_between_two_meridians():
    before = np.array([[0.0, 1.0, 2.0], [1.0, 1.0, 0.0]])
    after = before + np.array([[0.0], [0.5]])
    assert swept(before, after, (0.7, 1.2))
    assert swept(after, before, (0.7, 1.2))
    assert not swept(before, after, (0.7, 1.6))
    assert not swept(before, after, (0.7, 0.9))
    assert not swept(before, before, (0.7, 1.2))
    assert distance_to_polyline(*before, (0.5, 1.3)) == pytest.approx(0.3)
    assert distance_to_polyline(*before, (3.0, 0.0)) == pytest.approx(1.0)


def test_distances():
    rho, eta = np.array([0.5, 2.0]), np.array([3.2, 5.0])
    assert fm.Loop(1.0, 3.0, 1.0).distance_squared(rho, eta) == pytest.approx([0.29, 5.0])
    assert fm.Solenoid(1.0, 3.0, 1.0, 2.0).distance_squared(rho, eta) == pytest.approx([0.25, 2.0])  # from the wall, 2 to 4
    assert fm.Wire(1.0).distance_squared(rho, eta) == pytest.approx([0.25, 4.0])
    assert np.isinf(fm.Uniform(1.0).distance_squared(rho, eta)).all()
    potential = potential_of(magnetic_scene(fm.Loop(1.0, 0.3, 0.5), elements=16))
    assert potential.distance_to_sources(np.zeros(potential.space.n_free)) == pytest.approx(0.3, rel=1e-3)


@pytest.mark.parametrize("name", ["source.0.radius", "source.0.height", "source.1.length", "source.1.strength", "membrane.susceptibility"])
def test_every_number_of_a_source_can_be_followed(name):
    scene = magnetic_scene(fm.Loop(20.0, 3.0, 1.2), fm.Solenoid(9.0, -3.0, 0.5, 0.6, loops=2), elements=4, degree=2)
    assert name in names(scene)
    parameter = Parameter(scene, name)
    value = 1.1 * parameter.value
    family, member = Family(scene, parameter.vary), Potential(parameter.scene_at(value))
    x = 0.01 * np.random.default_rng(0).normal(size=family.space.n_free)
    one, other = family.evaluate(x, 1.0, value), member.evaluate(x, 1.0)
    assert one.magnetic_energy == pytest.approx(other.magnetic_energy, rel=1e-12)
    assert one.gradient == pytest.approx(other.gradient, rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("name", ["loop", "solenoid", "tabulated"])
def test_waves_around_the_axis_feel_the_second_derivatives(name):
    """At n = 0 the operator is the axisymmetric one, entry by entry, for any source."""
    potential = potential_of(magnetic_scene(ALL[name], elements=4, degree=2))
    x = spherical_dome(potential, 1.0)
    band = potential.evaluate(x, 1.3).band
    np.testing.assert_allclose(azimuthal_operator(potential, x, 1.3, 0).band, band, rtol=0, atol=1e-11 * np.abs(band).max())


def test_sources_far_off_are_not_measured_again(monkeypatch):
    """A dome that rises to a dipole, and is moved sideways by its points as well: it touches where its distance says so."""
    potential = potential_of(magnetic_scene(degree=3).replace(sources=[fm.Dipole(200.0, 6.5)]))
    space, measured = potential.space, []
    r = space.mesh.position(space.interpolation_points())[0]
    states = [space.interpolate(0.1 * h * r * (1 - r), h * (1 - r**2)) for h in [*np.linspace(0.0, 6.4, 60), 6.49, 6.4985, 6.4992]]
    expected = [touches_source(potential.distance_to_sources(x), space.unit) for x in states]
    assert [bool(words) for words in expected] == [False] * 62 + [True]
    distance = Potential.distance_to_sources
    monkeypatch.setattr(Potential, "distance_to_sources", lambda self, x: measured.append(1) or distance(self, x))
    watch = Watch()
    assert [watch.touches(potential, x) for x in states] == expected
    assert len(measured) < len(states) / 2


def test_a_wire_through_a_membrane_with_a_hole():
    """The wire pulls the membrane inwards. On a cap that is cut open, clamped at both rims: forces balance, and |h|^2 = M/rho^2."""
    scene = magnetic_scene(degree=4).replace(mesh=Cap(inner=0.3)).replace(sources=[fm.Wire(0.03)])
    potential = potential_of(scene)
    rest = np.zeros(potential.space.n_free)
    first = potential.evaluate(rest, 0.0)
    angle = potential.space.mesh.breakpoints()[[0, -1]] * (2 + potential.space.mesh.breakpoints()[[0, -1]]) / 3
    # -pi chi M Int R dS/R^2 with R = sin(angle)/sin 1 and dS = d(angle)/sin 1: the radius cancels
    expected = -np.pi * 2.5 * 0.03 * np.diff(np.log(np.tan(angle / 2)))[0]
    assert first.magnetic_energy == pytest.approx(expected, rel=1e-7)
    s = potential.space.interpolation_points()
    bump, angle = 2 * (s - 0.3) * (1 - s), s * (2 + s) / 3
    result = correct(
        potential, PressureControl(2.0), potential.space.interpolate(bump * np.sin(angle), bump * np.cos(angle)), 2.0, damped=True
    )
    assert result.status is fm.Status.CONVERGED
    assert potential.distance_to_sources(result.x) > 0.2
    assert not potential.passed_source(rest, result.x)
    with_wire, without = (profile_at(s, result.x, 2.0, np.array([0.5])) for s in (scene, scene.replace(sources=())))
    around = 0.03 / with_wire.rho**2
    assert with_wire.total[0] - without.total[0] == pytest.approx(-around / 2, rel=1e-9)
    assert with_wire.total[1] - without.total[1] == pytest.approx(3.0 * around, rel=1e-9)
    rho, eta = np.array([0.4, 1.3]), np.array([0.2, -0.1])
    m = -2.5 / 2 * 0.03 / rho**2
    assert potential.field_energy(rho, eta) == pytest.approx(np.array([m, -2 * m / rho, 0 * m, 6 * m / rho**2, 0 * m, 0 * m]), rel=1e-13)


def test_what_sources_cost():
    """Operations at a point, recorded on 2026-11-24: 340 for a dipole, 1919 a loop, 2200 with a dipole beside it, 3580 a table."""
    count = {name: Potential(magnetic_scene(source, elements=2)).operations for name, source in ALL.items() if name != "wire"}
    plain = Potential(magnetic_scene(elements=2)).operations
    assert count["uniform"] - plain < 20
    assert count["dipole"] - plain < 110
    assert count["loop"] - plain < 1800


def test_pictures(tmp_path):
    branch = fm.inflate(magnetic_scene(fm.Loop(20.0, 3.0, 1.5), fm.Uniform(0.1), elements=8, degree=3), volumes=[2.0], solver="newton")
    figure = plots.plot_profiles(branch, tmp_path / "profiles.png")
    marks = [line.get_xydata().tolist() for line in figure.axes[0].lines if line.get_marker() == "o" and len(line.get_xdata())]
    assert marks == [[[1.5, 3.0]], [[-1.5, 3.0]]]
    fm.render(branch, tmp_path / "membrane.png", size=(300, 200))
    assert (tmp_path / "membrane.png").stat().st_size > 1000


@pytest.mark.parametrize("answer", [(1.0, 2.0), (1.0, 2.0, 3.0, 4.0), 1.0])
def test_a_field_of_ones_own_with_other_than_three_components_is_named(answer: object) -> None:
    class Own(fm.Source):
        def field(self, rho, eta):
            return answer

    with pytest.raises(fm.InputError, match=r"Own.*three components"):
        fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(4), sources=[Own()], susceptibility=1.0)

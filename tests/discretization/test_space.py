"""The finite-element space and its quadrature."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.discretization.elements import shape_functions
from femmembrane.discretization.meridian import Disc
from femmembrane.discretization.space import Space
from femmembrane.potential import Potential
from femmembrane.solve.banded import band_product
from femmembrane.solve.controls import VolumeControl
from femmembrane.solve.newton import correct
from tests.cases import POINTS, disc_scene

DEGREES = (1, 2, 3, 4, 6, 8)
MESHES = [Disc(5), Disc(radii=np.linspace(0, 1, 6) ** 1.5)]


def polynomial(space: Space) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients of a displacement that the space holds exactly and that respects the supports, with u and w as polynomials."""
    linear = space.degree == 1
    u = np.polynomial.Polynomial([0.0] if linear else [0, 0.3, -0.3])
    w = np.polynomial.Polynomial([1, -1] if linear else [1, 0, -1])
    s = space.interpolation_points()
    return space.interpolate(u(s), w(s)), u, w


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("degree", DEGREES)
def test_polynomials_are_reproduced(degree, mesh):
    space = Space(mesh, degree)
    x, u, w = polynomial(space)
    s = np.linspace(0, 1, 37)
    for found, expected in zip(space.evaluate(x, s), (u(s), u.deriv()(s), w(s), w.deriv()(s)), strict=True):
        assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("degree", DEGREES)
def test_mass_integrates_to_the_area(degree, mesh):
    """Int w^2 2 pi r dr: with w = 1 - r^2 it is pi/3 (degree 2 and more), with w = 1 - r pi/6 (degree 1)."""
    space = Space(mesh, degree)
    w = polynomial(space)[2]
    s = space.interpolation_points()
    x = space.interpolate(np.zeros_like(s), w(s))
    expected = np.pi / 6 if degree == 1 else np.pi / 3
    assert x @ band_product(space.mass_band(), space.half_bandwidth, x) == pytest.approx(expected, rel=1e-13)
    potential = Potential(disc_scene(degree=degree).replace(mesh=mesh))
    assert potential.area == pytest.approx(np.pi, rel=1e-13)
    assert (space.weights * space.R * space.R_x).sum() == pytest.approx(np.pi, rel=1e-13)


@pytest.mark.parametrize("degree", DEGREES)
def test_supports(degree):
    space = Space(Disc(4), degree)
    x = np.random.default_rng(0).normal(size=space.n_free)
    u, _, w, _ = space.evaluate(x, [0.0, 1.0])
    assert u == pytest.approx([0, 0], abs=1e-14)
    assert w == pytest.approx([x[space.pole], 0], abs=1e-14)
    assert space.center_height(x) == x[space.pole]
    # two displacements at each node, less u at the pole and both at the rim
    assert space.n_free == 2 * (4 * degree + 1) - 3
    numbers = np.arange(space.n_free)
    assert sorted(np.concatenate([numbers[index] for index in space.fields])) == list(numbers)


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("degree", DEGREES)
def test_three_ways_to_evaluate_agree(degree, mesh):
    """Table at the quadrature points, sparse matrix (for IPOPT), and free evaluation."""
    space = Space(mesh, degree)
    x = np.random.default_rng(1).normal(size=space.n_free)
    table = space.at_quadrature(x).reshape(4, -1)
    assert (space.evaluation_matrix() @ x).reshape(4, -1) == pytest.approx(table, abs=1e-11)
    u, u_s, w, w_s = space.evaluate(x, space.s.ravel())
    size = np.broadcast_to(np.diff(mesh.breakpoints()), space.s.shape).ravel()
    assert table == pytest.approx(np.array([u, u_s * size, w, w_s * size]), abs=1e-11)


@pytest.mark.parametrize("degree", DEGREES)
def test_two_ways_to_assemble_agree(degree):
    """Band storage (Newton) and the sparse linear map (IPOPT)."""
    space = Space(Disc(4), degree)
    density = np.random.default_rng(2).normal(size=(10 * space.n_quadrature, space.n_elements))
    band, kd = space.assemble_band(density), space.half_bandwidth
    rows, columns, matrix = space.hessian_matrix()
    assert matrix @ density.ravel() == pytest.approx(band[2 * kd + rows - columns, columns], abs=1e-11)
    assert matrix @ density.ravel() == pytest.approx(band[2 * kd + columns - rows, rows], abs=1e-11)  # symmetric
    assert not band[:kd].any()  # room for the fill of pivoting


def test_nodes_run_along_the_meridian():
    space = Space(Disc(4), 3)
    nodes = space.node_parameters()
    assert nodes.size == 13
    assert np.all(np.diff(nodes) > 0)
    assert (nodes[0], nodes[-1]) == (0, 1)


# --- graded meshes

RATIOS = (1e-6, 1e-3, 0.5, 1 - 1e-15, 1 + 1e-9, 20, 1e6)


@pytest.mark.parametrize("elements", [1, 2, 3, 64, 1001])
@pytest.mark.parametrize("ratio", RATIOS)
def test_sizes_follow_a_geometric_progression(ratio, elements):
    """Ends within a few units of round-off of (q^k - 1)/(q^n - 1) in 60 digits, relative to the distance from the pole."""
    ends = fm.disc(elements, ratio).breakpoints()
    with localcontext() as context:
        context.prec = 60
        size = [Decimal(ratio) ** (Decimal(k) / max(elements - 1, 1)) for k in range(elements)]
        exact = [sum(size[:k], Decimal(0)) / sum(size) for k in range(elements + 1)]
        error = [abs(Decimal(float(end)) - e) for end, e in zip(ends, exact, strict=True)]
    assert (ends[0], ends[-1], ends.size) == (0, 1, elements + 1)
    assert (np.diff(ends) > 0).all()
    assert all(float(d) <= 3e-15 * float(e) for d, e in zip(error, exact, strict=True))


def test_one_element_or_ratio_one_is_the_uniform_mesh():
    assert list(fm.disc(1, ratio=1e3).breakpoints()) == [0, 1]
    assert fm.disc(8, ratio=1) == fm.disc(8)
    assert fm.disc().elements == 64


@pytest.mark.parametrize("mesh", [fm.disc(5), fm.disc(5, ratio=1e-6), fm.disc(5, ratio=1e6), fm.disc(radii=[0, 0.1, 0.7, 1])])
def test_refined_halves_every_element(mesh):
    ends, finer = mesh.breakpoints(), mesh.refined()
    assert finer.elements == 2 * mesh.elements
    assert finer.breakpoints()[::2] == pytest.approx(ends, rel=1e-15, abs=0)
    sizes = np.diff(finer.breakpoints())
    assert sizes[::2] == pytest.approx(sizes[1::2], rel=1e-8)  # next to the rim sizes of 1e-7 are differences of numbers near 1
    assert sizes[::2] + sizes[1::2] == pytest.approx(np.diff(ends), rel=1e-8)


def on_graded(name: str, degree: int, ratio: float, elements: int = 64) -> tuple[fm.Equilibrium, dict]:
    point = next(p for p in POINTS if p.name == name)
    scene = point.scene.replace(mesh=fm.disc(elements, ratio), degree=degree)
    return fm.equilibrium(scene, volume=point.expected["volume"], solver="newton"), dict(point.expected)


#: bounds on the relative errors of P and of the eigenvalues; recorded on 2026-11-24 with ratios 1e-6 and 1e6: at most 2.0e-2 and 4.8e-2,
#: 3.0e-4 and 3.0e-3, 3.4e-6 and 3.7e-5, 1.5e-8 and 4.4e-7, 1.1e-12 and 9.5e-11, 2.3e-14 and 8.9e-12. One element covers a fifth of the
#: radius: coarse for degree 1, and at degree 8 as good as the uniform mesh (2e-14 and 9e-12)
GRADED = {1: (3e-2, 0.15), 2: (4e-4, 4e-3), 3: (5e-6, 5e-5), 4: (2e-8, 6e-7), 6: (5e-12, 3e-10), 8: (1e-13, 3e-11)}


@pytest.mark.parametrize("ratio", [1e-6, 1e6])
@pytest.mark.parametrize("degree", GRADED)
@pytest.mark.parametrize("name", ["ogden_disc-4", "dipole_above-0.5", "dipole_below-0.5"])
def test_strong_grading_costs_no_digits(name, degree, ratio):
    eq, expected = on_graded(name, degree, ratio)
    assert eq.residual < 1e-12
    assert eq.pressure == pytest.approx(expected["pressure"], rel=GRADED[degree][0])
    assert eq.elastic_energy + eq.magnetic_energy == pytest.approx(
        expected["elastic_energy"] + expected["magnetic_energy"], rel=GRADED[degree][0]
    )
    for control in ("pressure", "volume"):
        verdict = eq.verdict(control)
        assert verdict.smallest_eigenvalue == pytest.approx(expected[f"lambda_{control}"], rel=GRADED[degree][1])
        assert verdict.stable is (expected[f"lambda_{control}"] > 0)


@pytest.mark.parametrize("degree", [4, 8])
@pytest.mark.parametrize("ratio", [1, 1e-3, 1e-6, 1e6])
@pytest.mark.parametrize("name", ["ogden_disc-4", "dipole_above-0.5", "dipole_below-0.5"])
def test_every_eigenvalue_is_proved_the_smallest(name, ratio, degree):
    """Many unknowns that are all of one kind or very stiff ones must not keep the proof by inertia from succeeding, or make it void."""
    eq, expected = on_graded(name, degree, ratio)
    verdict = eq.verdict("volume")
    assert verdict.smallest_eigenvalue == pytest.approx(expected["lambda_volume"], rel=1e-6)
    assert verdict.error < 1e-5


@pytest.mark.parametrize("ratio", [1e-6, 1e6])
@pytest.mark.parametrize("key", ["rho", "eta", "stretch_1", "stretch_2", "total_stress_1", "total_stress_2"])
def test_profile_on_graded_meshes(key, ratio):
    eq, expected = on_graded("dipole_below-0.5", 8, ratio)
    profile = expected["profile"]
    assert eq.profile(profile["r"])[key] == pytest.approx(np.array(profile[key]), rel=1e-10)
    nodes = eq.profile()
    assert (np.diff(nodes["r"]) > 0).all()
    assert np.isfinite(nodes[key]).all()


def test_arc_length_does_not_depend_on_the_grading():
    """The same number of steps, lengths (3.9062666 on the uniform mesh, recorded on 2026-11-24) and limit points."""
    scene = next(p for p in POINTS if p.scene_name == "dipole_above").scene.replace(degree=8)
    branches = [fm.trace(scene.replace(mesh=fm.disc(32, ratio)), start=0.5, until={"center_height": 4.5}) for ratio in (1, 1e-6, 1e6)]
    assert len({len(branch) for branch in branches}) == 1
    for branch in branches[1:]:
        assert branch.memory.sigma[-1] == pytest.approx(3.9062666, rel=1e-3)
        for point, uniform in zip(branch.special_points, branches[0].special_points, strict=True):
            assert (point.kind, point.pressure) == (uniform.kind, pytest.approx(uniform.pressure, rel=1e-10))


def test_surfaces_of_graded_meshes(tmp_path):
    import meshio

    eq, _ = on_graded("dipole_below-0.5", 3, 1e6)
    fm.Branch(eq.scene, (eq,)).to_vtk(tmp_path / "membrane.pvd")
    (path,) = tmp_path.rglob("*.vtu")
    points = meshio.read(path).points
    assert np.isfinite(points).all()
    assert points[:, 2].max() == pytest.approx(eq.center_height, rel=1e-9)
    assert np.hypot(points[:, 0], points[:, 1]).max() == pytest.approx(eq.profile()["rho"].max(), rel=1e-6)


# --- quadrature


@pytest.mark.parametrize("degree", DEGREES)
def test_quadrature_is_exact_for_its_degree(degree):
    """2 p + 1 by default, enough for the mass matrix of the disc; Int r^k dr = 1/(k + 1)."""
    space = Space(Disc(1), degree)
    for k in range(2 * degree + 2):
        assert (space.weights * space.s**k).sum() == pytest.approx(2 * np.pi / (k + 1), rel=1e-12)


@pytest.mark.parametrize("name", ["ogden_disc-2", "dipole_below-0.5", "dipole_above-4.7"])
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_quadrature_matters_less_than_the_mesh(degree, name):
    """Integrating far more accurately changes P by less than the discretisation is in error."""
    point = next(p for p in POINTS if p.name == name)
    scene = point.scene.replace(mesh=fm.disc(elements=32), degree=degree)
    eq = fm.equilibrium(scene, volume=point.expected["volume"], solver="newton")
    finer = Potential(scene, quadrature=4 * degree + 9)
    result = correct(finer, VolumeControl(point.expected["volume"]), eq.state, eq.pressure)
    assert result.status is fm.Status.CONVERGED
    assert abs(result.pressure - eq.pressure) < abs(eq.pressure - point.expected["pressure"])


@pytest.mark.parametrize(("mesh", "degree"), [(fm.sphere(elements=1), 2), (fm.annulus(0.3, elements=1, inner="clamped"), 1)])
def test_a_mesh_that_holds_no_shape_is_refused(mesh, degree):
    with pytest.raises(fm.InputError, match=r"mesh\.elements"):
        fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=mesh, degree=degree), volume=5.0)


@pytest.mark.parametrize("degree", [1, 2, 3, 6, 9])
def test_an_end_of_an_element_is_its_node_however_many_points_are_asked_for(degree):
    """To the bit, or a pole would leave the axis by round-off. Between them few points and many answer alike."""
    many = np.linspace(0.0, 1.0, 101)
    value, slope = shape_functions(degree, many)
    assert value[[0, -1]].tolist() == np.eye(degree + 1)[[0, -1]].tolist()
    for k in (0, 37, 100):
        few, rate = shape_functions(degree, many[k : k + 1])
        np.testing.assert_allclose(value[k], few[0], rtol=0, atol=1e-14)
        np.testing.assert_allclose(slope[k], rate[0], rtol=0, atol=1e-12)

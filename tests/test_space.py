"""The finite-element space and its quadrature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.discretization.meridian import Disc
from femmembrane.discretization.space import Space
from femmembrane.potential import Potential
from femmembrane.solve.banded import band_product
from femmembrane.solve.controls import VolumeControl
from femmembrane.solve.newton import correct

from .cases import POINTS, disc_scene

DEGREES = (1, 2, 3, 4, 6, 8)


@dataclass(frozen=True)
class Graded(Disc):
    """Elements that shrink towards the pole."""

    def breakpoints(self):
        return np.linspace(0, 1, self.elements + 1) ** 1.5


MESHES = [Disc(5), Graded(5)]


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
